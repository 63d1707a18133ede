"""Directories of results: how each kind is begun, recognised, opened and continued."""

from __future__ import annotations

import json
import logging
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evolution.files.code import code_digests, code_of
from evolution.files.documents import advising
from evolution.files.plain import WriteError, make_directory, read_json, write_json, write_new_json
from evolution.files.versions import refuse_version, versions
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.trust import refuse_code

LOG = logging.getLogger(__name__)

CODE = "code"
"""Key of the content hashes of the modules that the options name; a file whose options name none does not have it."""

LONGEST = 80
"""Characters of a value in an error."""

Options = Callable[[Mapping[str, Any]], object]


@dataclass(frozen=True)
class DirectoryKind:
    """A kind of directory of results, recognised by the JSON file that holds the options it was begun with.

    Args:
        what: Content of the directory, in one word.
        mark: Name of that file.
        format_version: Version of its format.
        to_drive: Places in that file, keys joined by dots, that are used by runs only. They may name code, which
            :meth:`open` does not refuse: the caller refuses it before a run.
        remade: Whether all results are made again from the stored runs when it is continued. The key of a run has the
            content of its code, so that changed code repeats its runs; other kinds refuse changed code.
        again: The command, after ``mapbench``, that begins it again elsewhere, with ``{path}`` for the directory.
    """

    what: str
    mark: str
    format_version: int
    to_drive: tuple[str, ...] = ()
    remade: bool = False
    again: str = ""

    @property
    def format(self) -> str:
        """Name of its format."""
        return f"mapbench-{self.what}"

    def holds(self, path: str | Path) -> bool:
        """Whether a path is a directory of this kind."""
        return (Path(path) / self.mark).is_file()

    def begin(self, path: Path, document: Mapping[str, Any]) -> dict[str, Any]:
        """Make a directory of this kind.

        Args:
            path: The directory; it must be new or empty.
            document: The options it is begun with, JSON-able.

        Returns:
            The content of its file: the document, the versions of the software, and the hashes of the code it names.

        Raises:
            ConfigError: If the directory is not empty; nothing is changed.
            RunError: If it cannot be made.
        """
        held = f"{path}: already holds a {self.what}; continue it with --resume, or choose another directory"
        if self.holds(path):
            raise ConfigError(held)
        new_directory(path)
        code = code_of(document)
        config = {"format": self.format, "format_version": self.format_version, **versions(), **document}
        config |= {CODE: code} if code else {}
        try:
            write_new_json(path / self.mark, config)
        except FileExistsError:
            raise ConfigError(held) from None
        LOG.info("%s: new directory of a %s", path, self.what)
        return config

    def open(self, path: Path) -> dict[str, Any]:
        """Return the content of its file.

        Raises:
            RunError: If it is not of this kind, or of another format.
            UntrustedError: If it names code.
        """
        if not self.holds(path):
            raise RunError(f"{path}: not a {self.what} directory (no {self.mark})")
        with advising(f"restore it from a copy, or begin the {self.what} again"):
            config = read_json(path / self.mark)
        if config.get("format") != self.format or config.get("format_version") != self.format_version:
            found = f"{config.get('format')} {config.get('format_version')}"
            expected = f"expected {self.format} {self.format_version}, got {found}"
            raise RunError(f"{path / self.mark}: {expected}; read it with the version of MapBench that wrote it")
        refuse_code(config, path / self.mark, self.to_drive)
        LOG.info("%s: opened, a %s", path, self.what)
        return config

    def check_there(self, path: Path) -> None:
        """Raise ``WriteError`` if a directory was deleted or moved since it was created or opened."""
        if not self.holds(path):
            raise WriteError(f"{path}: was deleted or moved while results were written")

    def begin_or_resume(
        self, path: Path, document: Mapping[str, Any], options: Options = dict, *, resume: bool
    ) -> dict[str, Any]:
        """Begin a directory, or continue the one that is there, and return the content of its file.

        Arguments and errors as for :meth:`begin`, or with ``resume`` as for :meth:`open` and :meth:`check_resumed`.
        """
        if not resume:
            return self.begin(path, document)
        config = self.open(path)
        self.check_resumed(path, config, document, options)
        return config

    def check_resumed(
        self, path: Path, config: Mapping[str, Any], document: Mapping[str, Any], options: Options = dict
    ) -> None:
        """Refuse to continue a directory with other options or other code than it was begun with.

        Args:
            path: The directory.
            config: The content of its file.
            document: The document that it would be begun with now.
            options: Returns the options of a document, as errors name them.

        Raises:
            ConfigError: If an option differs, or the code of a module where results are not remade, naming it.
            RunError: If another version of this package wrote the directory.
        """
        refuse_version(config, path)
        if not self.remade:
            self._refuse_other_code(path, config)
        begun = {key: config.get(key) for key in document}
        for name, before, now in differences(options(begun), options(json.loads(json.dumps(document)))):
            raise ConfigError(f"{path}: {name} was {_plain(before)} when the {self.what} began, got {_plain(now)}")

    def take_code(self, path: Path) -> bool:
        """Record the code with which a directory is continued, if that is not the code that was recorded.

        Returns:
            Whether it has changed; then a warning names the modules.
        """
        config = read_json(path / self.mark)
        changed = _changed_code(config)
        if changed:
            LOG.warning(
                "%s: the code of %s has changed: its runs, and those that ended in an error, are repeated",
                path,
                ", ".join(changed),
            )
            write_json(path / self.mark, {**config, CODE: {**config[CODE], **changed}})
        return bool(changed)

    def _refuse_other_code(self, path: Path, config: Mapping[str, Any]) -> None:
        for module in _changed_code(config):
            how = f" (mapbench {self.again.format(path=shlex.quote(str(path)))})" if self.again else ""
            raise ConfigError(
                f"{path}: expected the code of {module} as it was when the {self.what} began, got other code, whose "
                f"results must not be mixed with the former; restore it, or begin the {self.what} again in another "
                f"directory{how}"
            )


def _changed_code(config: Mapping[str, Any]) -> dict[str, str]:
    """Return the content hashes of the recorded modules that differ from the recorded ones, by module.

    A module that is missing now is reported by whoever loads it.
    """
    begun = config.get(CODE)
    begun = begun if isinstance(begun, dict) else {}
    return {module: digest for module, digest in code_digests(begun).items() if digest != begun[module]}


def differences(was: Any, now: Any, name: str = "") -> Iterable[tuple[str, Any, Any]]:
    """Yield the name and the two values of every leaf in which two JSON documents differ."""
    if isinstance(was, dict) and isinstance(now, dict):
        for key in {**was, **now}:
            yield from differences(was.get(key), now.get(key), f"{name}.{key}" if name else key)
    elif was != now:
        yield name, was, now


def _plain(value: Any) -> str:
    """Return a JSON value as option files and command lines have it, a long one cut off."""
    text = value if isinstance(value, str) and value else "none" if value is None else json.dumps(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def new_directory(path: Path) -> None:
    """Make a directory, or accept an empty one. Hidden files, such as half-written ones, are ignored.

    Raises:
        ConfigError: If it holds anything; nothing is changed.
        RunError: If it cannot be made.
    """
    if path.exists() and not path.is_dir():
        raise ConfigError(f"{path}: expected a new directory, got a file")
    if path.is_dir() and any(not entry.name.startswith(".") for entry in path.iterdir()):
        raise ConfigError(f"{path}: expected a new or empty directory, got one that holds other files")
    make_directory(path)
