"""Rows of a recording as cycles of the bus: gaps are found, short ones bridged; long ones split the recording.

A row belongs to the cycle nearest to its time. In a short gap the missing cycles are interpolated, because the logger
lost them, not the robot. In a long gap the motion is unknown, and a new guard starts after it.
"""

import dataclasses

import numpy as np
import numpy.typing as npt

from tauperp.recording.recording import FloatArray, Recording

BRIDGE_MS = 20.0  # the longest gap that is bridged by default


@dataclasses.dataclass(frozen=True)
class Gap:
    """Cycles that are missing before a row; `bridged`: interpolated, else the recording is split there."""

    row: int  # the first one after the gap
    start_s: float
    missing: int
    length_s: float  # between the two rows
    bridged: bool


@dataclasses.dataclass(frozen=True, eq=False)
class Timeline:
    """The cycle of each row, from 1 in each part; `starts` are the first rows of the parts."""

    cycle: npt.NDArray[np.int64]  # (m,)
    starts: tuple[int, ...]
    gaps: tuple[Gap, ...]

    def report(self) -> dict[str, object]:
        """For JSON: all gaps in numbers, and the longest ones by time and length."""
        longest = sorted(self.gaps, key=lambda gap: -gap.length_s)[:20]
        return {
            "count": len(self.gaps),
            "bridged": sum(gap.bridged for gap in self.gaps),
            "split": sum(not gap.bridged for gap in self.gaps),
            "missing_cycles": sum(gap.missing for gap in self.gaps),
            "longest": [
                {
                    "start_s": round(gap.start_s, 4),
                    "length_ms": round(1e3 * gap.length_s, 2),
                    "missing_cycles": gap.missing,
                    "bridged": gap.bridged,
                }
                for gap in sorted(longest, key=lambda gap: gap.row)
            ],
        }


def timeline(recording: Recording, bridge_ms: float = BRIDGE_MS) -> Timeline:
    """Cycles at the recording's median period. A gap of more than `bridge_ms` between two rows splits it."""
    time_s, period_s = recording.time_s, recording.period_us * 1e-6
    rows = len(time_s)
    cycle = np.empty(rows, np.int64)
    starts, gaps = [0], []
    lengths = np.diff(time_s)
    split = set((np.flatnonzero((lengths > bridge_ms * 1e-3 + 1e-6) & (lengths > 1.5 * period_s)) + 1).tolist())
    begin, number = 0, 1
    for row in range(rows):
        if row in split:
            gaps.append(_gap(time_s, row, round(float(lengths[row - 1]) / period_s) - 1, False))
            starts.append(row)
            begin, number = row, 1
        elif row > 0:
            wanted = 1 + round(float(time_s[row] - time_s[begin]) / period_s)
            missing = max(0, wanted - number - 1)
            if missing:
                gaps.append(_gap(time_s, row, missing, True))
            number += 1 + missing
        cycle[row] = number
    return Timeline(cycle, tuple(starts), tuple(gaps))


def _gap(time_s: FloatArray, row: int, missing: int, bridged: bool) -> Gap:
    start = float(time_s[row - 1])
    return Gap(row, start, missing, float(time_s[row]) - start, bridged)
