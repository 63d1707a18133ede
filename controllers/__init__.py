"""Controllers: policies over the env API.

``registry.make_controller("mppi")`` makes one, ``rl.as_controller`` turns any learned policy into one, and
``base`` says what one is. Nothing is imported here, so that ``base`` alone stays cheap.
"""
