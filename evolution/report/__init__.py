"""Report: one self-contained HTML file about a run or a study.

In: the directory of a run or a study. Out: one file that needs no network, with verdict, replays, tables and figures.
"""

from __future__ import annotations

from evolution.report.page import Attachment, Section, Table, picture
from evolution.report.sections import SECTIONS
from evolution.report.writing import REPORT, write_report

__all__ = ["REPORT", "SECTIONS", "Attachment", "Section", "Table", "picture", "write_report"]
