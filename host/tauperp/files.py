"""Where the project's own files are, and how results are written so that nothing half-written is ever found."""

import errno
import os
import secrets
from pathlib import Path

from tauperp.errors import InputError

_NATIVE = Path(__file__).resolve().parent / "native"  # in an installed package: what its build compiled, and the DBC


def is_installed() -> bool:
    """Whether this package came from a wheel, not from a checkout."""
    return _NATIVE.is_dir()


def repository_root() -> Path:
    """The checkout that this package runs from: it is installed editable, so its sources lie in <root>/host."""
    return Path(__file__).resolve().parents[2]


def build_dir() -> Path:
    """Where the compiled firmware is: inside an installed package, else where `make` leaves it in the checkout."""
    return _NATIVE if is_installed() else repository_root() / "build"


def how_to_build(target: str, *, in_package: bool = True) -> str:
    """What a person does about a compiled file that is missing or old.

    target      of make, in a checkout
    in_package  whether an installed package should contain the file
    """
    if not is_installed():
        return f"`make {target}` builds it"
    if in_package:
        return "the installed package is damaged: install its wheel again"
    return f"it is not part of the installed package; `make {target}` in a checkout of Tauperp builds it"


def dbc_path() -> Path:
    """The wire's only source.

    Raises InputError if it is missing.
    """
    path = _NATIVE / "tauperp.dbc" if is_installed() else repository_root() / "dbc" / "tauperp.dbc"
    if not path.is_file():
        raise InputError(f"{path}: the wire's DBC file is missing; restore it")
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
