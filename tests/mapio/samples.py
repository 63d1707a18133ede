"""Small files in every format, written by hand, and the maps that hypothesis draws."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gym_mapbench.mapio.barn import LATTICE_ROWS
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario

YAML = """\
image: {image}
resolution: 0.1
origin: [-1.0, 2.0, 0.0]
negate: {negate}
occupied_thresh: 0.65
free_thresh: 0.196
mode: {mode}
"""

MOVINGAI_MAP = "type octile\nheight 4\nwidth 5\nmap\n@@@@@\n@..T@\n@.G.W\n@@O@@\n"
MOVINGAI_SCEN = "version 1\n0\tmaps/tiny.map\t5\t4\t1\t1\t3\t2\t2.41421356\n0\tmaps/tiny.map\t5\t4\t1\t2\t2\t2\t1.0\n"

MRPB_CONFIG = """\
# Test 1
<arg name="initial_pose_x" default="-0.85"/>
<arg name="initial_pose_y" default="2.15"/>
<arg name="initial_pose_a" default="1.571"/>

<arg name="goal_pose_x" default="-0.75"/>
<arg name="goal_pose_y" default="2.25"/>
<arg name="goal_pose_a" default="-3.142"/>
"""


def map_server_files(folder, values, name="office", mode="trinary", negate=0, white=255):
    """Write a P5 picture of the given grey values (row 0 at the top) and its YAML file; return the latter."""
    rows, cols = values.shape
    kind = np.uint8 if white < 256 else ">u2"
    header = b"P5\n# made by hand\n%d %d\n%d\n" % (cols, rows, white)
    (folder / f"{name}.pgm").write_bytes(header + values.astype(kind).tobytes())
    path = folder / f"{name}.yaml"
    path.write_text(YAML.format(image=f"{name}.pgm", mode=mode, negate=negate))
    return path


def barn_world(cells):
    """Return a world with cylinders in these lattice cells, and others inside its state."""
    model = "<model name='unit_cylinder_{n}'><pose frame=''>{x:.6f} {y:.6f} 0 0 0 0</pose>{link}</model>"
    link = (
        "<link name='link'><collision name='c'><geometry><cylinder><radius>0.075000</radius><length>1</length>"
        "</cylinder></geometry></collision></link>"
    )
    plane = "<model name='ground_plane'><link name='link'/></model>"
    models = "".join(
        model.format(n=n, x=0.15 * (col - 30) + 0.075, y=0.15 * row + 0.075, link=link)
        for n, (row, col) in enumerate(cells)
    )
    moved = model.format(n=0, x=-2.025, y=0.075 + 0.15 * 7, link=link)
    return f"<sdf version='1.6'><world name='default'>{plane}{models}<state>{moved}</state></world></sdf>"


def barn_border():
    """Cells of the corridor that every world has: floor and both sides."""
    floor = [(0, col) for col in range(30)]
    return floor + [(row, col) for row in range(1, LATTICE_ROWS) for col in (0, 29)]


def grids(max_side=14, unknown=True):
    """Draw maps of 2 x 2 to ``max_side`` squared with any resolution and origin, some cells unknown."""
    shapes = st.tuples(st.integers(2, max_side), st.integers(2, max_side))

    def build(shape):
        cells = arrays(np.bool_, shape)
        hidden = st.none() | arrays(np.bool_, shape) if unknown else st.none()
        resolution = st.floats(1e-3, 10).map(lambda value: float(np.float32(value)))
        corner = st.floats(-1e3, 1e3)
        return st.builds(_grid, cells, hidden, resolution, st.tuples(corner, corner))

    return shapes.flatmap(build)


def _grid(cells, hidden, resolution, origin):
    cells = cells.copy()
    cells[0, 0] = cells[-1, -1] = False
    if hidden is not None:
        cells &= ~hidden
    return GridMap(cells, resolution, origin, hidden)


def scenario_on(grid, name="drawn"):
    """Put the task from the lower left to the upper right cell on a map of :func:`grids`."""
    rows, cols = grid.shape
    start = Pose(*grid.cell_to_world(0, 0), 0.3)
    goal = Pose(*grid.cell_to_world(rows - 1, cols - 1), -2.0)
    return Scenario(grid, start, goal, name)


def map_sets():
    """Draw map sets of one to three maps."""
    return st.lists(grids(), min_size=1, max_size=3).map(
        lambda drawn: MapSet(tuple(scenario_on(grid, f"map_{n}") for n, grid in enumerate(drawn)))
    )
