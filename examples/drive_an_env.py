"""Make an env and drive it with a rule of your own.

Shows: `gymnasium.make`, what the robot observes, the loop of an episode, and its picture.
Takes: a few seconds; the first time on a machine about a minute more, for compiling.
Comes out: how each episode ended, and the last one as `drive_an_env.png` in the current directory.
"""

import os
from pathlib import Path

import gymnasium
import numpy as np
from PIL import Image

import gym_mapbench  # noqa: F401 - registers MapBench-v0

SMALL = bool(os.environ.get("MAPBENCH_SMALL"))  # the tests run a small form
EPISODES = 2 if SMALL else 5
OFFICE = Path(__file__).parent / "office.yaml"


def along_the_path(observation):
    """Return a speed (m/s) and a turn rate (rad/s): towards a point of the path, slowly where a wall is near."""
    goal_x, goal_y, goal_yaw = observation["goal"]  # in the robot's frame: x forwards, y to the left
    if np.hypot(goal_x, goal_y) < 0.2:
        return 0.0, 1.5 * goal_yaw
    points = observation["path"].reshape(-1, 2)
    x, y = points[np.argmin(abs(np.hypot(*points.T) - 0.4))]  # the one nearest to 0.4 m away
    room = observation["scan"].min() - 0.22  # m between the nearest wall and the robot's outline
    speed = 0.4 * np.clip(room / 0.3, 0.2, 1.0) * max(0.0, np.cos(np.arctan2(y, x)))
    return speed, 2.0 * np.arctan2(y, x)


env = gymnasium.make(
    "MapBench-v0",
    maps=str(OFFICE),
    observation=["goal", "path", "scan"],
    noise="nominal",
    time_limit=60.0,
    render_mode="rgb_array",
)
print("observed:", {key: space.shape for key, space in env.observation_space.items()})
for seed in range(EPISODES):
    observation, info = env.reset(seed=seed)
    terminated = truncated = False
    total = 0.0
    while not (terminated or truncated):
        observation, reward, terminated, truncated, info = env.step(along_the_path(observation))
        total += reward
    print(f"seed {seed}: {info['outcome']} after {info['time']:.1f} s, reward {total:.1f}")
Image.fromarray(env.render()).save("drive_an_env.png")
