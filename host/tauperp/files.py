"""Paths of the project's files, and writing of results so that no partial file is ever visible."""

import errno
import os
import secrets
from pathlib import Path

from tauperp.errors import InputError

_NATIVE = Path(__file__).resolve().parent / "native"  # in an installed package: what its build compiled, and the DBC


def is_installed() -> bool:
    """Whether this package was installed from a wheel, not from a checkout."""
    return _NATIVE.is_dir()


def repository_root() -> Path:
    """The checkout of this package. It is installed as editable, so its sources are in <root>/host."""
    return Path(__file__).resolve().parents[2]


def build_dir() -> Path:
    """Folder of the compiled firmware: inside an installed package, else where `make` puts it in the checkout."""
    return _NATIVE if is_installed() else repository_root() / "build"


def how_to_build(target: str, *, in_package: bool = True) -> str:
    """Advice for the user about a compiled file that is missing or too old.

    target      of make, in a checkout
    in_package  whether an installed package should contain the file
    """
    if not is_installed():
        return f"`make {target}` builds it"
    if in_package:
        return "the installed package is damaged: install its wheel again"
    return f"it is not part of the installed package; `make {target}` in a checkout of Tauperp builds it"


def dbc_path() -> Path:
    """The DBC file, the only source of the wire.

    Raises InputError if it is missing.
    """
    path = _NATIVE / "tauperp.dbc" if is_installed() else repository_root() / "dbc" / "tauperp.dbc"
    if not path.is_file():
        raise InputError(f"{path}: the wire's DBC file is missing; restore it")
    return path


def write_atomically(path: str | Path, content: bytes | str) -> None:
    """Write the whole file or nothing; text as UTF-8. Creates missing folders.

    The content goes to a new file beside `path`, which then takes its name. A reader gets the old file or the new one.
    Raises OSError, without leaving a partial file, if that is not possible.
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
