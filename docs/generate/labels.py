"""Labels the cells of tables with the headings of their columns, so that style.css can stack a row on a telephone."""

from __future__ import annotations

import html
import re

TABLE = re.compile(r"<table>.*?</table>", re.DOTALL)
ROW = re.compile(r"<tr>.*?</tr>", re.DOTALL)
HEADING = re.compile(r"<th[^>]*>(.*?)</th>", re.DOTALL)
TAG = re.compile(r"<[^>]+>")


def labelled(page: str) -> str:
    """Return a page whose table cells have the heading of their column as ``data-label``."""
    return TABLE.sub(lambda table: _labelled_table(table[0]), page)


def _labelled_table(table: str) -> str:
    headings = [html.escape(html.unescape(TAG.sub("", heading)).strip()) for heading in HEADING.findall(table)]
    return ROW.sub(lambda row: _labelled_row(row[0], headings), table)


def _labelled_row(row: str, headings: list[str]) -> str:
    labels = iter(headings)
    return re.sub(r"<td", lambda _: f'<td data-label="{next(labels)}"', row)
