"""Exceptions of the table readers, apart from bad input of which nothing can be read."""

from pathlib import Path

from tauperp.errors import InputError


class TableDamage(InputError):
    """The table cannot be read from here on. The rows before are good."""


def needs_extra(path: Path, package: str) -> InputError:
    return InputError(f"{path}: needs the package {package}, which is not installed; pip install 'tauperp[logs]'")
