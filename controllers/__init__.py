"""Controllers: policies over the env API.

``registry.make_controller("mppi")`` makes a controller, ``rl.as_controller`` turns any learned policy into one, and
``base`` defines the interface of a controller. Nothing is imported here, so that importing ``base`` alone stays cheap.
"""
