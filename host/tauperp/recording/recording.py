"""A recording of a real arm: its joints' readings row by row, and when a person touched it.

Torque is measured on the link side, with the sign of the gravity torque. tauperp.recording.tables reads it.
"""

import dataclasses
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


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
    damage: str | None = None  # why the file could not be read after the last row
    line_by_line: bool = True  # a row is a line of the file
    acceleration: FloatArray | None = None  # (m, 3) m/s2, of the end-effector as commanded, base frame
    where: IntArray | None = None  # (m,) each row's line or number in the file, from 1; None: the names, then all rows
    notes: tuple[str, ...] = ()  # notes for the user: what was ignored or changed
    time_column: str = "time"

    @property
    def period_us(self) -> int:
        """The median distance of two rows."""
        return round(float(np.median(np.diff(self.time_s))) * 1e6)

    def place(self, row: int) -> str:
        """Place of a row in the file, for a message."""
        first = 2 if self.line_by_line else 1
        number = row + first if self.where is None else int(self.where[row])
        return place_of(self.path, number, self.line_by_line)

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


def place_of(path: Path, number: int, line_by_line: bool) -> str:
    """Place of a row: its line in a text file, or its number, both from 1."""
    return f"{path}:{number}" if line_by_line else f"{path}: row {number}"
