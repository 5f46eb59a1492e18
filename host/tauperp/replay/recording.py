"""A recording of a real arm as a CSV file, plain or gzipped.

Columns, by the name in the first line: `time` s; for joint i from 0: `q<i>` rad, `dq<i>` rad/s, `tau_J<i>` Nm, the
measured link-side torque with the sign of the gravity torque; `label` (optional) 1 while a person touches the arm.
Any other column is ignored.
"""

import csv
import dataclasses
import gzip
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tauperp.errors import InputError

FloatArray = npt.NDArray[np.float64]

_GZIP_MAGIC = b"\x1f\x8b"


@dataclasses.dataclass(frozen=True)
class Touch:
    """One labelled touch: rows first to last (exclusive), and its time in s."""

    first: int
    last: int
    start_s: float
    end_s: float


@dataclasses.dataclass(frozen=True, eq=False)
class Recording:
    """m rows of an arm with n joints."""

    name: str
    path: Path
    time_s: FloatArray  # (m,) not descending, from 0 on
    q: FloatArray  # (m, n) rad
    qd: FloatArray  # (m, n) rad/s
    tau: FloatArray  # (m, n) Nm
    touched: npt.NDArray[np.bool_] | None  # (m,); None without labels

    @property
    def period_us(self) -> int:
        """The median distance of two rows."""
        return round(float(np.median(np.diff(self.time_s))) * 1e6)

    @cached_property
    def touches(self) -> tuple[Touch, ...]:
        """The labelled touches in their order; none without labels."""
        if self.touched is None:
            return ()
        edges = np.flatnonzero(np.diff(self.touched.astype(int), prepend=0, append=0))
        last_row = len(self.time_s) - 1
        return tuple(
            Touch(int(first), int(last), float(self.time_s[first]), float(self.time_s[min(last, last_row)]))
            for first, last in edges.reshape(-1, 2)
        )

    def touch_at(self, row: int) -> Touch | None:
        return next((touch for touch in self.touches if touch.first <= row < touch.last), None)


def read_csv(path: str | Path, joints: int) -> Recording:
    """Read a recording of an arm with so many joints.

    Raises InputError, with file and line, if it cannot be opened, lacks a column, holds what is not a finite number,
    or goes back in time.
    """
    path = Path(path)
    rows = list(csv.reader(_text(path).splitlines()))
    if len(rows) < 3:
        raise InputError(f"{path}: no recording: a line of column names and two rows at least")
    columns = {name.strip(): i for i, name in enumerate(rows[0])}
    groups = {group: [f"{group}{joint}" for joint in range(joints)] for group in ("q", "dq", "tau_J")}
    needed = ["time", *(name for names in groups.values() for name in names)]
    missing = [name for name in needed if name not in columns]
    if missing:
        raise InputError(f"{path}: no column '{missing[0]}', which an arm with {joints} joints needs")
    values = _numbers(path, rows)
    time = values[:, columns["time"]]
    if (np.diff(time) < 0).any():
        raise InputError(f"{path}:{int(np.argmax(np.diff(time) < 0)) + 3}: time goes back")
    if np.median(np.diff(time)) <= 0:
        raise InputError(f"{path}: time stands still")
    q, qd, tau = (values[:, [columns[name] for name in names]] for names in groups.values())
    touched = values[:, columns["label"]] != 0 if "label" in columns else None
    name = path.name.removesuffix(".gz").removesuffix(".csv")
    return Recording(name, path, time - time[0], q, qd, tau, touched)


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
        return (gzip.decompress(data) if data.startswith(_GZIP_MAGIC) else data).decode("utf-8")
    except (gzip.BadGzipFile, EOFError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a CSV file, plain or gzipped") from error
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error


def _numbers(path: Path, rows: list[list[str]]) -> FloatArray:
    """Every cell below the column names, (m, columns); the first line of a file is 1."""
    width = len(rows[0])
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != width:
            raise InputError(f"{path}:{line}: {len(row)} values under {width} column names")
    try:
        values = np.array(rows[1:], dtype=float)
    except ValueError:
        line, cell = next(
            (line, cell) for line, row in enumerate(rows[1:], start=2) for cell in row if not _is_number(cell)
        )
        raise InputError(f"{path}:{line}: {cell!r} is not a number") from None
    if not np.isfinite(values).all():
        at, column = (int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise InputError(f"{path}:{at + 2}: {rows[0][column]} is not finite")
    return values


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
