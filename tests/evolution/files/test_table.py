"""Tables as text, CSV and HTML; digits as a reader wants them."""

from __future__ import annotations

import pytest

from evolution.files import Table, counted

ROWS = [
    {"map": "a <b>", "goals": "1/2", "mean s": 12.345678, "recoveries": 0.0},
    {"map": "office", "goals": "2/2", "mean s": None, "recoveries": 2.5, "note": "late"},
]


def test_text_is_aligned_and_short():
    lines = str(Table(ROWS, "Times")).splitlines()
    assert lines[0] == "Times"
    assert lines[1].split() == ["map", "goals", "mean", "s", "recoveries", "note"]
    assert lines[2].split() == ["a", "<b>", "1/2", "12.35", "0", "-"]
    assert lines[3].split() == ["office", "2/2", "-", "2.5", "late"]
    assert len({line.index(text) + len(text) for line, text in ((lines[2], "12.35"), (lines[3], " -"))}) == 1


def test_a_notebook_shows_texts_escaped():
    page = Table(ROWS, "a & b")._repr_html_()
    assert "a &lt;b&gt;" in page
    assert "<caption>a &amp; b</caption>" in page
    assert page.count("<tr>") == 3


def test_it_is_a_sequence_of_rows():
    table = Table(ROWS)
    assert table[1] is ROWS[1]
    assert list(table) == table[:] == ROWS
    assert table.columns == ("map", "goals", "mean s", "recoveries", "note")
    assert [table.numeric(name) for name in table.columns] == [False, False, True, True, False]
    assert table.to_csv().splitlines()[2] == "office,2/2,,2.5,late"


def test_pandas_gets_the_same_rows():
    pytest.importorskip("pandas")
    frame = Table(ROWS).to_pandas()
    assert list(frame.columns) == ["map", "goals", "mean s", "recoveries", "note"]
    assert frame["recoveries"].sum() == 2.5


def test_no_rows_are_no_error():
    assert str(Table([])) == ""
    assert "<table>" in Table([])._repr_html_()


def test_a_noun_agrees_with_its_number():
    assert [counted(number, "held-out seed") for number in (0, 1, 2)] == [
        "0 held-out seeds",
        "1 held-out seed",
        "2 held-out seeds",
    ]
    assert [counted(number, "search", "searches") for number in (1, 2)] == ["1 search", "2 searches"]
