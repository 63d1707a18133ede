"""Files of a tree: the trees of those that a file includes come into one text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, ParseError, tostring

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from gym_mapbench.errors import ConfigError

LARGEST, MOST_FILES = 1_000_000, 100
"""Largest size of a file together with those that it includes, bytes, and the largest number of these files."""
DEEPEST = 100
"""Largest depth of a tree."""
Locate = Callable[[str, Path], Path]
"""Returns the file of a path that stands in a file of a folder."""


def parse_xml(xml: str) -> Element:
    """Return the element ``root`` of a file.

    Raises:
        ConfigError: If it is no XML, or has entities, another element, or a tree that is too deep.
    """
    try:
        root: Element = fromstring(xml, forbid_dtd=True)
    except DefusedXmlException as error:
        raise ConfigError(f"expected plain XML without entities ({type(error).__name__})") from None
    except (ParseError, ValueError) as error:
        raise ConfigError(f"not an XML file ({error})") from None
    if root.tag != "root":
        raise ConfigError(f"expected <root> with a <BehaviorTree> in it, got <{root.tag}>")
    _refuse_depth(root)
    return root


def _refuse_depth(root: Element) -> None:
    """Refuse what is too deep to be written as XML again."""
    level = list(root)
    for _ in range(DEEPEST + 1):
        level = [child for element in level for child in element]
    if level:
        raise ConfigError(f"expected a tree of at most {DEEPEST} nodes from top to bottom, got a deeper one")


class TreeText(NamedTuple):
    """The text of a tree's file.

    Args:
        xml: The text; if the file includes other files, that of one file with all of their trees.
        files: The file of each tree, by the ID of the tree.
    """

    xml: str
    files: Mapping[str, Path]


def read_text(file: Path, locate: Locate) -> TreeText:
    """Return the text of a tree's file, with the trees of the files that it includes.

    A file that is included twice counts once.

    Args:
        file: The file.
        locate: Finds an included file.

    Raises:
        ConfigError: If a file is missing, too large or no XML.
    """
    reader = _Files(locate)
    xml = reader.read(file)
    root = _parse_file(xml, file.name)
    if root.find("include") is None:
        return TreeText(xml, {})
    whole = Element("root", root.attrib)
    found = list(reader.trees(root, file))
    whole.extend(element for element, _ in found)
    files = {element.get("ID", ""): origin for element, origin in found}
    return TreeText(tostring(whole, encoding="unicode"), files)


def _parse_file(xml: str, name: str) -> Element:
    """Return the element ``root`` of a file, which errors name."""
    try:
        return parse_xml(xml)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from None


class _Files:
    """Reads the files of one tree."""

    def __init__(self, locate: Locate) -> None:
        self._locate, self._seen, self._size = locate, set[Path](), 0

    def read(self, file: Path) -> str:
        """Return the text of a file."""
        self._seen.add(file.resolve())
        if len(self._seen) > MOST_FILES:
            raise ConfigError(f"{file}: expected at most {MOST_FILES} files that include each other, got more")
        self._size += file.stat().st_size
        if self._size > LARGEST:
            raise ConfigError(f"{file}: expected at most {LARGEST} bytes with all included files, got {self._size}")
        try:
            return file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            raise ConfigError(f"{file}: expected a text file") from None

    def trees(self, root: Element, file: Path) -> Iterator[tuple[Element, Path]]:
        """Yield the trees of a file and of those that it includes, each with its file, in their order."""
        for element in root:
            if element.tag == "BehaviorTree":
                yield element, file
            if element.tag == "include":
                yield from self._included(element, file.parent)

    def _included(self, include: Element, folder: Path) -> Iterator[tuple[Element, Path]]:
        package, path = include.get("ros_pkg"), include.get("path", "")
        file = self._locate(f"$(find-pkg-share {package})/{path}" if package else path, folder)
        if file.resolve() not in self._seen:
            yield from self.trees(_parse_file(self.read(file), path), file)
