"""What the readers of tables raise, apart from bad input that nothing can be read from."""

from pathlib import Path

from tauperp.errors import InputError


class TableDamage(InputError):
    """The table cannot be read from here on; the rows before are good."""


def needs_extra(path: Path, package: str) -> InputError:
    return InputError(f"{path}: needs the package {package}, which is not installed; pip install 'tauperp[logs]'")
