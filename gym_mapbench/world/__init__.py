"""The world of one episode: walls, moving bodies, and a robot with its sensors, in physics.

In: a :class:`~gym_mapbench.world.scenario.Scenario` (map, start, goal, bodies), a robot, commands in m/s and rad/s.
Out: true pose and velocity, what the robot touched, scans, and the estimates of odometry and localisation.

==============  ==========================================================================================
data            ``gridmap`` walls, ``bodies`` and ``motions`` what moves, ``scenario`` map and task, ``robot``
home            ``world``: walls and bodies with one clock; everything below asks it where bodies are
physics         ``simulation`` float64 motion, ``box2d`` contacts, ``state`` arrays of many worlds
sensors         ``lidar``, ``noise``, ``localisation``, ``frames``
geometry        ``clearance`` room for the robot, ``footprint`` Nav2's padded polygon
==============  ==========================================================================================

The room knows neither tasks nor rewards, and imports costmaps, planners, envs and controllers nowhere.
"""
