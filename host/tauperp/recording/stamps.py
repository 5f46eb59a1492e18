"""Converts time stamps and angles of a table for playback: one row per stamp, angles within the wire's range."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from tauperp.errors import InputError
from tauperp.recording.mapping import TIME_S, ColumnMap
from tauperp.recording.recording import FloatArray, Recording
from tauperp.robot.limits import WIRE_POSITION_RAD

RATE_MIN_HZ, RATE_MAX_HZ = 20.0, 4000.0  # of tauperp.config.settings.Wire.rate_hz
_TURNS = 2  # turns; a larger angle is wrapped only on request, because it may be in degrees
_HINT = "columns = [SECONDS, NANOSECONDS] under [time] of a map"


def fitted_time(path: Path, values: FloatArray, columns: ColumnMap) -> tuple[npt.NDArray[np.bool_], list[str]]:
    """The rows to keep, (m,), and a note on the omitted ones, which repeat the previous time stamp.

    Raises InputError if that would lose readings: most rows repeat a time stamp with other values.
    """
    same = np.diff(values[:, 0], prepend=-np.inf) == 0.0
    if not same.any():
        return ~same, []
    differs = same & (np.diff(values[:, 1:], axis=0, prepend=values[:1, 1:]) != 0.0).any(axis=1)
    if np.count_nonzero(differs) > len(values) // 2 or np.count_nonzero(~same) < 2:
        hint = "" if len(columns.time) > 1 else f" ({_HINT}?)"
        raise InputError(
            f"{path}: time does not advance: {np.count_nonzero(~same)} time stamps in {len(values)} rows of "
            f"'{columns.time[0].name}'{hint}"
        )
    return ~same, [f"{np.count_nonzero(same)} rows with the time stamp of the previous row are omitted"]


def check_rate(recording: Recording) -> None:
    """Raises InputError for a rate at which no guard runs, and suggests the unit of the time column."""
    rate_hz = 1e6 / max(recording.period_us, 1)
    if RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ:
        return
    units = [unit for unit, factor in TIME_S.items() if RATE_MIN_HZ <= rate_hz / factor <= RATE_MAX_HZ]
    hint = f'; is it in {units[0]} (unit = "{units[0]}" under [time] of a map)?' if units else ""
    raise InputError(
        f"{recording.path}: the rows are {recording.period_us * 1e-6:g} s apart by '{recording.time_column}', "
        f"and a guard runs at {RATE_MIN_HZ:g} to {RATE_MAX_HZ:g} Hz{hint}"
    )


def wrapped(path: Path, q: FloatArray, columns: ColumnMap) -> tuple[FloatArray, list[str]]:
    """Angles (m, n) as the wire carries them, and which joints were wrapped to +-pi: those that turn further, or all.

    Raises InputError for an angle of more turns than a joint reports, unless the map allows it.
    """
    farthest = np.abs(q).max(axis=0)
    beyond = farthest > WIRE_POSITION_RAD
    if not columns.wrap and np.any(farthest > _TURNS * 2.0 * np.pi + 0.1):
        joint = int(np.argmax(farthest))
        raise InputError(
            f"{path}: joint {joint + 1} stands at {farthest[joint]:.4g} rad, many turns: "
            'is it in degrees (unit = "deg" under [position] of a map), or does it count turns (wrap = true)?'
        )
    turned = np.ones_like(beyond) if columns.wrap else beyond
    if not turned.any():
        return q, []
    angles = np.where(turned, (q + np.pi) % (2.0 * np.pi) - np.pi, q)
    names = ", ".join(str(joint + 1) for joint in np.flatnonzero(beyond))
    return angles, [f"angles of joint {names} are beyond the wire and wrapped to +-pi"] if beyond.any() else []
