"""Write ``golden.json``: the few recorded Nav2 results that the tests keep where the recorded data is not at hand.

Run as ``python -m tests.oracle.write_golden`` beside the recorded data.
"""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from pathlib import Path

import numpy as np

from tests.oracle_data import ORACLE

GOLDEN = Path(__file__).with_name("golden.json")
CASES = (("A", 3), ("B", 8))
EVERY = 25


def golden_case(preset: str, index: int) -> dict[str, object]:
    """Pack one map with what Nav2 made of it: row 0 of the map at the top, as recorded."""
    plans = np.load(ORACLE / f"plans_{preset}.npz")
    path = plans["path"][plans["path_offset"][index] : plans["path_offset"][index + 1]]
    packed = zlib.compress(np.packbits(np.load(ORACLE / "maps.npz")["occupied"][index]).tobytes(), 9)
    return {
        "preset": json.loads((ORACLE / "config.json").read_text())["presets"][preset],
        "occupied": base64.b64encode(packed).decode(),
        "costmap_blake2b": hashlib.blake2b(plans["costmap"][index].tobytes(), digest_size=16).hexdigest(),
        "pot_n_reached": int(plans["pot_n_reached"][index]),
        "pot_max": float(plans["pot_max"][index]),
        "path_points": len(path),
        "path_length": float(plans["path_length"][index]),
        "path_every_25th": path[::EVERY].tolist(),
    }


if __name__ == "__main__":
    GOLDEN.write_text(json.dumps([golden_case(*case) for case in CASES], indent=1) + "\n")
