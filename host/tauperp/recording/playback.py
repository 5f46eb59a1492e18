"""A recording as bus frames through the firmware's guard, one row per cycle.

Every row becomes one cycle at the recording's median period: Sync, TaskCommand, the joints' frames with E2E protection,
and a tick. A row that repeats the previous sample (a logger that is faster than its sensor) is sent unchanged, as the
driver of such a robot would send it. The torque is a sample at the Sync, not a mean since the last one. Cycles that the
logger lost are interpolated, or a new guard starts after them (`tauperp.recording.timeline`).

The host subtracts the torque sensors' offsets, as a joint's electronics would (`offsets`); or the firmware does, if its
configuration has them.

After the start and after a trip the robot's controller requests a reset in every other cycle. The guard grants it when
its inputs were good and the index below the thresholds for the configured time. The labels have no influence.
"""

import dataclasses

import can
import numpy as np
import numpy.typing as npt

from tauperp.busload import worst_case_load
from tauperp.config import LOAD_LIMIT, TASKS, Configuration, Numeric, TaskName
from tauperp.config.configuration import SETTLING
from tauperp.errors import InputError
from tauperp.firmware import Guard, Reason, State, Verdict
from tauperp.recording.cause import cause_of
from tauperp.recording.offsets import Offsets, find_offsets
from tauperp.recording.recording import FloatArray, Recording
from tauperp.recording.timeline import BRIDGE_MS, Timeline, timeline
from tauperp.run.moment import moment_of
from tauperp.sim.moment import Puppet, Watch
from tauperp.wire import Sender

_SENSOR_OK = 0
_AXES = ("AccelX", "AccelY", "AccelZ")
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
    detail: str = ""  # of an input: which quantity, its value and its limit


@dataclasses.dataclass(frozen=True, eq=False)
class Playback:
    """The guard's output for a recording, row by row."""

    recording: Recording
    configuration: Configuration  # at the recording's rate
    task: TaskName
    offsets: Offsets
    timeline: Timeline
    residual: FloatArray  # (m, n) Nm
    index: FloatArray  # (m, n) Nm, in the channel that is nearest to its threshold
    threshold: FloatArray  # (m, n) Nm, threshold in force in that channel; 0 without an active task
    evaluated: npt.NDArray[np.bool_]  # (m,) the row went through every stage
    permitted: npt.NDArray[np.bool_]  # (m,)
    reason: npt.NDArray[np.int64]  # (m,) Reason
    trips: tuple[Trip, ...]
    counters: dict[str, int]  # of all guards that ran, one after the other

    @property
    def offset_nm(self) -> FloatArray:
        """(n,) subtracted from the measured torque before it was sent."""
        return self.offsets.nm


def play(
    recording: Recording,
    configuration: Configuration,
    *,
    task: TaskName = "none",
    numeric: Numeric = "float32",
    offsets: str | None = None,
    bridge_ms: float = BRIDGE_MS,
    watch: Watch | None = None,
) -> Playback:
    """Send a recording through the guard, at the recording's rate instead of the configuration's.

    offsets    source of the torque sensors' offsets (`find_offsets`)
    bridge_ms  the longest gap between two rows that is interpolated
    watch      receives every row, with the arm in the recorded pose

    Raises InputError for a row that the wire cannot carry, and for what `find_offsets` refuses.
    """
    configuration = at_rate_of(recording, configuration)
    found = find_offsets(recording, configuration, offsets)
    player = _Player(recording, configuration, task, numeric, found, timeline(recording, bridge_ms))
    stage = None if watch is None else Puppet(configuration.robot)
    for row in range(len(recording.time_s)):
        verdict = player.play_row(row)
        if watch is not None and stage is not None:
            stage.pose(recording.q[row], float(recording.time_s[row]))
            watch(moment_of(stage, verdict, configuration.threshold_nm(task)))
    return player.result()


def at_rate_of(recording: Recording, configuration: Configuration) -> Configuration:
    """With CAN FD if frames at that rate do not fit onto a classic bus. Their content is the same."""
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


class _Player:
    """One guard after another over the parts of a recording, and their output for each row."""

    def __init__(
        self,
        recording: Recording,
        configuration: Configuration,
        task: TaskName,
        numeric: Numeric,
        offsets: Offsets,
        line: Timeline,
    ) -> None:
        self._recording, self._configuration, self._task = recording, configuration, task
        self._block = configuration.block(numeric)
        self._offsets, self._line = offsets, line
        rows, n = len(recording.time_s), configuration.robot.n
        self._starts = set(line.starts)
        self._readings = np.stack([recording.q, recording.qd, recording.tau - offsets.nm], axis=-1)
        self._residual, self._index, self._threshold = (np.zeros((rows, n)) for _ in range(3))
        self._evaluated, self._permitted = np.zeros(rows, bool), np.zeros(rows, bool)
        self._reason = np.zeros(rows, np.int64)
        self._trips: list[Trip] = []
        self._counters: dict[str, int] = {}
        self._cycle = 0
        self._verdict: Verdict | None = None
        self._guard, self._bus = self._begin()

    def _begin(self) -> tuple[Guard, "_Bus"]:
        return Guard(self._block), _Bus(self._recording, self._configuration, self._task)

    def play_row(self, row: int) -> Verdict:
        """The row's own cycle, and before it those of a gap. Raises InputError as play() does."""
        if row > 0 and row in self._starts:
            self._count()
            self._guard, self._bus = self._begin()
            self._cycle, self._verdict = 0, None
        target = int(self._line.cycle[row])
        permitted = True
        steps = target - self._cycle if self._cycle else 1
        for step in range(1, steps + 1):
            share = step / steps
            samples = self._readings[row]
            if share < 1:
                samples = (1 - share) * self._readings[row - 1] + share * samples
            verdict = self._tick(row, target - steps + step, samples)
            permitted &= verdict.permitted
        self._cycle = target
        self._residual[row], self._index[row], self._threshold[row] = verdict.residual, verdict.index, verdict.threshold
        self._evaluated[row], self._permitted[row] = verdict.fresh, permitted
        self._reason[row] = verdict.reason
        return verdict

    def _tick(self, row: int, cycle: int, samples: FloatArray) -> Verdict:
        now_us = (cycle - 1) * self._configuration.period_us
        before = self._verdict
        asked_for = before.trip_number if before and not before.permitted else None
        for frame in self._bus.frames(row, cycle, samples, asked_for):
            self._guard.receive(frame, now_us)
        verdict = self._verdict = self._guard.tick(now_us)
        if verdict.state == State.FAULT:
            raise InputError(f"{self._recording.place(row)}: the guard is in FAULT: {verdict.reason.name}")
        if verdict.state == State.STOPPED and (before is None or before.trip_number != verdict.trip_number):
            self._trips.append(
                Trip(
                    row,
                    float(self._recording.time_s[row]),
                    verdict.reason,
                    verdict.joint,
                    verdict.value_nm,
                    verdict.threshold_nm,
                    cause_of(verdict, self._configuration.robot, samples),
                )
            )
        return verdict

    def _count(self) -> None:
        for name, value in self._guard.counters.items():
            self._counters[name] = self._counters.get(name, 0) + value

    def result(self) -> Playback:
        self._count()
        return Playback(
            self._recording,
            self._configuration,
            self._task,
            self._offsets,
            self._line,
            self._residual,
            self._index,
            self._threshold,
            self._evaluated,
            self._permitted,
            self._reason,
            tuple(self._trips),
            self._counters,
        )


class _Bus:
    """All frames of the robot: its controller's and its joints'."""

    def __init__(self, recording: Recording, configuration: Configuration, task: TaskName) -> None:
        self._sender = Sender(configuration.wire, fd=configuration.settings.wire.format == "fd")
        self._task = TASKS[task]
        self._recording = recording

    def frames(self, row: int, cycle: int, samples: FloatArray, asked_for: int | None) -> list[can.Message]:
        """The frames of one cycle, in their order; samples (n, 3). asked_for: the trip to be reset, 0 for the start, or
        None.

        Raises InputError, with the line of the file, if the wire cannot carry a value.
        """
        own = self._recording.acceleration
        acceleration = dict(zip(_AXES, (0.0, 0.0, 0.0) if own is None else own[row].tolist(), strict=True))
        # An edge of Request needs a 0 first. The next attempt follows two cycles later, until the guard accepts it.
        reset = {"Request": int(asked_for is not None and cycle % 2 == 1), "TripNumber": asked_for or 0}
        try:
            frame = self._sender.frame
            return [
                frame("Sync", {"Cycle": cycle & _CYCLE_MASK}, cycle=cycle),
                frame("GuardReset", reset),
                frame("TaskCommand", {"Task": self._task, **acceleration}, cycle=cycle),
                *(
                    frame(
                        f"JointState{joint}",
                        {"SensorStatus": _SENSOR_OK, "Position": q, "Velocity": qd, "Torque": tau},
                        cycle=cycle,
                    )
                    for joint, (q, qd, tau) in enumerate(samples.tolist(), start=1)
                ),
            ]
        except InputError as error:
            raise InputError(f"{self._recording.place(row)}: {error}") from error
