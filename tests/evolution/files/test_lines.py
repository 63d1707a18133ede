"""JSON lines: a line that was not written to its end hides only itself."""

from __future__ import annotations

import json

import pytest

from evolution.files import append_line, read_json_lines


@pytest.mark.parametrize("torn", [1, 7, 20])
def test_a_torn_line_hides_only_itself(tmp_path, torn):
    path = tmp_path / "timing.jsonl"
    rows = [{"generation": number, "seconds": 2.5} for number in range(1, 4)]
    append_line(path, json.dumps(rows[0]))
    with path.open("a") as file:
        file.write(json.dumps(rows[1])[:torn])
    for row in rows[1:]:
        append_line(path, json.dumps(row))
    assert read_json_lines(path) == rows
    assert read_json_lines(tmp_path / "missing.jsonl") == []
