"""The model of the live view. It receives frames and returns a Snapshot. No clock, no bus, no terminal."""

from collections import Counter
from typing import cast

import can

from tauperp.bus import BITRATE, DATA_BITRATE
from tauperp.busload import FrameBits, classic_bits, fd_bits
from tauperp.monitor.history import History
from tauperp.monitor.rates import Rates
from tauperp.monitor.snapshot import (
    SILENT_S,
    SLOWER,
    STALE_S,
    JointIndex,
    Reading,
    Reset,
    Snapshot,
    Traffic,
    Verdict,
)
from tauperp.wire import E2EStatus, Received, Receiver, Wire, WireMessage

CLASSIC_HZ, FD_HZ = 500.0, 1000.0  # the wire's two pairs of format and cycle rate
MOVE = (1, 14)  # Permission and PermissionInverted: every other pair is a stop
EXTENDED_BITS = 25  # of an extended id: SRR, IDE, 18 bits of id, and the stuff bits that they can cost
ERROR_FRAME_BITS = FrameBits(23)  # superposed flags, delimiter and intermission at their longest
_BUSY = "busy"
_DECODED = (
    "StopCommand",
    "GuardStatus",
    "GuardIndex",
    "GuardReset",
)  # of all others only the E2E check is of interest here
_ERRORS = {
    E2EStatus.WRONG_CRC: "crc_errors",
    E2EStatus.REPEATED: "sequence_errors",
    E2EStatus.WRONG_SEQUENCE: "sequence_errors",
}


class Monitor:
    """Receives every frame of a bus.

    now_s       of all calls: one clock that does not go back, for example time.monotonic()
    epoch_s     offset from that clock to seconds since 1970
    rate_hz     nominal cycles per second; by default 500 for classic frames and 1000 for CAN FD
    bitrate, data_bitrate   bit/s, for the load
    """

    def __init__(
        self,
        wire: Wire,
        *,
        now_s: float,
        epoch_s: float = 0.0,
        rate_hz: float | None = None,
        bitrate: float = BITRATE,
        data_bitrate: float = DATA_BITRATE,
    ) -> None:
        self._wire = wire
        self._epoch_s = epoch_s
        self._rate_hz = rate_hz
        self._bitrates = (bitrate, data_bitrate)
        self._lengths: dict[tuple[tuple[bool, ...], int], float] = {}
        self._receiver = Receiver(wire)
        self._rates = Rates(now_s)
        self._history = History()
        self._counts: dict[str, Counter[str]] = {name: Counter() for name in wire.messages}
        self._decoded = {wire.message(name).id for name in _DECODED}
        self._verdict: tuple[Verdict, float] | None = None
        self._reset: tuple[Reset, float] | None = None
        self._status: dict[str, tuple[float | str, float]] = {}
        self._joints: dict[int, tuple[JointIndex, float]] = {}
        self._fd: bool | None = None
        self._foreign = self._format_errors = self._error_frames = 0
        self._is_down = False
        self._words = {name: _value_tables(wire.message(name)) for name in _DECODED}

    def hear(self, frame: can.Message, now_s: float) -> None:
        """Process one frame of the bus, of any kind."""
        self._is_down = False
        self._rates.add(_BUSY, now_s, self._seconds(frame))
        if frame.is_error_frame:
            self._error_frames += 1
            return
        received = self._receiver.receive(frame, decode=frame.arbitration_id in self._decoded)
        if received is None:
            if frame.arbitration_id in self._wire.by_id and not frame.is_extended_id:
                self._format_errors += 1
            else:
                self._foreign += 1
            return
        self._fd = frame.is_fd
        self._count(received, now_s)
        if received.signals and not received.invalid:
            self._take(received.message.name, received.signals, now_s)

    def note_bus_error(self) -> None:
        """Record that the bus failed without an error frame."""
        self._error_frames += 1
        self._is_down = True

    def note_interface(self, is_down: bool) -> None:
        """Record the state that the system reports for the interface."""
        self._is_down = is_down

    def snapshot(self, now_s: float) -> Snapshot:
        """Snapshot at `now_s`."""
        self._rates.advance(now_s)
        slower, stale_s = self._slower, STALE_S * self._slower
        self._history.look(now_s + self._epoch_s, SILENT_S * slower)
        status = {name: Reading(value, now_s - at_s, stale_s) for name, (value, at_s) in self._status.items()}
        joints = {joint: Reading(value, now_s - at_s, stale_s) for joint, (value, at_s) in sorted(self._joints.items())}
        return Snapshot(
            time_s=now_s + self._epoch_s,
            verdict=None if self._verdict is None else Reading(self._verdict[0], now_s - self._verdict[1]),
            status=status,
            joints=joints,
            traffic=tuple(self._traffic(message) for message in self._wire.messages.values()),
            stops=self._history.stops(),
            load=self._rates.rate(_BUSY),
            format=None if self._fd is None else "fd" if self._fd else "classic",
            rate_hz=self._nominal_hz,
            foreign_frames=self._foreign,
            format_errors=self._format_errors,
            error_frames=self._error_frames,
            silent_s=SILENT_S * slower,
            reset=None if self._reset is None else Reading(self._reset[0], now_s - self._reset[1]),
            interface_down=self._is_down,
        )

    @property
    def _slower(self) -> float:
        """The factor by which a cycle may last longer than its period."""
        return SLOWER if self._status.get("Variant", ("", 0.0))[0] == "Lockstep" else 1.0

    @property
    def _nominal_hz(self) -> float:
        if self._rate_hz is not None:
            return self._rate_hz
        return FD_HZ if self._fd else CLASSIC_HZ

    def _seconds(self, frame: can.Message) -> float:
        """Longest time that the frame occupied the bus; computed once per kind of frame."""
        kind = (frame.is_error_frame, frame.is_remote_frame, frame.is_extended_id, frame.is_fd, frame.bitrate_switch)
        seconds = self._lengths.get((kind, frame.dlc))
        if seconds is None:
            seconds = frame_bits(frame).seconds(*self._bitrates)
            self._lengths[kind, frame.dlc] = seconds
        return seconds

    def _count(self, received: Received, now_s: float) -> None:
        name = received.message.name
        counts = self._counts[name]
        counts["frames"] += 1
        counts["lost_frames"] += received.lost
        counts["range_errors"] += bool(received.invalid)
        if received.status in _ERRORS:
            counts[_ERRORS[received.status]] += 1
        else:
            self._rates.add(name, now_s)  # the guard cannot have used a frame that fails its check

    def _take(self, name: str, signals: dict[str, float], now_s: float) -> None:
        if name == "StopCommand":
            verdict = self._read_verdict(signals)
            self._verdict = (verdict, now_s)
            self._history.note(verdict, now_s + self._epoch_s, SILENT_S * self._slower)
        elif name == "GuardReset":
            self._reset = (Reset(bool(signals["Request"]), int(signals["TripNumber"])), now_s)
        elif name == "GuardStatus":
            words = self._words[name]
            for signal, value in signals.items():
                self._status[signal] = (words[signal].get(int(value), "?") if signal in words else value, now_s)
        elif name == "GuardIndex":
            joint = int(signals["Joint"]) + 1
            values = (signals[f"{signal}{joint}"] for signal in ("Residual", "Index", "Threshold"))
            self._joints[joint] = (JointIndex(*values), now_s)

    def _read_verdict(self, signals: dict[str, float]) -> Verdict:
        words = self._words["StopCommand"]
        return Verdict(
            permitted=(signals["Permission"], signals["PermissionInverted"]) == MOVE,
            reason=words["Reason"].get(int(signals["Reason"]), "?"),
            joint=int(signals["Joint"]),
            trip_number=int(signals["TripNumber"]),
            category=words["StopCategory"].get(int(signals["StopCategory"]), "?"),
            index_nm=signals["IndexValue"],
            channel=int(signals["Channel"]),
            full_speed=bool(signals["FullSpeed"]),
        )

    def _traffic(self, message: WireMessage) -> Traffic:
        counts = self._counts[message.name]
        return Traffic(
            message.name,
            message.joint,
            self._rates.rate(message.name),
            self._expected_hz(message),
            **{
                name: counts[name]
                for name in ("frames", "crc_errors", "sequence_errors", "lost_frames", "range_errors")
            },
        )

    def _expected_hz(self, message: WireMessage) -> float | None:
        """The expected rate from the DBC, scaled by the measured rate of Sync."""
        sync = self._wire.message("Sync")
        if message.cycle_time_ms == 0 or message.timeout_cycles == 0 or message.joint > self._robot_joints:
            return None  # an event, or sent only in some situations
        paced = message is not sync and self._rates.rate(sync.name)
        return (paced or self._nominal_hz) * sync.cycle_time_ms / message.cycle_time_ms

    @property
    def _robot_joints(self) -> int:
        """As the guard reports it, otherwise the last known one."""
        if "RobotJoints" in self._status:
            return int(cast(float, self._status["RobotJoints"][0]))
        heard = [one.joint for one in self._wire.messages.values() if one.joint and self._counts[one.name]["frames"]]
        return max([*heard, *self._joints], default=0)


def frame_bits(frame: can.Message) -> FrameBits:
    """Longest length of a frame, with every stuff bit that the standard allows."""
    if frame.is_error_frame:
        return ERROR_FRAME_BITS
    length = 0 if frame.is_remote_frame else frame.dlc
    bits = fd_bits(length) if frame.is_fd else classic_bits(length)
    if frame.is_fd and not frame.bitrate_switch:
        bits = FrameBits(bits.nominal + bits.data)
    return FrameBits(bits.nominal + EXTENDED_BITS * frame.is_extended_id, bits.data)


def _value_tables(message: WireMessage) -> dict[str, dict[int, str]]:
    """Signal -> raw value -> word, for signals that have a value table."""
    return {
        signal.name: {int(value): str(word) for value, word in signal.choices.items()}
        for signal in message.definition.signals
        if signal.choices
    }
