"""Published parameter files, converted and then driven."""

from __future__ import annotations

from pathlib import Path

import pytest

from controllers.nav2_params import read_nav2_params
from evolution.cli import main
from tests.oracle_data import DATA, needs_data

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
WITHOUT_OUR_CONTROLLERS = ("neo_rox_diff_jazzy",)
"""Files whose only controller is another maker's."""


@pytest.mark.slow
@needs_data
@pytest.mark.parametrize("path", sorted((DATA / "nav2_params").glob("*.yaml")), ids=lambda path: path.stem)
def test_a_file_that_was_converted_to_lyrical_drives(path, tmp_path):
    out = tmp_path / "lyrical.yaml"
    assert main(["params", "convert", str(path), "--nav2", "lyrical", "--out", str(out)]) == 0
    own = () if path.stem in WITHOUT_OUR_CONTROLLERS else read_nav2_params(out).own_controllers
    chosen = ["--controllers", ",".join(own) or "dwb"]
    options = ["--time-limit", "3", "--repeats", "1", "--workers", "1", "--out", str(tmp_path / "runs")]
    assert main(["bench", str(EXAMPLES / "hall.yaml"), "--params", str(out), *chosen, *options]) == 0
