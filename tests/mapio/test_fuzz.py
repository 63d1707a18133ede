from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.errors import MapBenchError
from gym_mapbench.mapio import load_maps
from tests.mapio.fuzz import check_refusal, fuzz, load, write_samples

SUFFIXES = [".yaml", ".pgm", ".png", ".bmp", ".jpg", ".json", ".map", ".scen", ".world"]


def test_the_samples_themselves_load(tmp_path):
    for path, _ in write_samples(tmp_path):
        assert load(path) >= 0


@pytest.mark.parametrize("seed", range(2))
def test_damaged_files_load_or_are_refused_in_one_line(tmp_path, seed):
    ends = fuzz(write_samples(tmp_path), np.random.default_rng(seed), seconds=10.0, most=300)
    assert set(ends) == {"loaded", "refused"}


@given(data=st.binary(max_size=200), suffix=st.sampled_from(SUFFIXES))
@settings(max_examples=150, deadline=None)
def test_any_bytes_under_any_name_are_refused_or_read(tmp_path_factory, data, suffix):
    path = tmp_path_factory.getbasetemp() / f"any{suffix}"
    path.write_bytes(data)
    try:
        load_maps(path)
    except MapBenchError as error:
        check_refusal(error)


@given(text=st.text(max_size=200), suffix=st.sampled_from([".yaml", ".json", ".scen", ".world", ".map"]))
@settings(max_examples=150, deadline=None)
def test_any_text_under_any_name_is_refused_or_read(tmp_path_factory, text, suffix):
    path = tmp_path_factory.getbasetemp() / f"any{suffix}"
    path.write_text(text, encoding="utf-8", errors="surrogatepass")
    try:
        load_maps(path)
    except MapBenchError as error:
        check_refusal(error)
