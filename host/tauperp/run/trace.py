"""The record of a run, cycle by cycle and event by event."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tauperp.sim.contact import ContactRecord, Strike
from tauperp.sim.sensors import SensorFault

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Stop:
    """Motion was permitted and no longer is. `time_s`: the cycle whose StopCommand, or whose silence, ended it.

    `reason` as on the wire (0: silence); joint 1 to n or 0; index value Nm; `standstill_s`: time of standstill of the
    robot.
    """

    time_s: float
    reason: int
    category: int
    joint: int
    value_nm: float
    trip_number: int
    standstill_s: float | None = None


@dataclass(frozen=True)
class Contact:
    """A strike and its result."""

    strike: Strike
    record: ContactRecord


@dataclass(frozen=True)
class Trace:
    """N cycles of an arm with n joints; Nm, N, m/s, s. Row k is what was sent, decided and felt in cycle k."""

    time_s: Vector  # (N,) of the Sync
    residual_nm: Vector  # (N, n) r
    index_nm: Vector  # (N, n) the index in force
    told: NDArray[
        np.int64
    ]  # (N, n) the row in which the value of both was new: its own, unless the bus reports one joint after the other
    threshold_nm: Vector  # (N, n) of the task in force
    task: NDArray[np.int64]  # (N,)
    phase: NDArray[np.int64]  # (N,) from 0
    permitted: NDArray[np.bool_]  # (N,)
    contact_n: Vector  # (N,) force of all contacts on the arm
    guiding_n: Vector  # (N,) intended force
    tip_speed_m_s: Vector  # (N,)
    stops: tuple[Stop, ...]
    contacts: tuple[Contact, ...]
    finished: bool  # every phase was completed before the time limit
    ended: str | None = None  # why the run was aborted, in words
    # (N, n) readings that are known to be wrong on the robot's side, or were not sent
    unusable: NDArray[np.bool_] | None = None

    def under_way(self, settle_s: float) -> NDArray[np.bool_]:
        """(N,) whether a collision is in progress: from its first touch until `settle_s` after its last."""
        mask = np.zeros(len(self.time_s), bool)
        for contact in self.contacts:
            begin, end = contact.record.contact_s, contact.record.release_s
            if begin is not None and end is not None:
                mask |= (self.time_s >= begin) & (self.time_s <= end + settle_s)
        return mask

    def free(self, settle_s: float) -> NDArray[np.bool_]:
        """(N, n) whether no collision is in progress, neither now nor when the values of r and the index were new."""
        rows = ~self.under_way(settle_s)
        return rows[:, None] & rows[self.told]

    def quiet(self, settle_s: float, faults: Sequence[SensorFault] = ()) -> NDArray[np.bool_]:
        """(N, n) free, with motion permitted until then, and no sensor fault on, or over for less than `settle_s`."""
        rows = self.permitted | np.concatenate([[False], self.permitted[:-1]])
        for fault in faults:
            rows &= (self.time_s < fault.start_s) | (self.time_s > fault.end_s + settle_s)
        return self.free(settle_s) & rows[:, None] & rows[self.told]


@dataclass
class TraceRecorder:
    """Collects rows and events while a run lasts."""

    stops: list[Stop] = field(default_factory=list)
    _rows: list[tuple[float, int, int, bool, float, float, float]] = field(default_factory=list)
    _residual: list[Vector] = field(default_factory=list)
    _index: list[Vector] = field(default_factory=list)
    _fresh: list[NDArray[np.bool_] | None] = field(default_factory=list)
    _unusable: list[NDArray[np.bool_] | None] = field(default_factory=list)

    def row(
        self,
        time_s: float,
        task: int,
        phase: int,
        permitted: bool,
        forces_n: tuple[float, float],
        tip_speed_m_s: float,
        indexes: tuple[Vector, Vector],
        fresh: NDArray[np.bool_] | None = None,
        unusable: NDArray[np.bool_] | None = None,
    ) -> None:
        """One cycle: `forces_n` of contact and guiding, `indexes` the residual and the index in force, (n,) each.

        `fresh` (n,): which of the indexes are new; by default all. `unusable` (n,): readings that cannot be used; by
        default none.
        """
        self._rows.append((time_s, task, phase, permitted, *forces_n, tip_speed_m_s))
        self._residual.append(indexes[0].copy())
        self._index.append(indexes[1].copy())
        self._fresh.append(fresh)
        self._unusable.append(unusable)

    def trace(
        self, thresholds: dict[int, Vector], contacts: tuple[Contact, ...], finished: bool, ended: str | None = None
    ) -> Trace:
        """Everything as arrays; `thresholds` (n,) by task number."""
        time, task, phase, permitted, contact, guiding, speed = (
            np.array(column) for column in zip(*self._rows, strict=True)
        )
        none = np.zeros(len(self._index[0]), bool)
        return Trace(
            time_s=time,
            residual_nm=np.array(self._residual),
            index_nm=np.array(self._index),
            told=self._told(),
            threshold_nm=np.array([thresholds[int(number)] for number in task]),
            task=task,
            phase=phase,
            permitted=permitted,
            contact_n=contact,
            guiding_n=guiding,
            tip_speed_m_s=speed,
            stops=tuple(self.stops),
            contacts=contacts,
            finished=finished,
            ended=ended,
            unusable=np.array([none if one is None else one for one in self._unusable]),
        )

    def _told(self) -> NDArray[np.int64]:
        rows = np.broadcast_to(np.arange(len(self._index))[:, None], np.shape(self._index))
        every = np.ones(rows.shape[1], bool)
        fresh = np.array([every if one is None else one for one in self._fresh])
        return np.maximum.accumulate(np.where(fresh, rows, 0), axis=0)
