"""ParameterText: the parameter file that a tuning changes, as text, so that its comments and its order stay."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml

from controllers.nav2_params import Nav2Params, write_nav2_params
from controllers.nav2_params.file.tree import NAVIGATOR, TREE_FILE
from controllers.nav2_params.file.yaml_edits import SharedValueError
from controllers.nav2_params.values import Values, values_of, write_values
from evolution.driving import DriveSettings, ParameterFile
from evolution.files import temporary_directory, write_text
from evolution.tuning.space import SearchSpace
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import read_document_text
from gym_mapbench.ros_params import leaves

LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class ParameterText:
    """A parameter file.

    Args:
        text: Its text.
        controller: Name of the tuned controller in the file.
        file: How the file is read.
        known: The controller's and the costmaps' values in it by name, which have the types of their parameters.
        tree: Name and text of the file's own behaviour tree, which is found beside it; None if it has none.
    """

    text: str
    controller: str
    file: ParameterFile
    known: Values
    tree: tuple[str, str] | None = None

    def write(self, path: Path, values: Values) -> None:
        """Write the text with some values replaced, and the behaviour tree beside it."""
        write_text(path, self.with_values(values))
        if self.tree is not None:
            name, xml = self.tree
            write_text(path.parent / name, xml)

    def with_values(self, values: Values) -> str:
        """Return the text with some values replaced.

        Raises:
            ConfigError: If the text has no place for a value, or the changed text does not give the values back.
        """
        changed = write_values(self.text, self.controller, values, self.known)
        with TemporaryDirectory(dir=temporary_directory()) as folder:
            path = Path(folder) / "nav2_params.yaml"
            write_text(path, changed)
            file = self.file.replace(params=str(path), only=self.controller)
            found = values_of(file.load(Path(self.file.params).parent), self.controller)
        for name, value in values.items():
            if found.get(name) != value:
                got = f"{name}: expected {value!r} after the change, got {found.get(name)!r}"
                raise ConfigError(f"{self.file.params}: {got}")
        return changed

    def refusal(self, name: str) -> ConfigError | None:
        """Return why the text has no place for a parameter; None if it has one."""
        try:
            write_values(self.text, self.controller, {name: self.known[name]}, self.known)
        except ConfigError as error:
            return error
        return None


def text_of_file(file: ParameterFile, read: Nav2Params, controller: str) -> ParameterText:
    """Return the text of a user's file.

    Raises:
        ConfigError: If the file does not configure the controller.
    """
    chosen = read.navigation.controller(controller)
    named = next((name for name in read.own_controllers if read.navigation.controllers[name] is chosen), None)
    if named is None:
        own = ", ".join(read.own_controllers) or "none"
        raise ConfigError(f"{file.params}: expected a file that configures the controller {controller}, got {own}")
    return ParameterText(
        read_document_text(file.params), named, file, values_of(read.navigation, named), _tree_of(read)
    )


def _tree_of(read: Nav2Params) -> tuple[str, str] | None:
    """Return name and text of a file's own behaviour tree."""
    xml = read.navigation.bt.xml
    keys = leaves(read.document.values) if xml and isinstance(read.document.values, Mapping) else ()
    return next(((Path(str(value)).name, xml) for key, value in keys if key.endswith(TREE_FILE)), None)


def text_of_settings(settings: DriveSettings, controller: str) -> ParameterText:
    """Return a new parameter file with the navigation of some settings and one controller."""
    navigation = settings.navigation
    alone = navigation.replace(controllers={controller: navigation.controller(controller)})
    document = write_nav2_params(alone, robot=settings.robot)
    tree = ("behavior_tree.xml", navigation.bt.xml) if navigation.bt.xml else None
    if tree is not None:
        document[NAVIGATOR]["ros__parameters"][TREE_FILE], _ = tree
    file = ParameterFile(params="nav2_params.yaml", nav2=navigation.release)
    text = yaml.safe_dump(document, sort_keys=False)
    return ParameterText(text, controller, file, values_of(navigation, controller), tree)


def writable_space(space: SearchSpace, text: ParameterText) -> SearchSpace:
    """Return the space without the parameters that the text has no place for, such as those of a missing section.

    A warning names those whose values the text gives to other parameters as well.
    """
    refused = {name: error for name in space.parameters if (error := text.refusal(name)) is not None}
    shared = [name for name, error in refused.items() if isinstance(error, SharedValueError)]
    if shared:
        said = "%s: not tuned, as YAML anchors, aliases or sections for several nodes share their values: %s"
        LOG.warning(said, text.file.params, ", ".join(shared))
    return space.without(frozenset(refused))
