"""Where the project's own files are, and how results are written so that nothing half-written is ever found."""

import errno
import os
import secrets
from pathlib import Path

from tauperp.errors import InputError


def repository_root() -> Path:
    """The checkout that this package runs from: it is installed editable, so its sources lie in <root>/host."""
    return Path(__file__).resolve().parents[2]


def build_dir() -> Path:
    """Where `make` leaves what it compiles."""
    return repository_root() / "build"


def dbc_path() -> Path:
    """The wire's only source.

    Raises InputError if it is missing.
    """
    path = repository_root() / "dbc" / "tauperp.dbc"
    if not path.is_file():
        raise InputError(f"{path}: the wire's DBC file is missing; restore dbc/tauperp.dbc")
    return path


def write_atomically(path: str | Path, content: bytes | str) -> None:
    """Write the whole file or nothing; text as UTF-8. Missing folders are made.

    The content goes to a new file beside `path` that then takes its name, so a reader sees the old file or the new
    one. Raises OSError, with nothing left behind, if that cannot be done.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a directory", str(path))
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with open(beside, "xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
