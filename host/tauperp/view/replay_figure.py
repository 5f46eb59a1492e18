"""The guard's reaction to a bus log or a recording, as one picture (tauperp.view.timeline)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauperp.config import TASKS, Configuration
from tauperp.plot import MUTED
from tauperp.recording import Playback, Recording, Score, Trip
from tauperp.recording.score import faults
from tauperp.replay.log_report import LogReplay
from tauperp.run.reach import wire_range
from tauperp.sim.moment import Moment
from tauperp.view.timeline import ALARM, Mark, Span, Timeline, draw
from tauperp.words import spoken

FROZEN_TICKS = 50  # a joint whose torque repeats this often while others change is frozen


def replay_figure(playback: Playback, score: Score) -> bytes:
    """A recording as PNG. Stops are red: touches found, with their delay; alarms; and faulty inputs."""
    recording = playback.recording
    stops = [_found(1000 * (trip.time_s - touch.start_s), trip) for touch, trip in score.found]
    stops += [_alarm(trip) for trip in score.alarms]
    stops += [_mark(trip) for trip in score.input_stops]
    stops += [Mark(touch.start_s, "MISSED", colour=ALARM) for touch in score.missed]
    found = f"{len(score.found)} of {score.touches} touches found"
    why = faults([score])
    return draw(
        Timeline(
            title=f"{recording.name}, {playback.configuration.robot.name}: {found}, {len(score.alarms)} alarms in "
            f"{score.idle_s:.1f} s idle",
            time_s=recording.time_s,
            residual_nm=playback.residual,
            index_nm=playback.index,
            threshold_nm=np.where(playback.threshold > 0, playback.threshold, np.inf),
            permitted=playback.permitted,
            symbol=playback.configuration.settings.task[playback.task].index,
            stops=tuple(stops),
            touches=tuple(Span(touch.start_s, touch.end_s) for touch in recording.touches),
            unusable=frozen(recording.tau) | beyond_wire(recording, playback.configuration),
            verdict="failed" if why else "passed",
            why=tuple(why),
        )
    )


def beyond_wire(recording: Recording, configuration: Configuration) -> NDArray[np.bool_]:
    """(m, n) readings that a JointState cannot carry."""
    most = wire_range(configuration.wire)
    sizes = ((recording.q, most.position), (recording.qd, most.velocity), (recording.tau, most.torque))
    return np.any([np.abs(values) > limit for values, limit in sizes], axis=0)


def _found(latency_ms: float, trip: Trip) -> Mark:
    return Mark(trip.time_s, f"{latency_ms:.0f} ms\njoint {trip.joint}", trip.joint)


def _alarm(trip: Trip) -> Mark:
    return Mark(trip.time_s, f"ALARM\njoint {trip.joint}", trip.joint)


def _mark(trip: Trip) -> Mark:
    who = f"\njoint {trip.joint}" if trip.joint else ""
    return Mark(trip.time_s, spoken(trip.reason.name) + who, trip.joint)


def frozen(torque: NDArray[np.float64], ticks: int = FROZEN_TICKS) -> NDArray[np.bool_]:
    """(m, n) where a joint's torque (m, n) repeats for many rows while another joint's changes."""
    same = np.diff(torque, axis=0, prepend=np.nan) == 0.0
    found = np.zeros(torque.shape, bool)
    for joint in range(torque.shape[1]):
        edges = np.flatnonzero(np.diff(same[:, joint].astype(int), prepend=0, append=0)).reshape(-1, 2)
        others = np.delete(same, joint, axis=1)
        for first, last in edges:
            if last - first >= ticks and not others[first:last].all(axis=1).mean() > 0.5:
                found[first:last, joint] = True
    return found


class LogTimeline:
    """A watch that collects the data of the picture of a replayed log."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, bool, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]] = []
        self._torque: list[NDArray[np.float64]] = []
        self._unusable: list[NDArray[np.bool_]] = []

    def watch(self, moment: Moment) -> None:
        """One tick."""
        self._rows.append(
            (moment.time_s, moment.permitted, moment.residual.copy(), moment.index.copy(), moment.threshold.copy())
        )
        nothing = np.zeros(len(moment.residual))
        self._torque.append(nothing if moment.torque is None else moment.torque.copy())
        self._unusable.append(nothing > 0 if moment.unusable is None else moment.unusable.copy())

    @property
    def unusable(self) -> NDArray[np.bool_]:
        """(N, n) readings that were missing, invalid, out of range, or frozen."""
        return np.array(self._unusable) | frozen(np.array(self._torque))

    def figure(self, replay: LogReplay) -> bytes | None:
        """The log as PNG; None if the guard never ticked."""
        if not self._rows:
            return None
        time, permitted, residual, index, threshold = (np.array(column) for column in zip(*self._rows, strict=True))
        one = replay.comparison
        different = () if replay.equal else ("the frames of the log and of this firmware differ",)
        return draw(
            Timeline(
                title=f"{replay.path.name}  ·  {one.configuration.robot.name}, replayed",
                time_s=time,
                residual_nm=residual,
                index_nm=index,
                threshold_nm=np.where(threshold > 0, threshold, np.inf),
                permitted=permitted,
                symbol=_symbol(one.configuration),
                verdict="passed" if replay.equal else "failed",
                why=(replay.damage,) if replay.damage else different,
                stops=tuple(_trip(trip) for trip in one.trips),
                unusable=self.unusable,
            )
        )


def _trip(trip: Any) -> Mark:
    who = f"\njoint {trip.joint}" if trip.joint else ""
    colour = MUTED if trip.reason.name == "SHUTDOWN" else ALARM
    return Mark(trip.time_s, spoken(trip.reason.name) + who, trip.joint, colour)


def _symbol(configuration: Configuration) -> str:
    """Of the index, if every task has the same."""
    used = {configuration.settings.task[name].index for name in TASKS}
    return used.pop() if len(used) == 1 else "d"
