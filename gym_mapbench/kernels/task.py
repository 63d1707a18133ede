"""The task of an episode: when it ends, and the reward of a step."""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.field import distance_at
from gym_mapbench.kernels.geometry import wrap_angle
from gym_mapbench.kernels.jit import kernel

RUNNING, GOAL, COLLISION, TIMEOUT = range(4)

TASK = np.dtype(
    [(name, np.float64) for name in ("goal_x", "goal_y", "goal_yaw", "distance")]
    + [(name, np.int64) for name in ("steps", "outcome", "touched")]
    + [(name, np.bool_) for name in ("near_goal", "arrived")]
    + [(name, np.float64) for name in ("progress", "time", "collision", "goal", "reward")],
    align=True,
)
"""How an episode stands: the goal (m, rad); distance to it (m), control steps, how it ended, and what the robot touched
in the last step (0 for nothing); whether the robot was near the goal, and reached it; the terms of the last reward, and
their sum."""

RULES = np.dtype(
    [(name, np.float64) for name in ("xy_tolerance", "yaw_tolerance", "period", "max_steps")]
    + [(name, np.bool_) for name in ("collision_ends", "goal_ends")]
    + [(name, np.float64) for name in ("progress", "time", "collision", "goal")],
    align=True,
)
"""Tolerances at the goal (m, rad), control period (s), control steps until the time limit, what ends an episode, and
the weights of the reward."""


@kernel
def judge_worlds(tasks, running, rules, robots, touched, grounds, fields):
    """Judge a control step of all worlds that are running; arguments as for :func:`judge`, fields flat."""
    for i in range(len(tasks)):
        if running[i]:
            ground = grounds[i]
            rows, cols = (ground.rows, ground.cols) if rules[0].progress != 0.0 else (0, 0)
            field = fields[i, : rows * cols].reshape((rows, cols))
            judge(tasks, i, rules, robots, touched[i], grounds, field)


@kernel
def judge(tasks, i, rules, robots, touched, grounds, field):
    """Judge one control step of one world; return how its episode stands, see :func:`standing_of`.

    Args:
        tasks: ``(n,)`` TASK, in and out.
        i: Which one.
        rules: ``(1,)`` RULES.
        robots: ``(n,)`` ROBOT after the step.
        touched: What the robot touched during the step, 0 for nothing.
        grounds: ``(n,)`` GROUND.
        field: ``(rows, cols)`` distances to the goal, cells; not read where progress has no weight.
    """
    task, rule, robot, ground = tasks[i], rules[0], robots[i], grounds[i]
    contact = touched != 0
    task.steps += 1
    at_goal = is_at_goal(task, rule, robot.x, robot.y, robot.yaw)
    out_of_time = task.steps >= rule.max_steps
    task.outcome = decide_outcome(contact and rule.collision_ends, at_goal and rule.goal_ends, out_of_time)
    distance = 0.0
    if rule.progress != 0.0:
        distance = distance_at(field, ground.resolution, ground.origin_x, ground.origin_y, robot.x, robot.y)
    began = (touched & ~task.touched) != 0  # a body may come while the robot slides along a wall
    reward(task, rule, task.distance - distance, began, at_goal and not task.arrived)
    task.distance, task.touched, task.arrived = distance, touched, at_goal or task.arrived
    return standing_of(tasks, i)


@kernel
def standing_of(tasks, i):
    """Outcome, control steps, last reward, and its terms: progress, time, collision and goal."""
    task = tasks[i]
    return task.outcome, task.steps, task.reward, task.progress, task.time, task.collision, task.goal


@kernel
def is_at_goal(task, rule, x, y, yaw):
    """Whether the goal is reached, as Nav2's stateful SimpleGoalChecker decides it."""
    if not task.near_goal:
        dx, dy = task.goal_x - x, task.goal_y - y
        task.near_goal = dx * dx + dy * dy <= rule.xy_tolerance * rule.xy_tolerance
    return task.near_goal and abs(wrap_angle(task.goal_yaw - yaw)) <= rule.yaw_tolerance


@kernel
def decide_outcome(collision, goal, out_of_time):
    """Return how the episode stands; a touch on the way into the goal is a collision."""
    if collision:
        return COLLISION
    if goal:
        return GOAL
    return TIMEOUT if out_of_time else RUNNING


@kernel
def reward(task, rule, progress, touched, arrived):
    """Write every term of the reward of one step, and their sum.

    Args:
        task: TASK, out.
        rule: RULES.
        progress: By how much the geodesic distance to the goal shrank, m.
        touched: Whether a contact began.
        arrived: Whether the goal was reached for the first time.
    """
    task.progress = rule.progress * progress
    task.time = -rule.time * rule.period
    task.collision = -rule.collision if touched else 0.0
    task.goal = rule.goal if arrived else 0.0
    task.reward = task.progress + task.time + task.collision + task.goal
