"""The Gymnasium envs: task, actions, observations and rewards in a world.

In: an :class:`~gym_mapbench.env.config.EnvConfig`, scenarios, actions. Out: observations, rewards, the end of an
episode, ``info``, and pictures. ``single`` is the env of one world, ``vector`` steps many worlds with the same
kernels (``batch``, ``traffic``). The parts are ``action``, ``observation``, ``task``, ``scenario_source`` and
``render``; ``config`` and ``groups`` hold the options.
"""
