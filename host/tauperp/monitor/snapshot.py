"""The monitor's knowledge at one instant, as plain values with their ages."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from tauperp.words import spoken as spoken

SILENT_S = 0.2  # no StopCommand for this time is silence for a person; the robot itself waits one cycle
STALE_S = 0.5  # the guard sends every signal at least every 64 ms (GuardIndex of 8 joints at 500 Hz)
SLOWER = 10.0  # factor of both times for a guard in lockstep, whose simulation may be slow

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Reading(Generic[Value]):
    """A value and its age."""

    value: Value
    age_s: float
    stale_s: float = STALE_S

    @property
    def live(self) -> bool:
        """Recent enough to count as current."""
        return self.age_s <= self.stale_s


@dataclass(frozen=True, slots=True)
class Verdict:
    """A StopCommand. Reason by its name in the DBC; the index Nm is the tripped joint's, or the cycle's largest."""

    permitted: bool
    reason: str
    joint: int  # 1 to 8, 0 none
    trip_number: int
    category: str
    index_nm: float
    channel: int = 0  # of the bank, of that index
    full_speed: bool = True  # the permission is not for the reduced speed only

    @property
    def collided(self) -> bool:
        """Whether the index is that of a trip."""
        return not self.permitted and self.reason == "Collision"


@dataclass(frozen=True, slots=True)
class Reset:
    """A GuardReset of the robot."""

    request: bool
    trip_number: int


@dataclass(frozen=True, slots=True)
class JointIndex:
    """A GuardIndex, Nm."""

    residual_nm: float
    index_nm: float
    threshold_nm: float


@dataclass(frozen=True, slots=True)
class Stop:
    """The permission was withdrawn, or no longer sent (trip number None).

    `time_s` since 1970; `lasted_s` until the permission returned, None before; `earlier`: it was so already
    when the monitor began to listen; `times`: silences with no trip between them are one stop.
    """

    time_s: float
    trip_number: int | None
    reason: str
    joint: int = 0
    index_nm: float | None = None
    lasted_s: float | None = None
    earlier: bool = False
    times: int = 1


@dataclass(frozen=True, slots=True)
class Traffic:
    """One message of the wire as this monitor received it. The errors are the monitor's, not the guard's."""

    name: str
    joint: int  # 1 to 8 for JointState1..8, else 0
    rate_hz: float
    expected_hz: float | None  # None: an event, or a joint that this robot does not have
    frames: int
    crc_errors: int
    sequence_errors: int  # repeated, backwards or too far ahead
    lost_frames: int
    range_errors: int

    @property
    def missing(self) -> bool:
        """Clearly fewer frames than expected."""
        return self.expected_hz is not None and self.rate_hz < 0.9 * self.expected_hz


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything at `time_s` (since 1970).

    status  the signals of GuardStatus by name, those with a value table as words
    joints  by number from 1
    load    share of the bus's time that the received frames took, with the largest possible number of stuff bits
    """

    time_s: float
    verdict: Reading[Verdict] | None
    status: Mapping[str, Reading[float | str]]
    joints: Mapping[int, Reading[JointIndex]]
    traffic: tuple[Traffic, ...]
    stops: tuple[Stop, ...]  # newest first
    load: float
    format: str | None  # "classic" or "fd", of the newest frame
    rate_hz: float  # nominal cycles a second
    foreign_frames: int  # of no message of this wire
    format_errors: int  # of one, but of another length or kind
    error_frames: int  # that the bus itself reported, and times that the interface went down
    silent_s: float = SILENT_S  # of a StopCommand, until it is silence
    reset: Reading[Reset] | None = None  # the newest GuardReset
    interface_down: bool = False  # now: nothing can be received

    @property
    def heard(self) -> bool:
        """A guard is on the bus, now."""
        return self.verdict is not None and self.verdict.age_s <= self.silent_s

    @property
    def permitted(self) -> bool:
        """Motion is permitted, now. Silence means stop."""
        return self.heard and self.verdict is not None and self.verdict.value.permitted

    def total(self, counter: str) -> int:
        """Sum of one of Traffic's counters over all messages."""
        return sum(getattr(one, counter) for one in self.traffic)

    def live(self, name: str) -> float | str | None:
        """A signal of GuardStatus, None unless it is fresh."""
        reading = self.status.get(name)
        return reading.value if reading is not None and reading.live else None


def report(snapshot: Snapshot) -> dict[str, Any]:
    """For `--json`. Unknown values are null; ages in s. A stale value keeps its age; the reader decides."""
    body = dataclasses.asdict(snapshot)
    return {"permitted": snapshot.permitted, "heard": snapshot.heard, **_rounded(body)}


def _rounded(value: Any) -> Any:
    """Floats to the microsecond: what a line of JSON needs."""
    if isinstance(value, float):
        return round(value, 6)
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(one) for one in value]
    return value
