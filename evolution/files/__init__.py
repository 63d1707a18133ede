"""Plain files, as all other subpackages read and write them.

In: rows, documents, arrays, and the path of a file or directory. Out: files that are complete at any moment, and their
checked content; a file that is not as expected gives an error of one line.
"""

from __future__ import annotations

from evolution.files.code import code_of
from evolution.files.directories import DirectoryKind, differences
from evolution.files.documents import Document, Versions, advising, check, check_rows, read_document, warn_of_versions
from evolution.files.locks import locked, locked_by
from evolution.files.plain import (
    GrowingCsv,
    Row,
    WriteError,
    append_line,
    csv_of,
    json_in_script,
    make_directory,
    npz_of,
    read_arrays,
    read_csv,
    read_json,
    read_json_lines,
    read_npz,
    write_arrays,
    write_bytes,
    write_json,
    write_text,
    zip_of,
)
from evolution.files.table import Table, Tabled, counted, readable
from evolution.files.temporary import temporary_directory
from evolution.files.versions import PACKAGE_VERSION, software, version_lines, written_elsewhere

__all__ = [
    "PACKAGE_VERSION",
    "DirectoryKind",
    "Document",
    "GrowingCsv",
    "Row",
    "Table",
    "Tabled",
    "Versions",
    "WriteError",
    "advising",
    "append_line",
    "check",
    "check_rows",
    "code_of",
    "counted",
    "csv_of",
    "differences",
    "json_in_script",
    "locked",
    "locked_by",
    "make_directory",
    "npz_of",
    "read_arrays",
    "read_csv",
    "read_document",
    "read_json",
    "read_json_lines",
    "read_npz",
    "readable",
    "software",
    "temporary_directory",
    "version_lines",
    "warn_of_versions",
    "write_arrays",
    "write_bytes",
    "write_json",
    "write_text",
    "written_elsewhere",
    "zip_of",
]
