"""Report: one self-contained HTML file about a run, a study or a benchmark.

In: the directory of a run or a study, or a benchmark. Out: one file that needs no network, with verdict,
replays, tables and figures.
"""

from __future__ import annotations

from evolution.report.atlas_page import write_atlas_report
from evolution.report.benchmark_page import verdict_of_benchmark, write_benchmark_report
from evolution.report.comparison_page import write_comparison_report
from evolution.report.minimized_page import write_minimized_report
from evolution.report.page import Section, Table, picture
from evolution.report.run_page import changed_replays, replay_page
from evolution.report.sections import SECTIONS
from evolution.report.writing import new_page, write_report

__all__ = [
    "SECTIONS",
    "Section",
    "Table",
    "changed_replays",
    "new_page",
    "picture",
    "replay_page",
    "verdict_of_benchmark",
    "write_atlas_report",
    "write_benchmark_report",
    "write_comparison_report",
    "write_minimized_report",
    "write_report",
]
