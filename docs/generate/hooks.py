"""Hooks of MkDocs: fill pages in, draw pictures, and refuse pages that load something from another host."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from docs.generate.inserts import filled  # noqa: E402
from docs.generate.labels import labelled  # noqa: E402
from docs.generate.made import made_files  # noqa: E402

PICTURE = re.compile(r'(<img [^>]*src="([^"]+)"[^>]*>)')
FROM_ELSEWHERE = re.compile(r"<(?:script|link|img|iframe|source)\b[^>]*\b(?:src|href)=[\"']?(?:https?:)?//[^>]*>")


def on_files(files: Files, config: Any) -> Files:
    """Add the files that are made from data and code."""
    for path in made_files(ROOT / ".cache" / "docs"):
        files.append(File.generated(config, f"made/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Fill in the inserts of a page; a page without a section has no column of navigation."""
    if page.parent is None:
        page.meta["hide"] = ["navigation"]
    return filled(markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Make every picture a link to itself, and label the cells of tables: both for small screens."""
    return labelled(PICTURE.sub(r'<a href="\2">\1</a>', html))


def on_post_page(output: str, page: Page, **_: Any) -> str:
    """Refuse a page that cannot be read without a network."""
    if found := FROM_ELSEWHERE.search(output):
        raise PluginError(f"{page.file.src_uri}: loads something from another host: {found[0]}")
    return output
