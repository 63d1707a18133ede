"""Films of one recorded run, from frames of the env's renderer."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from gym_mapbench.env.render import SeenCostmap, Snapshot, Window, draw
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.crowd import Track, place_crowd
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose

FRAMES_PER_SECOND = 20
MAX_FRAMES = 400
GIF_COLOURS = 64
FFMPEG = "ffmpeg"
Frame = NDArray[np.uint8]


Seen = Sequence[SeenCostmap]


def frames(episode: Episode, robot: RobotSpec, size: int = 480, seen: Seen = ()) -> Iterator[Frame]:
    """Draw a run: at most 401 ``(height, width, 3)`` uint8 frames, evenly spaced in time up to the last state.

    Args:
        episode: The recorded run.
        robot: The robot of the run.
        size: Length of the longer side, pixels.
        seen: A costmap for every control step, to lay over the map; none if empty.
    """
    path = episode.path if len(episode.path) else None
    times = np.arange(len(episode.trajectory), dtype=np.float64) * episode.control_period
    track = Track(episode.control_period, episode.trajectory)
    bodies = place_crowd(episode.scenario.map, episode.scenario.bodies, times, track)
    for row in frame_rows(len(episode.trajectory)):
        pose = Pose(*episode.trajectory[row, :3].tolist())
        overlay = seen[min(row, len(seen) - 1)] if seen else None
        trail = episode.trajectory[: row + 1, :2]
        yield draw(Snapshot(episode.scenario, robot, pose, trail, path, seen=overlay, bodies=bodies[row]), size)


def frame_rows(count: int) -> list[int]:
    """Return the rows of the trajectory to draw: all, or every n-th of a long run, and the last."""
    every = -(-count // MAX_FRAMES)
    rows = list(range(0, count, every))
    return rows if rows[-1] == count - 1 else [*rows, count - 1]


def check_film(path: Path) -> None:
    """Refuse a film that cannot be written, before anything runs.

    Raises:
        ConfigError: If the ending is neither ``.gif`` nor ``.mp4``, the file exists, or its directory cannot be
            written.
        RunError: If ``ffmpeg`` is missing, which an ``.mp4`` needs.
    """
    if path.suffix not in _WRITERS:
        raise ConfigError(f"{path}: expected a name that ends in {' or '.join(_WRITERS)}")
    if path.exists():
        raise ConfigError(f"{path}: exists already; nothing is overwritten")
    if not (path.parent.is_dir() and os.access(path.parent, os.W_OK)):
        raise ConfigError(f"{path}: expected a name in a directory that can be written")
    if path.suffix == ".mp4" and shutil.which(FFMPEG) is None:
        raise RunError(f"{path}: a film needs the program ffmpeg, which is not installed; a .gif does not")


def check_display() -> None:
    """Refuse to show a run if matplotlib has no window, before anything runs.

    Raises:
        ConfigError: If there is no display.
    """
    import matplotlib.pyplot as plt

    if plt.get_backend().lower() == "agg":
        raise ConfigError("show: expected a display for a window, got none; a .gif needs none")


def save_animation(episode: Episode, robot: RobotSpec, path: Path, seen: Seen = ()) -> None:
    """Write a run as ``.gif`` or ``.mp4``, 20 frames a second; ``seen`` as for :func:`frames`.

    Raises:
        ConfigError: As :func:`check_film`.
        RunError: If ``ffmpeg`` is missing or fails.
    """
    check_film(path)
    _WRITERS[path.suffix](episode, robot, path, seen)


def show_animation(episode: Episode, robot: RobotSpec, seen: Seen = ()) -> None:
    """Show a run in a window; ``seen`` as for :func:`frames`."""
    window = Window()
    for frame in frames(episode, robot, seen=seen):
        window.show(frame, 1.0 / FRAMES_PER_SECOND)
    window.close()


def _save_gif(episode: Episode, robot: RobotSpec, path: Path, seen: Seen) -> None:
    write_gif(list(frames(episode, robot, 360, seen)), path, 1000 // FRAMES_PER_SECOND, 1500)


def write_gif(frames: Sequence[Frame], path: Path, milliseconds: int, last: int) -> None:
    """Write frames as a GIF in one palette of :data:`GIF_COLOURS` colours, from the first, middle and last frame.

    Args:
        frames: The frames, of one size.
        path: The file.
        milliseconds: Shown time of a frame.
        last: Shown time of the last frame, ms.
    """
    typical = np.vstack([frames[0], frames[len(frames) // 2], frames[-1]])
    palette = Image.fromarray(typical).quantize(GIF_COLOURS)
    pictures = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    durations = [milliseconds] * (len(pictures) - 1) + [last]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=True)


def _save_mp4(episode: Episode, robot: RobotSpec, path: Path, seen: Seen) -> None:
    """Pass the raw frames to ffmpeg, cut to even width and height, as its usual codec requires."""
    drawn = [frame[: len(frame) // 2 * 2, : frame.shape[1] // 2 * 2] for frame in frames(episode, robot, seen=seen)]
    height, width, _ = drawn[0].shape
    options = f"-y -f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {FRAMES_PER_SECOND} -i - -pix_fmt yuv420p".split()
    done = subprocess.run(
        [FFMPEG, *options, str(path)],
        input=b"".join(frame.tobytes() for frame in drawn),
        capture_output=True,
        check=False,
    )
    if done.returncode != 0:
        reason = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
        raise RunError(f"{path}: ffmpeg could not write it ({' '.join(reason)})")


_WRITERS = {".gif": _save_gif, ".mp4": _save_mp4}
