"""Input of a calibration: tables of recordings, bus logs, and a live bus, all as one `Motion`."""

import dataclasses
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import can
import numpy as np
import numpy.typing as npt

from tauperp.errors import InputError
from tauperp.recording.tables import read_recording
from tauperp.replay.buslog import BusLog
from tauperp.wire import Receiver, Wire

FloatArray = npt.NDArray[np.float64]

BUS_LOGS = (".blf", ".asc", ".log", ".trc", ".db")
CYCLES = 1 << 16
BEFORE_TOUCH_S, AFTER_TOUCH_S = 0.3, 0.7  # omitted around a touch: a person makes the labels, and filters have memory
PART_S = 2.0  # the shortest part between two touches that is used


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """Readings of an arm, one row a cycle. Torque Nm with the sign of the gravity torque."""

    name: str
    time_s: FloatArray  # (m,) from 0
    q: FloatArray  # (m, n) rad
    qd: FloatArray  # (m, n) rad/s
    tau: FloatArray  # (m, n) Nm
    is_mean_torque: bool  # the mean since the last row (the bus's joints), not a sample
    touched: npt.NDArray[np.bool_] | None = None  # (m,) rows in which a person touches the arm; None: none

    @property
    def period_us(self) -> int:
        """The median distance of two rows."""
        return round(float(np.median(np.diff(self.time_s))) * 1e6)

    @property
    def duration_s(self) -> float:
        return float(self.time_s[-1])

    def untouched_parts(self) -> list["Motion"]:
        """The motion itself, or its parts without a touch, named by their begin.

        Raises InputError if there is none of PART_S.
        """
        if self.touched is None:
            return [self]
        near = np.zeros(len(self.time_s), bool)
        edges = np.flatnonzero(np.diff(self.touched.astype(int), prepend=0, append=0)).reshape(-1, 2)
        for first, last in edges:
            begin_s, end_s = self.time_s[first] - BEFORE_TOUCH_S, self.time_s[last - 1] + AFTER_TOUCH_S
            near |= (self.time_s >= begin_s) & (self.time_s <= end_s)
        clear = np.flatnonzero(np.diff((~near).astype(int), prepend=0, append=0)).reshape(-1, 2)
        parts = [
            dataclasses.replace(self.part(first, last), name=f"{self.name} from {self.time_s[first]:.1f} s")
            for first, last in clear
            if self.time_s[last - 1] - self.time_s[first] >= PART_S
        ]
        if not parts:
            raise InputError(
                f"{self.name}: touched at {self.time_s[edges[0][0]]:.2f} s and {len(edges) - 1} more times: no part of"
                f" {PART_S:g} s is clear of touches; record the arm without touches"
            )
        return parts

    def refuse_touches(self) -> None:
        """Raises InputError if a person touches the arm."""
        if self.touched is not None:
            at_s = float(self.time_s[int(np.argmax(self.touched))])
            raise InputError(f"{self.name}: touched at {at_s:.2f} s; this takes recordings without touches")

    def corrected(self, tau: FloatArray) -> "Motion":
        """The same motion with other torques."""
        return dataclasses.replace(self, tau=tau)

    def part(self, first: int, last: int) -> "Motion":
        """Selected rows, with times from 0."""
        rows = slice(first, last)
        return dataclasses.replace(
            self,
            touched=None,
            time_s=self.time_s[rows] - self.time_s[first],
            q=self.q[rows],
            qd=self.qd[rows],
            tau=self.tau[rows],
        )


def is_bus_log(path: Path) -> bool:
    """By its suffix, with or without .gz."""
    return path.with_suffix("").suffix.lower() in BUS_LOGS if path.suffix == ".gz" else path.suffix in BUS_LOGS


def read_motion(
    path: str | Path, joints: int, map_file: str | Path | None = None, *, names: Sequence[str] = ()
) -> Motion:
    """Read one file; names: of the joints, for messages with names.

    Raises InputError if it is damaged or has no readings of this many joints.
    """
    path = Path(path)
    if is_bus_log(path):
        log = BusLog(path)
        motion = motion_of_frames(log, joints, path.name)
        if log.damage is not None:
            raise InputError(str(log.damage))
        return motion
    recording = read_recording(path, joints, map_file, names=names)
    if recording.damage is not None:
        raise InputError(recording.damage)
    touched = recording.touched
    if touched is not None and not touched.any():
        touched = None
    return Motion(recording.name, recording.time_s, recording.q, recording.qd, recording.tau, False, touched)


def motion_of_frames(frames: Iterable[can.Message], joints: int, name: str) -> Motion:
    """The complete cycles among the frames of a bus. Frames that fail their E2E check are ignored."""
    wire = Wire.read()
    receiver = Receiver(wire)
    ids = {wire.message(f"JointState{joint + 1}").id: joint for joint in range(joints)}
    sync = wire.message("Sync").id
    rows: list[tuple[float, npt.NDArray[np.float64]]] = []
    current, at_s = np.full((3, joints), np.nan), None
    for frame in frames:
        if frame.arbitration_id != sync and frame.arbitration_id not in ids:
            continue
        received = receiver.receive(frame)
        if received is None or not received.status.accepted or received.invalid:
            continue
        if frame.arbitration_id == sync:
            if at_s is not None and np.isfinite(current).all():
                rows.append((at_s, current.copy()))
            current[:], at_s = np.nan, frame.timestamp
        elif received.signals["SensorStatus"] == 0:
            signals = received.signals
            current[:, ids[frame.arbitration_id]] = signals["Position"], signals["Velocity"], signals["Torque"]
    if at_s is not None and np.isfinite(current).all():
        rows.append((at_s, current.copy()))
    if len(rows) < 2:
        raise InputError(f"{name}: no two complete cycles of {joints} joints")
    times = np.array([row[0] for row in rows])
    values = np.stack([row[1] for row in rows])
    return Motion(name, times - times[0], values[:, 0], values[:, 1], values[:, 2], True)


def record_motion(bus: can.BusABC, seconds: float, joints: int, report: Callable[[float], None]) -> Motion:
    """Record a live bus for this time. It sends nothing."""
    frames: list[can.Message] = []
    begin = time.monotonic()
    while (passed := time.monotonic() - begin) < seconds:
        frame = bus.recv(timeout=min(0.1, seconds - passed))
        if frame is not None:
            frames.append(frame)
        report(min(passed / seconds, 1.0))
    return motion_of_frames(frames, joints, "bus")
