"""ResultStore: the results of all runs, by the key of their job.

One SQLite file (table ``results``: ``key``, ``result`` as JSON, whose last member is a checksum of key and result, so
that a damaged row is never taken for another result; rows of earlier versions have none). SQLite's write-ahead log
survives ``kill -9`` at any moment, allows several processes to write, and needs no loading. The
order of the rows means nothing: outputs are written in an order of their own.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from evolution.driving.jobs import RunResult
from evolution.files import locked_by
from gym_mapbench.errors import RunError

LOG = logging.getLogger(__name__)

SCHEMA_VERSION = 1
LOCKED = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
UNWRITABLE = (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM)
FAILING = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)
WAIT_SECONDS = 10.0
KEYS_PER_QUERY = 500
MARK = ',"checksum":"'


class ResultStore:
    """Results by job key; in memory, or in a file that several runs may share.

    Args:
        path: The file, created if it does not exist; None keeps everything in memory.
        wait_s: How long to wait, each time, for another process that has locked the file.

    Raises:
        RunError: If the file cannot be opened, stays locked, or is not a result store of this version.
    """

    def __init__(self, path: str | Path | None = None, *, wait_s: float = WAIT_SECONDS) -> None:
        self.path = None if path is None else Path(path)
        self._wait_s = wait_s
        with self._errors("cannot be opened"):
            self._database = sqlite3.connect(self.path or ":memory:", timeout=wait_s, isolation_level=None)
        try:
            with self._errors("not a result store; delete it to repeat all runs"):
                self._prepare()
        except RunError:
            self._database.close()
            raise
        if self.path is not None:
            LOG.info("%s: keeps the results of all runs", self.path)

    @contextmanager
    def _errors(self, what: str) -> Iterator[None]:
        """Turn an error of SQLite into a ``RunError`` of one line."""
        try:
            yield
        except sqlite3.Error as error:
            code = getattr(error, "sqlite_errorcode", 0) & 0xFF
            if self.path is not None and code in LOCKED:
                raise RunError(self._locked(self.path)) from None
            if code in FAILING:
                what = "cannot be read or written"
            elif code in UNWRITABLE:
                what = "cannot be opened for writing"
            raise RunError(f"{self.path or 'result store'}: {what} ({error})") from None

    def _locked(self, path: Path) -> str:
        """Return in words which process has locked the file."""
        files = [path.with_name(path.name + end) for end in ("", "-shm", "-wal")]
        return f"{path}: locked by {locked_by(files, self._wait_s)}"

    def _prepare(self) -> None:
        """Check the version, or create the table of a new file."""
        (version,) = self._database.execute("PRAGMA user_version").fetchone()
        if version not in (0, SCHEMA_VERSION):
            found = f"expected a result store of version {SCHEMA_VERSION}, got {version}"
            raise RunError(f"{self.path}: {found}; read it with the version of MapBench that wrote it")
        self._database.execute("PRAGMA journal_mode = WAL")
        self._database.execute("PRAGMA synchronous = NORMAL")
        self._database.execute("CREATE TABLE IF NOT EXISTS results (key TEXT PRIMARY KEY, result TEXT) WITHOUT ROWID")
        self._database.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def get(self, key: str) -> RunResult | None:
        """Return one result; None if the job has none."""
        return self.get_many([key]).get(key)

    def get_many(self, keys: Iterable[str]) -> dict[str, RunResult]:
        """Return the known results of these keys."""
        wanted = list(dict.fromkeys(keys))
        found: dict[str, RunResult] = {}
        for start in range(0, len(wanted), KEYS_PER_QUERY):
            part = wanted[start : start + KEYS_PER_QUERY]
            marks = ",".join("?" * len(part))
            with self._errors("cannot be read"):
                rows = self._database.execute(f"SELECT key, result FROM results WHERE key IN ({marks})", part)
                found.update((key, self._result(key, text)) for key, text in rows)
        return found

    def _result(self, key: str, text: str) -> RunResult:
        try:
            return RunResult.from_json(_checked(key, str(text)))
        except (ValueError, TypeError, RecursionError) as error:
            where = f"{self.path or 'result store'}: row {key!r:.80}: expected a run's result"
            reason = " ".join(str(error).split())[:160]
            raise RunError(f"{where}, got something else ({reason}); delete the file to repeat all runs") from None

    def put(self, key: str, result: RunResult) -> None:
        """Store a result; the first result of a key stays, so that all readers get the same."""
        with self._errors("cannot be written"):
            row = (key, _with_checksum(key, result.to_json()))
            self._database.execute("INSERT OR IGNORE INTO results VALUES (?, ?)", row)

    def errors(self) -> list[str]:
        """Return the reasons of the runs that ended in an error, in order of their keys."""
        return list(self._failed().values())

    def forget_errors(self) -> None:
        """Delete the runs that ended in an error, so that they are run again."""
        keys = [(key,) for key in self._failed()]
        with self._errors("cannot be written"):
            self._database.executemany("DELETE FROM results WHERE key = ?", keys)

    def _failed(self) -> dict[str, str]:
        """Return the reasons of the runs that ended in an error by key, in order."""
        with self._errors("cannot be read"):
            like = "SELECT key, result FROM results WHERE result LIKE ? ORDER BY key"
            rows = self._database.execute(like, ['%"error"%']).fetchall()
        results = ((key, self._result(key, text)) for key, text in rows)
        return {key: result.reason for key, result in results if result.outcome == "error"}

    def __len__(self) -> int:
        (count,) = self._database.execute("SELECT COUNT(*) FROM results").fetchone()
        return int(count)

    def copy_to(self, path: Path) -> None:
        """Write all results to another file, also if the store's own file was deleted meanwhile.

        Raises:
            RunError: If it cannot be written.
        """
        with self._errors("cannot be copied"), contextlib.closing(sqlite3.connect(path)) as target:
            self._database.backup(target)

    def close(self) -> None:
        """Close the file; the store cannot be used afterwards."""
        self._database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()


def _with_checksum(key: str, text: str) -> str:
    """Return the JSON text of a result with its checksum as the last member."""
    return f'{text[:-1]}{MARK}{_checksum(key, text)}"}}'


def _checked(key: str, text: str) -> str:
    """Take the checksum off a row's text; raises ``ValueError`` if the row is damaged."""
    body, mark, _ = text.rpartition(MARK)
    whole = body + "}"
    if mark and text != _with_checksum(key, whole):
        raise ValueError("its checksum is wrong")
    return whole if mark else text


def _checksum(key: str, text: str) -> str:
    return hashlib.blake2b(f"{key} {text}".encode(), digest_size=8).hexdigest()
