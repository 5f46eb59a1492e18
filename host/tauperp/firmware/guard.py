"""The whole guard: frames and time in, a verdict with its frames out. The caller drives it like a board."""

from __future__ import annotations

import dataclasses
from typing import Any

import can
import numpy as np
import numpy.typing as npt

from tauperp.config import NUMERICS, Numeric
from tauperp.errors import InputError
from tauperp.firmware.library import FloatArray, load_library
from tauperp.wire_values import ContactClass, Reason, Start, State, Variant

_DATA_LENGTH = 8  # CAN_FRAME_DATA_LENGTH
_FD, _BRS, _EXTENDED, _REMOTE = 1, 2, 4, 8  # CAN_FRAME_*

_NUMERIC_OFFSET = 16  # of the block's numeric field

_REFUSALS = {
    2: "not a configuration block",
    3: "made for another version of the firmware; make a new one with `tauperp config`",
    4: "of another size than this firmware's",
    5: "its CRC does not match: the block is damaged",
    6: "made for the other numeric type",
    7: "made for another DBC; make a new one with `tauperp config`",
    8: "its robot table is not valid",
    9: "a period, deadline, budget or settling time is outside its bounds",
    10: "a threshold or debounce is outside its bounds, an index is unknown, or no task is configured",
    11: "d_e is zero for every force on an arm with 6 joints or fewer: the guard would detect nothing",
    12: "d_p is zero for every force on an arm with 5 joints or fewer: the guard would detect nothing",
    13: "the observer is too slow, or its constants are inconsistent with each other or the period",
    14: "a tolerance, lever or softness is outside its bounds, or the order is unknown",
    15: "a stop category is not allowed for its kind of stop",
    16: "a sensor's offset or friction is outside its bounds",
    17: "a limit on what a task explains is outside its bounds",
    18: "a channel's gain is not 1, or no channel of a task detects a constant force",
    19: "its worst-case reaction time is too long",
    20: "the blocks of the two channels are of different installations",
    21: "the shape of a link, a needed link or the reaction to a blind link is outside its bounds",
}  # guard_status_t, from GUARD_BAD_MAGIC on
_GUARD_OK = 1

# Reasons of a stop that is due to a computed value. All others are due to an input, or to the guard itself.
DETECTION_REASONS = (
    Reason.COLLISION,
    Reason.SUDDEN,
    Reason.EXPLAINED_FORCE,
    Reason.EXPLAINED_MOMENT,
    Reason.RESIDUAL_LIMIT,
)


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """Result of one tick (guard_output_t)."""

    state: State
    reason: Reason
    permitted: bool
    fresh: bool  # a new snapshot went through the stages in this tick
    task: int  # active task, number as on the wire
    stop_category: int
    joint: int  # 1 to n: joint of the trip, or the joint that the guard waits for; 0: none
    trip_number: int  # of the last trip; 0 before the first
    cycle: int  # of the newest Sync
    value_nm: float  # the index of `joint` at the trip; N or Nm for EXPLAINED_*
    threshold_nm: float
    residual: FloatArray  # (n,) r of this tick, Nm
    index: FloatArray  # (n,) the index of the active task, in the channel nearest to its threshold, Nm
    threshold: FloatArray  # (n,) threshold in force in that channel, Nm
    channel: int  # of the index that is nearest to its threshold
    value_channel: int  # of value_nm
    index_channel: npt.NDArray[np.uint8]  # (n,) of `index`
    full_speed: bool  # the permission is not for the reduced speed only
    blind_links: int  # bit per link, link 1 the lowest: the index in force detects no force on it
    needed_links: int  # bit per link: the task in force must detect a force on it
    contact_link: int  # that the last collision hit, 1 to n; 0: not known, or not yet
    contact_class: ContactClass  # of the last collision
    contact_force: FloatArray  # (3,) on the robot, base frame, N
    smallest_singular: float  # of the active basis, or a lower bound, Nm per N; 0 without a basis
    rank: int
    frames: list[can.Message]  # send in this order


class Guard:
    """One guard of the C firmware, with one configuration block (`Configuration.block()`).

    The caller acts as the board: it passes every frame in the order of reception, ticks once per cycle, and sends the
    verdict's frames. Time comes from any monotonic clock, in microseconds. One thread uses one guard.

    start, restarts   cause of the start, and number of unexpected restarts (guard_note_start)
    with_events       append the event recorder's frames to the guard's own (event_log.h)
    second            the same installation's block in Q9.22, for a second channel; the first is in float32 (pair.h)

    Raises InputError, with the firmware's reason, if the firmware refuses the block.
    """

    def __init__(
        self,
        block: bytes,
        *,
        start: Start = Start.COMMANDED,
        restarts: int = 0,
        variant: Variant = Variant.LOCKSTEP,
        with_events: bool = False,
        second: bytes | None = None,
    ) -> None:
        library = load_library(_numeric_of(block))
        self.library = library
        self._lib = library.lib
        self._config = library.load_block(block)  # the firmware keeps a pointer to it
        self.channels = 1 if second is None else 2
        if second is None:
            self._state = self._guard = library.new("guard_t *")
        elif library.numeric == "float32":
            self._state = library.new("pair_t *")
            self._guard = self._state.guard
        else:
            raise InputError("configuration block: the first of two channels is in float32")
        # Aligned as the firmware requires it, and kept: the firmware keeps a pointer to it.
        self._second_block = None if second is None else library.ffi.new("uint64_t[]", (len(second) + 7) // 8)
        self._frame = library.new("can_frame_t *")
        self._frame_data = library.ffi.buffer(self._frame.data)
        self._output = library.new("guard_output_t *")
        self._residual = library.view(self._output.residual)
        self._index = library.view(self._output.index)
        self._threshold = library.view(self._output.threshold)
        self._scale = 1.0 if library.numeric == "float32" else 2.0**-22
        self.n = int(self._config.robot.joint_count)
        status = self._init(second)
        if status != _GUARD_OK:
            raise InputError(f"configuration block: {_REFUSALS.get(status, f'refused with status {status}')}")
        self._call("note_start", int(start), restarts, int(variant))
        self._events = self.library.new("event_log_t *") if with_events else None
        if self._events is not None:
            self._lib.event_log_init(self._events, self._config)

    def _init(self, second: bytes | None) -> int:
        if second is None:
            return int(self._lib.guard_init(self._guard, self._config))
        if len(second) != self.library.ffi.sizeof("guard_config_t"):
            raise InputError(f"configuration block of the second channel: {len(second)} bytes")
        self.library.ffi.memmove(self._second_block, second, len(second))
        return int(self._lib.pair_init(self._state, self._config, self._second_block))

    def _call(self, name: str, *arguments: Any) -> Any:
        """The function of guard.h, or with two channels that of pair.h."""
        return getattr(self._lib, f"{'guard' if self.channels == 1 else 'pair'}_{name}")(self._state, *arguments)

    def __repr__(self) -> str:
        state, trips = State(self._output.state).name, self._output.trip_number
        return f"Guard: {self.n} joints, {self.library.numeric}, {state} at the last tick, trip {trips}"

    @property
    def counters(self) -> dict[str, int]:
        """Errors of the environment since the start, by the names of guard_counters_t."""
        counters = self._guard.counters
        return {name: int(getattr(counters, name)) for name, _ in self.library.ffi.typeof(counters).fields}

    def assume_reset(self) -> None:
        """For a guard that joins a bus log in the middle: the reset after the start is before the log."""
        self._guard.acknowledged = self.library.lib.GUARD_SET

    @property
    def config(self) -> Any:
        """The guard_config_t that the firmware reads."""
        return self._config

    def receive(self, message: can.Message, now_us: int) -> None:
        """Process one received frame. Error frames are ignored, as a real CAN controller does."""
        if not message.is_error_frame:
            self._call("receive", self.frame_of(message), now_us)

    def frame_of(self, message: can.Message) -> Any:
        """The frame as a can_frame_t, always at the same place in memory: valid until the next call."""
        frame = self._frame
        frame.id = message.arbitration_id
        frame.length = message.dlc  # which a remote frame has without data
        frame.flags = (
            (_FD if message.is_fd else 0)
            | (_BRS if message.bitrate_switch else 0)
            | (_EXTENDED if message.is_extended_id else 0)
            | (_REMOTE if message.is_remote_frame else 0)
        )
        self._frame_data[:] = bytes(message.data[:_DATA_LENGTH]).ljust(_DATA_LENGTH, b"\0")
        return frame

    def cycle_complete(self) -> bool:
        """Whether every joint's reading of the newest Sync's cycle was received and no tick has used it yet."""
        return bool(self._call("cycle_complete"))

    def tick(self, now_us: int) -> Verdict:
        """Make one tick. Costs about 20 us in Python, of which the firmware takes a few."""
        output, n, scale = self._output, self.n, self._scale
        force = output.contact_force
        self._call("tick", now_us, output)
        frames = [self._message(output.frame[i], now_us) for i in range(output.frame_count)]
        if self._events is not None:
            self._lib.event_log_note(self._events, output)
            if self._lib.event_log_frame(self._events, self._frame):
                frames.append(self._message(self._frame, now_us))
        return Verdict(
            State(output.state),
            Reason(output.reason),
            output.permitted,
            output.fresh,
            output.task,
            output.stop_category,
            output.joint,
            output.trip_number,
            output.cycle,
            output.value_nm * scale,
            output.threshold_nm * scale,
            self.library.from_num(self._residual[:n]),
            self.library.from_num(self._index[:n]),
            self.library.from_num(self._threshold[:n]),
            int(output.channel),
            int(output.value_channel),
            np.frombuffer(self.library.ffi.buffer(output.index_channel), np.uint8)[:n].copy(),
            output.full_speed,
            output.blind_links,
            output.needed_links,
            output.contact_link,
            ContactClass(output.contact_class),
            np.array([force.x, force.y, force.z]) * scale,
            output.smallest_singular * scale,
            output.rank,
            frames,
        )

    def note_tick_time(self, tick_us: int) -> None:
        """Duration of the last tick. Above the budget the next tick is FAULT."""
        self._call("note_tick_time", tick_us)

    def trip(self, reason: Reason) -> None:
        """Report a fault that only the board can detect, such as Reason.BUS_OFF."""
        self._call("trip", int(reason))

    def _message(self, frame: Any, now_us: int) -> can.Message:
        flags = frame.flags
        return can.Message(
            timestamp=now_us * 1e-6,
            arbitration_id=frame.id,
            is_extended_id=bool(flags & _EXTENDED),
            is_fd=bool(flags & _FD),
            bitrate_switch=bool(flags & _BRS),
            data=self.library.ffi.buffer(frame.data, frame.length)[:],
        )


def reaction_us(block: bytes) -> int:
    """Worst-case time from a step of torque of twice a threshold to the stop frame, us (config_reaction_us).

    Raises InputError if the firmware refuses the block, with the firmware's reason.
    """
    library = load_library(_numeric_of(block))
    config = library.load_block(block)
    status = int(library.lib.config_check(config))
    if status != _GUARD_OK:
        raise InputError(f"configuration block: {_REFUSALS.get(status, f'refused with status {status}')}")
    return int(library.lib.config_reaction_us(config))


def _numeric_of(block: bytes) -> Numeric:
    """The build that the block was made for. A block without this information goes to the float build, which refuses
    it."""
    number = int.from_bytes(block[_NUMERIC_OFFSET : _NUMERIC_OFFSET + 4], "little")
    return next((name for name, value in NUMERICS.items() if value == number), "float32")
