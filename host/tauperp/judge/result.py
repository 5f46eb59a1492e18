"""The result of a run as values: collisions, faults, stops, peaks, the permission, and a verdict.

Times are s to the microsecond, torques Nm, forces N. JSON and tables are made of them where they are written
(tauperp.judge.report, tauperp.view).
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tauperp.firmware import Reason
from tauperp.provenance import GuardIdentity
from tauperp.run.pace import Kept
from tauperp.run.trace import Stop
from tauperp.sim.sensors import SensorFault

NOT_TESTED: Final = "not tested"
SILENCE = "SILENCE"  # reason of a stop without any StopCommand

Cause = Literal["collision", "fault", "guard", "none"]


def reason_name(stop: Stop) -> str:
    """As the wire names it, or SILENCE."""
    return SILENCE if stop.reason == 0 else Reason(stop.reason).name


def _between_ms(begin_s: float, end_s: float) -> float:
    return round((end_s - begin_s) * 1000, 3)


@dataclass(frozen=True)
class Collision:
    """One strike.

    verdict        "detected": motion was stopped while it was in progress, by the index or because the blow drove a
                   sensor out of its range
    why            of "not tested"
    contact_s      first touch; None if nothing was touched
    stop           the one that detected it
    """

    link: int
    part: str
    verdict: Literal["detected", "missed", "not tested"]
    why: str | None = None
    contact_s: float | None = None
    peak_force_n: float = 0.0
    stop: Stop | None = None

    @property
    def latency_ms(self) -> float | None:
        """From the first touch to the stop."""
        return None if self.stop is None or self.contact_s is None else _between_ms(self.contact_s, self.stop.time_s)


@dataclass(frozen=True)
class FaultEffect:
    """One sensor fault, and its effect on the permission. `end_s` is None if it lasts to the end of the run."""

    fault: SensorFault
    end_s: float | None
    verdict: Literal["stopped", "no stop", "not tested"]
    why: str | None = None
    stop: Stop | None = None

    @property
    def latency_ms(self) -> float | None:
        """From its begin to the stop."""
        return None if self.stop is None else _between_ms(self.fault.start_s, self.stop.time_s)


@dataclass(frozen=True)
class Loss:
    """A loss of permission.

    cause               a collision, a sensor fault of the scenario, a guard that was given up (the last stop then,
                        stated by the run's end), or none: a false stop
    permitted_again_s   None if the permission did not return
    """

    stop: Stop
    cause: Cause
    permitted_again_s: float | None


@dataclass(frozen=True)
class Peaks:
    """The free peaks of r and index by joint."""

    index_nm: NDArray[np.float64]
    residual_nm: NDArray[np.float64]

    @property
    def largest_index_nm(self) -> float:
        """Over all joints."""
        return float(self.index_nm.max(initial=0.0))

    @property
    def largest_residual_nm(self) -> float:
        """Over all joints."""
        return float(self.residual_nm.max(initial=0.0))


@dataclass(frozen=True)
class PhaseResult:
    """One phase: its free peaks, and the speed of the tip while no collision was in progress."""

    name: str
    task: str
    payload_kg: float
    peaks: Peaks
    peak_tip_speed_m_s: float


@dataclass(frozen=True)
class ResidualAlone:
    """How the same threshold on r instead of the index would have acted while no collision was in progress."""

    false_stops: int
    first_s: float | None
    share_of_free_time: float


@dataclass(frozen=True)
class Installation:
    """What was run. `guard` is None for the guard of this process, `differences` are those of an external one."""

    scenario: str
    robot: str
    assumed: tuple[str, ...]
    rate_hz: float
    format: str
    seed: int
    guard: GuardIdentity | None
    differences: tuple[str, ...]
    hashes: dict[str, str]


@dataclass(frozen=True)
class Frames:
    """Every frame of the bus: how many, and the SHA-256 of identifiers and data."""

    count: int
    sha256: str


@dataclass(frozen=True)
class Judgement:
    """A run, judged.

    why           one line for each failure, then one for each event that was not tested
    ended         why the run was given up, if it was
    threshold_nm  the distinct ones of the tasks that were in force
    permission    begin and end of each span; the end is None if it lasted to the end of the run
    experiment    name of the experiment, if it was one
    real_time     how well the pace was kept, if there was one
    """

    verdict: Literal["passed", "failed", "incomplete"]
    why: tuple[str, ...]
    finished: bool
    ended: str | None
    collisions: tuple[Collision, ...]
    faults: tuple[FaultEffect, ...]
    losses: tuple[Loss, ...]
    peaks: Peaks
    threshold_nm: tuple[float, ...]
    residual_alone: ResidualAlone
    phases: tuple[PhaseResult, ...]
    permission: tuple[tuple[float, float | None], ...]
    settle_s: float
    cycles: int
    installation: Installation
    counters: dict[str, int | None] | dict[str, int]
    experiment: str | None = None
    frames: Frames | None = None
    real_time: Kept | None = None

    @property
    def passed(self) -> bool:
        """Nothing failed, and everything was tested."""
        return not self.why

    @property
    def name(self) -> str:
        """Of the experiment or the scenario's file."""
        return self.experiment or self.installation.scenario

    @property
    def false_stops(self) -> int:
        """Losses of the permission without a cause."""
        return sum(loss.cause == "none" for loss in self.losses)
