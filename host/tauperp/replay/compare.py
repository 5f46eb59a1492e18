"""Replay of a bus log through the firmware's guard, and comparison of its frames with those in the log, bit for bit.

Each StopCommand in the log is one tick. The guard receives every earlier frame of the log and ticks. Its frames are
compared with those of the log up to the next StopCommand. Signals that cannot be equal are masked and reported;
`masked_signals` states which and why. A frame with a masked signal is compared without its CRC.

Time. A guard in lockstep has one tick per period, and every frame counts as received at its tick's time. The replay
repeats this exactly. A guard in real time had a clock that the log does not contain; the time stamps of the log replace
it.

Start. If the log's guard had received no robot frames before the log, a new guard makes idle ticks until its counters,
pages and joints equal those of the log. It is then in the same state. Otherwise the log begins in the middle of a run.
A new guard then receives the robot's frames from the beginning of the log. The comparison begins when both guards
permit motion and the new observer has settled. From then on a GuardReset in the log is passed on with the new guard's
trip number.
"""

import dataclasses
from collections import deque
from collections.abc import Mapping
from typing import Any

import can

from tauperp.config import Configuration
from tauperp.firmware import Guard, Reason, State, Verdict
from tauperp.replay.origin import Field, Origin
from tauperp.wire import COUNTER_MASK, WireMessage

GUARD_MESSAGES = ("StopCommand", "GuardStatus", "GuardIndex")
EVENT_MESSAGE = "GuardEvent"  # the event recorder's copy of signals that are compared already

_REAL_TIME = ("TickTime", "WorstTickTime", "DeadlineMargin")
_SINCE_START = (
    *("CrcErrors", "SequenceErrors", "LostFrames", "RangeErrors", "FormatErrors", "LateFrames"),
    *("ResetsRefused", "TripCount", "Saturations", "WorstTickTime", "TripNumber"),
)
_OF_TRIP = (
    *("TripChannel", "TripJoint", "TripReason", "TripValue", "TripThreshold"),
    *("ContactLink", "ContactClass", "ContactForce", "ContactX", "ContactY", "ContactZ"),
)
_BUILD = ("FirmwareVersion", "BuildId")
_VERSIONS_PAGE = 4  # of GuardStatus, which has one in every other tick
_FORGOTTEN_GAINS = 20.0  # times 1 / K: e^-20 of a hundred Nm is far below a frame's 0.01 Nm
# A fault that only the board detects, including its time, is an input, taken from the log's StopCommand.
_TOLD_BY_BOARD = (
    Reason.TICK_LATE,
    Reason.TICK_OVER_BUDGET,
    *(Reason.BUS_OFF, Reason.BUS_DOWN, Reason.RX_OVERFLOW, Reason.SHUTDOWN, Reason.ANOTHER_GUARD),
)
_MOST_LOST = 8  # a step of the counter beyond it is one back
_TRIP_NUMBERS = 255  # 1 to 255, then 1 again


@dataclasses.dataclass(frozen=True)
class Difference:
    """A frame that is not the same: `logged` and `ours` are its signals by name where they differ, header included."""

    cycle: int  # ticks since the log's first
    time_s: float  # the log's
    message: str
    logged: Mapping[str, str]
    ours: Mapping[str, str]
    logged_data: str  # hex digits; empty: no such frame
    our_data: str


@dataclasses.dataclass(frozen=True)
class LoggedTrip:
    """The replayed guard tripped."""

    cycle: int
    time_s: float
    reason: Reason
    joint: int  # 1 to n, 0 none
    index_nm: float
    threshold_nm: float


@dataclasses.dataclass
class Count:
    """Counts of one message. Missing: the guard sends it, but the log lacks it."""

    equal: int = 0
    different: int = 0
    missing: int = 0


def masked_signals(origin: Origin, build: tuple[int, int] | None) -> dict[str, str]:
    """The signals that a correct guard need not repeat, each with the reason. None for a lockstep log from its start.

    build   FirmwareVersion and BuildId of the firmware that is run now, if known
    """
    masked = dict.fromkeys(_BUILD, "another build of the firmware") if build and origin.build != build else {}
    if origin.joined:
        masked |= dict.fromkeys(_SINCE_START, "counted since a start that is not in the log")
        masked |= dict.fromkeys(_OF_TRIP, "of a trip that may be before the log")
        masked |= {"Channels": "one channel is compared"} if origin.channels == 2 else {}
    if not origin.lockstep:
        masked |= dict.fromkeys(_REAL_TIME, "measured by a clock that is not in the log")
    return masked


class Comparison:
    """One log. Call `take` with each frame in order. The results are valid at any time."""

    def __init__(self, configuration: Configuration, origin: Origin) -> None:
        self.configuration = configuration
        self.origin = origin
        self.frames = 0
        self.cycles = 0
        self.compared_cycles = 0
        self.foreign_frames = 0  # of other protocols, also with 29-bit ids: a board's filter hides them from the guard
        self.lost_ticks = 0  # StopCommands that the log lacks, by their counter
        self.out_of_sequence = 0  # StopCommands with a counter that does not advance: those of another guard
        self.begin_s = self.end_s = 0.0
        self.counts = {name: Count() for name in GUARD_MESSAGES}
        self.first: Difference | None = None
        self.trips: list[LoggedTrip] = []
        self.verdict: Verdict | None = None  # of the newest tick
        # Two channels that start within a run cannot learn of an earlier reset, so one channel is compared.
        second = None if origin.joined else configuration.second_block(origin.channels)
        self._guard = Guard(configuration.block(origin.numeric), second=second)
        self._period_us = configuration.period_us
        wire = configuration.wire
        self._messages = {wire.message(name).id: wire.message(name) for name in GUARD_MESSAGES}
        self._event_id = wire.message(EVENT_MESSAGE).id
        self._inputs = set(wire.by_id) - set(self._messages) - {self._event_id}
        self._stop_id, self._reset = wire.message("StopCommand").id, wire.message("GuardReset")
        stop = wire.message("StopCommand")
        self._reason, self._trip = Field.of(stop, "Reason"), Field.of(stop, "TripNumber")
        self._requested = Field.of(self._reset, "TripNumber")
        self._due: deque[can.Message] = deque()
        self._comparing = not origin.joined
        if origin.joined:
            self._guard.assume_reset()
        self._trips_ahead = 0  # the log's trip number less the guard's
        self._logged_trip: int | None = None
        self._last_trip = 0
        self._last_counter: int | None = None
        self._begin_us = 0
        self._stamp_us = 0
        self._idle(origin.ticks_before)
        self.masked = masked_signals(origin, self._build())
        self._keep = {message.id: _kept_bits(message, self.masked) for message in self._messages.values()}

    @property
    def equal(self) -> bool:
        """Something was compared, and all of it is the same."""
        return self.compared_cycles > 0 and not any(one.different or one.missing for one in self.counts.values())

    def take(self, frame: can.Message) -> None:
        """The log's next frame."""
        if self.frames == 0:
            self.begin_s = frame.timestamp
        self.frames += 1
        self.end_s = frame.timestamp
        identifier = frame.arbitration_id
        if not self.origin.lockstep:  # never backwards, which stamps of several sources can be
            self._stamp_us = max(self._stamp_us, round((frame.timestamp - self.begin_s) * 1e6))
        if frame.is_extended_id or frame.is_error_frame or frame.is_remote_frame:
            self.foreign_frames += 1
        elif identifier == self._stop_id:
            self._tick(frame)
        elif identifier in self._messages:
            self._compare_due(frame)
        elif identifier in self._inputs:
            self._guard.receive(self._renumbered(frame) if self._trips_ahead else frame, self._now_us())
        elif identifier != self._event_id:
            self.foreign_frames += 1

    def _now_us(self) -> int:
        return self._begin_us + (self.cycles * self._period_us if self.origin.lockstep else self._stamp_us)

    def _idle(self, ticks: int) -> None:
        for tick in range(ticks):
            self._guard.tick(tick * self._period_us)
        self._begin_us = ticks * self._period_us

    def _build(self) -> tuple[int, int] | None:
        """FirmwareVersion and BuildId of this firmware; None where the log has none."""
        if self.origin.build is None:
            return None
        status = self.configuration.wire.message("GuardStatus")
        page, fields = Field.of(status, "Page"), [Field.of(status, name) for name in _BUILD]
        other = Guard(self.configuration.block(self.origin.numeric))
        for tick in range(2 * _VERSIONS_PAGE + 1):
            for frame in other.tick(tick * self._period_us).frames:
                if frame.arbitration_id == status.id and page.read(frame.data) == _VERSIONS_PAGE:
                    return fields[0].read(frame.data), fields[1].read(frame.data)
        return None

    def _tick(self, logged: can.Message) -> None:
        reason, trip = self._reason.read(logged.data), self._trip.read(logged.data)
        if reason in _TOLD_BY_BOARD and trip != self._logged_trip:
            self._guard.trip(Reason(reason))
        self._logged_trip = trip
        self._count_lost(logged)
        if self._comparing:
            for frame in self._due:
                self.counts[self._messages[frame.arbitration_id].name].missing += 1
                self._differs(None, frame)
        verdict = self.verdict = self._guard.tick(self._now_us())
        self._note_trip(verdict, logged.timestamp)
        ours, *telemetry = verdict.frames
        self._due = deque(telemetry)
        if not self._comparing and self._begins(verdict, reason):
            self._comparing = True
            self._trips_ahead = trip - verdict.trip_number
        if self._comparing:
            self.compared_cycles += 1
            self._compare(logged, ours)
        self.cycles += 1

    def _begins(self, verdict: Verdict, reason: int) -> bool:
        """Whether a guard that joined is one with the log's from here on."""
        forgotten_us = _FORGOTTEN_GAINS / self.configuration.settings.observer.gain_per_s * 1e6
        forgotten = self._now_us() - self._begin_us > forgotten_us
        return forgotten and verdict.permitted and reason == Reason.NONE

    def _compare_due(self, logged: can.Message) -> None:
        if self.cycles == 0:  # of a tick before the log's first
            return
        ours = self._due.popleft() if self._due else None
        if self._comparing:
            self._compare(logged, ours)

    def _compare(self, logged: can.Message, ours: can.Message | None) -> None:
        name = self._messages[logged.arbitration_id].name
        if ours is not None and self._same(logged, ours):
            self.counts[name].equal += 1
            return
        self.counts[name].different += 1
        self._differs(logged, ours)

    def _same(self, logged: can.Message, ours: can.Message) -> bool:
        if (logged.arbitration_id, logged.is_fd, len(logged.data)) != (ours.arbitration_id, ours.is_fd, len(ours.data)):
            return False
        if logged.data == ours.data:
            return True
        kept, selector = self._keep[ours.arbitration_id]
        bits = int.from_bytes(logged.data, "little") ^ int.from_bytes(ours.data, "little")
        return not bits & kept[selector.read(ours.data) if selector else 0]

    def _differs(self, logged: can.Message | None, ours: can.Message | None) -> None:
        if self.first is not None:
            return
        one, other = self._signals(logged), self._signals(ours)
        names = [name for name in {**one, **other} if one.get(name) != other.get(name)]
        some = logged or ours
        assert some is not None
        self.first = Difference(
            cycle=self.cycles,
            time_s=self.end_s,
            message=self._messages[some.arbitration_id].name,
            logged={name: one.get(name, "-") for name in names},
            ours={name: other.get(name, "-") for name in names},
            logged_data="" if logged is None else logged.data.hex(),
            our_data="" if ours is None else ours.data.hex(),
        )

    def _signals(self, frame: can.Message | None) -> dict[str, str]:
        """Every signal as text, CRC and Counter included; nothing for a frame that cannot be decoded."""
        if frame is None or frame.arbitration_id not in self._messages:
            return {}
        definition = self._messages[frame.arbitration_id].definition
        try:
            decoded: Any = definition.decode(bytes(frame.data))
        except Exception:  # a multiplexer or a length that there is not: cantools raises several types
            return {}
        signals = {name: f"{value:g}" if isinstance(value, float) else str(value) for name, value in decoded.items()}
        return {"frame format": "CAN FD" if frame.is_fd else "classic", **signals}

    def _count_lost(self, logged: can.Message) -> None:
        counter = logged.data[1] & COUNTER_MASK if len(logged.data) > 1 else 0
        if self._last_counter is not None:
            step = (counter - self._last_counter) & COUNTER_MASK
            if 1 <= step <= _MOST_LOST:
                self.lost_ticks += step - 1
            else:
                self.out_of_sequence += 1
        self._last_counter = counter

    def _note_trip(self, verdict: Verdict, time_s: float) -> None:
        if verdict.trip_number != self._last_trip and verdict.state in (State.STOPPED, State.FAULT):
            trip = LoggedTrip(
                self.cycles, time_s, verdict.reason, verdict.joint, verdict.value_nm, verdict.threshold_nm
            )
            self.trips.append(trip)
        self._last_trip = verdict.trip_number

    def _renumbered(self, frame: can.Message) -> can.Message:
        """A good GuardReset for the trip that the log's guard counted, for the guard that counts from its own start."""
        if frame.arbitration_id != self._reset.id or len(frame.data) != self._reset.length:
            return frame
        counter, data = frame.data[1] & COUNTER_MASK, bytearray(frame.data)
        self._reset.seal(data, counter)
        number = self._requested.read(data)
        if data != frame.data or number == 0:
            return frame
        number = (number - self._trips_ahead - 1) % _TRIP_NUMBERS + 1
        field = self._requested
        bits = int.from_bytes(data, "little") & ~(field.mask << field.shift) | number << field.shift
        data = bytearray(bits.to_bytes(len(data), "little"))
        self._reset.seal(data, counter)
        return can.Message(
            arbitration_id=frame.arbitration_id,
            is_extended_id=False,
            is_fd=frame.is_fd,
            bitrate_switch=frame.bitrate_switch,
            data=data,
        )


def _kept_bits(message: WireMessage, masked: Mapping[str, str]) -> tuple[dict[int, int], Field | None]:
    """Which bits are compared, by the value of the multiplexer (0 without one), and where that is."""
    everything = (1 << 8 * message.length) - 1
    selector = next((Field.of(message, name) for name in message.multiplexers), None)
    kept = dict.fromkeys(range(selector.mask + 1) if selector else range(1), everything)
    crc = Field.of(message, "CRC")
    for signal in message.definition.signals:
        if signal.name in masked:
            field = Field.of(message, signal.name)
            for page in signal.multiplexer_ids or kept:
                kept[page] &= ~(field.mask << field.shift) & ~(crc.mask << crc.shift)
    return kept, selector
