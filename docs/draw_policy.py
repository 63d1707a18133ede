"""Draw docs/policy.gif: the shipped policies beside MPPI on a map that none of them has seen.

Run from the root of the project: python docs/draw_policy.py --map FILE --scenario N.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from evolution.driving import ControllerSpec, DriveSettings, JobPlan, drive
from evolution.pictures import Frame, frames
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.robot import RobotSpec

POLICIES = [Path("examples/policies/ppo.zip"), Path("examples/policies/ppo_path.zip")]
SIDE = 240
EVERY = 16
"""Control steps between two pictures; there are 20 a second."""
COLOURS = 16
PAUSE = 2000


def main() -> None:
    """Drive them and write the film."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--map", type=Path, required=True, help="any file of maps")
    parser.add_argument("--scenario", type=int, default=1, help="which of them (default 1)")
    parser.add_argument("--policy", type=Path, nargs="+", default=POLICIES, help="models (default: the shipped ones)")
    parser.add_argument("--out", type=Path, default=Path("docs/policy.gif"))
    args = parser.parse_args()
    scenario = load_scenarios(args.map)[args.scenario - 1]
    policies = [ControllerSpec(name=path.stem, kind=str(path.resolve())) for path in args.policy]
    controllers = [*policies, ControllerSpec(name="mppi", kind="mppi")]
    settings = DriveSettings(navigation="fair")
    episodes = [drive(job) for job in JobPlan(controllers, settings, 0).jobs(scenario)]
    pictures = [Image.fromarray(frame).quantize(COLOURS) for frame in beside(episodes, settings)]
    durations = [EVERY * 50 // 4] * (len(pictures) - 1) + [PAUSE]  # four times as fast as the robot
    pictures[0].save(args.out, save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=True)


def beside(episodes: Sequence[Episode], settings: DriveSettings) -> Iterator[Frame]:
    """Draw the runs side by side; the one that ends first waits for the others."""
    robot = settings.environment.robot
    films = [film(episode, robot) for episode in episodes]
    for row in zip_longest(*films):
        yield np.hstack([film[-1] if frame is None else frame for frame, film in zip(row, films, strict=True)])


def film(episode: Episode, robot: RobotSpec) -> list[Frame]:
    """Draw a run at the speed of the others, however many of its states are drawn."""
    drawn = [titled(frame, episode) for frame in frames(episode, robot, SIDE)]
    return drawn[:: round(EVERY * len(drawn) / len(episode.trajectory))]


def titled(frame: Frame, episode: Episode) -> Frame:
    """Write who drives, and how long it took, above a picture."""
    picture = Image.new("RGB", (frame.shape[1], frame.shape[0] + 16), "white")
    picture.paste(Image.fromarray(frame), (0, 16))
    ImageDraw.Draw(picture).text((4, 2), f"{episode.controller}: {episode.outcome}, {episode.time:.1f} s", fill="black")
    return np.asarray(picture)


if __name__ == "__main__":
    main()
