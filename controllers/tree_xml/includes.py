"""Files of a tree: the trees of those that a file includes come into one text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
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


def read_text(file: Path, locate: Locate) -> str:
    """Return the text of a tree's file; if it includes other files, that of one file with all of their trees.

    A file that is included twice counts once.

    Args:
        file: The file.
        locate: Finds an included file.

    Raises:
        ConfigError: If a file is missing, too large or no XML.
    """
    reader = _Files(locate)
    xml = reader.read(file)
    root = parse_xml(xml)
    if root.find("include") is None:
        return xml
    whole = Element("root", root.attrib)
    whole.extend(list(reader.trees(root, file.parent)))
    return tostring(whole, encoding="unicode")


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

    def trees(self, root: Element, folder: Path) -> Iterator[Element]:
        """Yield the trees of a file and of those that it includes, in the order in which they stand there."""
        for element in root:
            if element.tag == "BehaviorTree":
                yield element
            if element.tag == "include":
                yield from self._included(element, folder)

    def _included(self, include: Element, folder: Path) -> Iterator[Element]:
        package, path = include.get("ros_pkg"), include.get("path", "")
        file = self._locate(f"$(find-pkg-share {package})/{path}" if package else path, folder)
        if file.resolve() in self._seen:
            return
        xml = self.read(file)
        try:
            root = parse_xml(xml)
        except ConfigError as error:
            raise ConfigError(f"{path}: {error}") from None
        yield from self.trees(root, file.parent)
