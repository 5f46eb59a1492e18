"""A recording as bus frames through the firmware's guard, one row a cycle.

Every row becomes one cycle at the recording's median period: Sync, TaskCommand, the joints' frames with their E2E
protection, and a tick. A row that only repeats the sample before (a logger that is faster than its sensor) is sent as
it is, as such a robot's driver would send it. The torque is a sample at the Sync, not a mean since the last one.

The torque sensors' offsets are taken on the host, where a joint's own electronics would: the mean of measured torque
minus the model's gravity torque over the first second, in which the arm has to be at rest and untouched. It also takes
away what the model has wrong in that pose.

After the start and after a trip the robot's controller asks for a reset in every other cycle. The guard grants it when
its inputs have been good and the index below the thresholds for the configured time; labels have no part in it.
"""

import dataclasses

import can
import numpy as np
import numpy.typing as npt

from tauperp.busload import worst_case_load
from tauperp.config import LOAD_LIMIT, TASKS, Configuration, Numeric, TaskName
from tauperp.config.configuration import SETTLING
from tauperp.errors import InputError
from tauperp.firmware import Core, Guard, Reason, State, Verdict
from tauperp.replay.recording import FloatArray, Recording
from tauperp.replay.showing import moment_of
from tauperp.sim.moment import Puppet, Watch
from tauperp.wire import Sender

REST_S = 1.0
REST_VELOCITY_RAD_S = 0.05

_SENSOR_OK = 0
_NO_ACCELERATION = {"AccelX": 0.0, "AccelY": 0.0, "AccelZ": 0.0}
_CYCLE_MASK = 0xFFFF


@dataclasses.dataclass(frozen=True)
class Trip:
    """The guard withdrew its permission at this row."""

    row: int
    time_s: float
    reason: Reason
    joint: int  # 1 to n, 0 none
    index_nm: float
    threshold_nm: float


@dataclasses.dataclass(frozen=True, eq=False)
class Playback:
    """What the guard made of a recording, row by row."""

    recording: Recording
    configuration: Configuration  # at the recording's rate
    task: TaskName
    offset_nm: FloatArray  # (n,) taken from the measured torque
    residual: FloatArray  # (m, n) Nm
    index: FloatArray  # (m, n) Nm
    permitted: npt.NDArray[np.bool_]  # (m,)
    trips: tuple[Trip, ...]
    counters: dict[str, int]


def sensor_offset(recording: Recording, core: Core) -> FloatArray:
    """Mean of measured torque minus gravity torque over the first second, (n,) Nm.

    Raises InputError if the arm moves or is touched in it, or the recording is shorter.
    """
    rest = recording.time_s < REST_S
    if recording.time_s[-1] < REST_S:
        short = f"shorter than the {REST_S:g} s at rest that it has to begin with"
        raise InputError(
            f"{recording.damage}; what is before is {short}" if recording.damage else f"{recording.path}: {short}"
        )
    if recording.touched is not None and recording.touched[rest].any():
        raise InputError(f"{recording.path}: touched in the first {REST_S:g} s, which give the sensors' offsets")
    fastest = np.abs(recording.qd[rest]).max()
    if fastest > REST_VELOCITY_RAD_S:
        raise InputError(f"{recording.path}: moves at {fastest:.2g} rad/s in the first {REST_S:g} s; it has to rest")
    gravity = core.terms(recording.q[rest], recording.qd[rest]).gravity
    offset: FloatArray = (recording.tau[rest] - gravity).mean(axis=0)
    return offset


def play(
    recording: Recording,
    configuration: Configuration,
    *,
    task: TaskName = "none",
    numeric: Numeric = "float32",
    watch: Watch | None = None,
) -> Playback:
    """Send a recording through the guard, which runs at the recording's rate instead of the configuration's.

    `watch` sees every row, on an arm that stands as the recorded one did.

    Raises InputError for a row that the wire cannot carry, and for what `sensor_offset` refuses.
    """
    configuration = _at_rate_of(recording, configuration)
    offset = sensor_offset(recording, Core(configuration.robot, numeric, configuration))
    guard = Guard(configuration.block(numeric))
    bus = _Bus(recording, configuration, task, offset)
    rows = len(recording.time_s)
    residual, index = np.empty((rows, guard.n)), np.empty((rows, guard.n))
    permitted = np.zeros(rows, bool)
    trips: list[Trip] = []
    verdict: Verdict | None = None
    stage = None if watch is None else Puppet(configuration.robot)
    for row in range(rows):
        now_us = row * configuration.period_us
        before = verdict
        asked_for = verdict.trip_number if verdict and not verdict.permitted else None
        for frame in bus.frames(row, asked_for):
            guard.receive(frame, now_us)
        verdict = guard.tick(now_us)
        residual[row], index[row], permitted[row] = verdict.residual, verdict.index, verdict.permitted
        if verdict.state == State.FAULT:
            raise InputError(f"{recording.place(row)}: the guard is in FAULT: {verdict.reason.name}")
        if verdict.state == State.STOPPED and (before is None or before.trip_number != verdict.trip_number):
            at_s = float(recording.time_s[row])
            trips.append(Trip(row, at_s, verdict.reason, verdict.joint, verdict.value_nm, verdict.threshold_nm))
        if watch is not None and stage is not None:
            stage.pose(recording.q[row], float(recording.time_s[row]))
            watch(moment_of(stage, verdict, configuration.threshold_nm(task)))
    return Playback(recording, configuration, task, offset, residual, index, permitted, tuple(trips), guard.counters)


def _at_rate_of(recording: Recording, configuration: Configuration) -> Configuration:
    """As CAN FD where frames of that rate do not fit onto a classic bus: what is in them is the same."""
    rate_hz = 1e6 / recording.period_us
    form = configuration.settings.wire.format
    if worst_case_load(configuration.wire, joints=configuration.robot.n, rate_hz=rate_hz, fd=False) > LOAD_LIMIT:
        form = "fd"
    settings = configuration.settings
    healthy_ms = settings.reset.healthy_ms
    settling_ms = 1000 * SETTLING / settings.observer.gain_per_s + recording.period_us / 1000  # rounded up to cycles
    return configuration.changed(
        wire={"rate_hz": rate_hz, "format": form},
        observer={"torque_sample": "instant"},
        reset={"healthy_ms": None if healthy_ms is None else max(healthy_ms, settling_ms)},
    )


class _Bus:
    """Everything that the robot puts on the bus: its controller's frames and its joints'."""

    def __init__(self, recording: Recording, configuration: Configuration, task: TaskName, offset: FloatArray) -> None:
        self._sender = Sender(configuration.wire, fd=configuration.settings.wire.format == "fd")
        self._task = TASKS[task]
        self._recording = recording
        self._offset = offset

    def frames(self, row: int, asked_for: int | None) -> list[can.Message]:
        """The frames of one cycle, in their order. asked_for: the trip to be reset, 0 for the start, or None.

        Raises InputError, with the line of the file, if the wire cannot carry a value.
        """
        # An edge of Request needs a 0 first; the next try comes two cycles later, until the guard grants it.
        reset = {"Request": int(asked_for is not None and row % 2 == 0), "TripNumber": asked_for or 0}
        recording = self._recording
        samples = np.stack([recording.q[row], recording.qd[row], recording.tau[row] - self._offset], axis=-1).tolist()
        try:
            frame = self._sender.frame
            return [
                frame("Sync", {"Cycle": row & _CYCLE_MASK}, cycle=row),
                frame("GuardReset", reset),
                frame("TaskCommand", {"Task": self._task, **_NO_ACCELERATION}, cycle=row),
                *(
                    frame(
                        f"JointState{joint}",
                        {"SensorStatus": _SENSOR_OK, "Position": q, "Velocity": qd, "Torque": tau},
                        cycle=row,
                    )
                    for joint, (q, qd, tau) in enumerate(samples, start=1)
                ),
            ]
        except InputError as error:
            raise InputError(f"{self._recording.place(row)}: {error}") from error
