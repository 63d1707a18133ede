"""Draw docs/families.png: one map of every family. Run from the root of the project: python docs/draw_families.py."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evolution.pictures import maps_figure, save_figure
from gym_mapbench import EnvConfig, GridMap
from gym_mapbench.generator import FAMILIES, draw_from

SEED = 3


def main() -> None:
    """Draw the maps and write the picture."""
    scenarios = []
    for name in FAMILIES:
        config = EnvConfig(family=name)
        drawn = draw_from(np.random.default_rng(SEED), config.family, config.shapes, config.robot)
        scenarios.append(config.make_scenario(GridMap(drawn.cells, config.shapes.resolution), name))
    save_figure(maps_figure(scenarios), Path("docs/families"), formats=("png",))


if __name__ == "__main__":
    main()
