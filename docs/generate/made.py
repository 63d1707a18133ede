"""The files of the site that are made from data and code, kept until one of their sources changes."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

from docs.generate.gallery import gallery_files, save_small
from docs.generate.pictures import PICTURES

ROOT = Path(__file__).parents[2]
SOURCES = ("gym_mapbench", "controllers", "evolution", "docs/generate", "docs/gallery", "docs/concepts", "examples")
SUFFIXES = (".py", ".yaml", ".pgm", ".json", ".csv", ".j2", ".js", ".css")


def made_files(folder: Path) -> list[Path]:
    """Return all files; they are made again if a source has changed."""
    key = folder / "sources.sha256"
    now = _digest()
    if not key.is_file() or key.read_text(encoding="utf-8") != now:
        folder.mkdir(parents=True, exist_ok=True)
        for path in folder.iterdir():
            path.unlink()
        names = [path.name for path in (*_pictures(folder), *gallery_files(folder))]
        print(f"made for the site: {', '.join(names)}")
        key.write_text(now, encoding="utf-8")
    return sorted(path for path in folder.iterdir() if path != key)


def _pictures(folder: Path) -> Iterator[Path]:
    return (save_small(make(), folder / name) for name, make in PICTURES.items())


def _digest() -> str:
    """Return a digest of the names and contents of all sources."""
    found = hashlib.sha256()
    paths = [path for source in SOURCES for path in (ROOT / source).rglob("*") if path.suffix in SUFFIXES]
    for path in sorted(paths):
        found.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes())
    return found.hexdigest()
