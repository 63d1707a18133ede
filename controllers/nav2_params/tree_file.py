"""The behaviour tree that a parameter file names: found, read, or told why Nav2's default tree drives instead."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from controllers.tree_xml import TreeNode, plugin_names, read_tree
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import Section

NAVIGATOR = "bt_navigator"
TREE_FILE = "default_nav_to_pose_bt_xml"
DEFAULT_TREES = tuple(
    f"nav2_bt_navigator{end}/behavior_trees/navigate_to_pose_w_replanning_and_recovery.xml" for end in (")", "")
)
"""Ends of the path of Nav2's default tree, with ``$(find-pkg-share ..)`` and in full."""
PACKAGE = re.compile(r"\$\(find-pkg-share\s+\S+\)/")
"""Beginning of a path in a package."""
PARENTS = 3
"""How many folders above that of the parameter file are taken for the folder of the package."""
LARGEST = 1_000_000
"""Largest size of a file, bytes."""


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
        xml = _find(named, folder).read_text(encoding="utf-8")
        tree = read_tree(xml, findings.release)
        plugin_names(tree)
    except (ConfigError, OSError, UnicodeDecodeError) as error:
        why = str(error) if isinstance(error, ConfigError) else f"{named}: expected a text file"
        findings.add("left_out", name, f"{why}; Nav2's default tree drives here")
        return TreeFile(is_default=False)
    return TreeFile(is_default=False, xml=xml, tree=tree)


def _find(named: str, folder: Path) -> Path:
    """Return the file of a tree: the path itself, or in a package, whose folder is near the parameter file.

    Raises:
        ConfigError: If there is none, or it is too large.
    """
    inside = PACKAGE.sub("", named, count=1)
    folders = [folder, *folder.resolve().parents[:PARENTS]] if inside != named else [folder]
    candidates = [*(one / inside for one in folders), folder / Path(named).name]
    found = next((one for one in candidates if one.is_file()), None)
    if found is None:
        raise ConfigError(f"expected the file {inside} in the package or beside the parameter file")
    if found.stat().st_size > LARGEST:
        raise ConfigError(f"{found}: expected at most {LARGEST} bytes, got {found.stat().st_size}")
    return found
