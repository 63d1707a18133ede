from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from evolution.files import GrowingCsv, csv_of

ROWS = st.lists(st.dictionaries(st.sampled_from("abc"), st.integers() | st.sampled_from(["=1", "x,y", ""])), max_size=8)


@given(ROWS, st.lists(st.integers(0, 8), max_size=3))
def test_a_table_that_grows_is_what_it_would_be_at_once(rows, stops):
    table = GrowingCsv()
    for stop in sorted(stops):
        assert table.text(rows[:stop]) == csv_of(rows[:stop])
    assert table.text(rows) == csv_of(rows)


def test_a_row_is_made_text_once():
    class Counted(dict):
        reads = 0

        def get(self, *args):
            self.reads += 1
            return super().get(*args)

    rows = [Counted(a=1), Counted(a=2)]
    table = GrowingCsv()
    table.text(rows[:1])
    table.text(rows)
    assert [row.reads for row in rows] == [1, 1]
