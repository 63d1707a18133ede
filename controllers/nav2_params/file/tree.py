"""The behaviour tree that a parameter file names: found, read, or told why Nav2's default tree drives instead."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from os.path import isfile
from pathlib import Path

from controllers.nav2_params.file.document import PARAMETERS
from controllers.tree_xml.includes import TreeText, read_text
from controllers.tree_xml.labels import TreeError
from controllers.tree_xml.needs import plugin_names
from controllers.tree_xml.nodes import TreeNode
from controllers.tree_xml.reading import read_tree
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Section, leaves

NAVIGATOR = "bt_navigator"
TREE_FILE = "default_nav_to_pose_bt_xml"
TREE_FILES = (TREE_FILE, "default_nav_through_poses_bt_xml")
"""Parameters that name trees; only that of the first drives here."""
OF_NAV2 = re.compile(r"\bnav2_bt_navigator\)?/")
"""Part of the path of each tree that Nav2 brings, each release its own."""
DEFAULT_TREES = tuple(
    f"nav2_bt_navigator{end}/behavior_trees/navigate_to_pose_w_replanning_and_recovery.xml" for end in (")", "")
)
"""Ends of the path of Nav2's default tree, with ``$(find-pkg-share ..)`` and in full."""
TREE_PLUGINS = "plugin_lib_names"
OF_LIBRARIES = "nav2_"
"""Beginning of the names of the libraries with Nav2's nodes."""
PACKAGE = re.compile(r"\$\(find-pkg-share\s+\S+\)/")
"""Beginning of a path in a package."""
PARENTS = 3
"""How many folders above that of the parameter file are taken for the folder of the package."""


@dataclass(frozen=True)
class TreeFile:
    """The tree of a parameter file.

    Args:
        is_default: Whether the file has no tree of its own.
        xml: The text of its own tree; empty if Nav2's default tree drives.
        tree: The same tree, read; None if Nav2's default tree drives.
    """

    is_default: bool = True
    xml: str = ""
    tree: TreeNode | None = None


def take_tree(navigator: Section | None, folder: Path) -> TreeFile:
    """Take the tree out of the navigator's section; one that cannot drive here is left out, and the reason told.

    Args:
        navigator: The section.
        folder: Folder of the parameter file.
    """
    if navigator is None or TREE_FILE not in navigator.values:
        return TreeFile()
    name, findings = f"{navigator.name}.{TREE_FILE}", navigator.findings
    named = str(navigator.values.pop(TREE_FILE))
    if named.endswith(DEFAULT_TREES):
        findings.add("ros_only", name)
        return TreeFile()
    try:
        text, tree = load_tree(find_tree(named, folder), findings.release)
    except ConfigError as error:
        findings.add("left_out", name, f"{error}; Nav2's default tree drives here")
        return TreeFile(is_default=False)
    _keep_libraries(navigator)
    return TreeFile(is_default=False, xml=text, tree=tree)


def _keep_libraries(navigator: Section) -> None:
    """Keep the libraries of Nav2's nodes, without which Humble may not load a file's own tree that is written.

    Later releases load all of them. A tree that drives here has no nodes of other libraries.
    """
    listed = navigator.values.get(TREE_PLUGINS)
    if navigator.findings.release == "humble" and isinstance(listed, list):
        libraries = [name for name in listed if isinstance(name, str) and name.startswith(OF_LIBRARIES)]
        navigator.findings.kept |= {f"{navigator.written}.{TREE_PLUGINS}": libraries} if libraries else {}


def load_tree(file: Path, release: Release) -> tuple[str, TreeNode]:
    """Return the text of a tree's file, with those that it includes, and its main tree as a release reads it.

    Raises:
        ConfigError: If the tree cannot drive here. The message names the file.
    """
    text = _read(file)
    try:
        tree = read_tree(text.xml, release)
        plugin_names(tree)
    except ConfigError as error:
        origin = text.files.get(error.tree, file) if isinstance(error, TreeError) else file
        raise ConfigError(f"{origin.name}: {error}") from None
    return text.xml, tree


def moved_trees(values: object, source: Path, target: Path) -> dict[str, str]:
    """Return, by the name of its file, the text of each tree that a parameter file names and loses if it is moved.

    Args:
        values: The content of the parameter file.
        source: Folder in which it was.
        target: Folder in which it is.

    Raises:
        ConfigError: If a tree is too large or no XML.
    """
    own = [name for key, name in _own_trees(values) if key.endswith(TREE_FILE)]
    lost = {name: file for name in own if not _found(name, target) and (file := _found(name, source))}
    return {Path(name).name: _read(file).xml for name, file in lost.items()}


def kept_trees(values: object, folder: Path, release: Release) -> dict[str, str]:
    """Return, by the full name of its parameter, why a release would not take each tree of a parameter file.

    Args:
        values: The content of the parameter file.
        folder: Its folder.
        release: The release.

    Returns:
        The reasons, empty where the tree can be read, or is one for several goals, which is not read here.
    """
    kept = [(key, name) for key, name in _own_trees(values) if not OF_NAV2.search(name)]
    return {key: _refusal(name, folder, release) if key.endswith(TREE_FILE) else "" for key, name in kept}


def _own_trees(values: object) -> list[tuple[str, str]]:
    """Return the full names of the parameters that name other trees than the default one, with the files."""
    keys = leaves(values) if isinstance(values, Mapping) else ()
    named = [(key.replace(f".{PARAMETERS}.", "."), str(value)) for key, value in keys if key.endswith(TREE_FILES)]
    return [(key, name) for key, name in named if not name.endswith(DEFAULT_TREES)]


def _refusal(named: str, folder: Path, release: Release) -> str:
    try:
        load_tree(find_tree(named, folder), release)
    except ConfigError as error:
        return str(error)
    return ""


def _found(named: str, folder: Path) -> Path | None:
    try:
        return find_tree(named, folder)
    except ConfigError:
        return None


def _read(file: Path) -> TreeText:
    return read_text(file, partial(find_tree, by="the tree"))


def find_tree(named: str, folder: Path, by: str = "the parameter file") -> Path:
    """Return the file of a tree: the path itself, or in a package, whose folder is near the file that names it.

    Args:
        named: The path, as a parameter file or an ``include`` names it.
        folder: Folder of the file that names it.
        by: What this file is.

    Raises:
        ConfigError: If there is none.
    """
    inside = PACKAGE.sub("", named, count=1)
    folders = [folder, *folder.resolve().parents[:PARENTS]] if inside != named else [folder]
    candidates = [*(one / inside for one in folders), folder / Path(named).name]
    found = next((one for one in candidates if isfile(one)), None)
    if found is None:
        raise ConfigError(f"expected the file {inside} in the package or beside {by}")
    return found
