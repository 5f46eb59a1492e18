"""When the cycles of a run start, and how long the robot waits for the guard's answer in each.

Pace            simulated time: a guard in this process has answered before the robot checks
Patient         lockstep with an external guard: each cycle waits for the answer to that cycle
RealTime        by the monotonic clock, without waiting: an answer that does not arrive in time is silence
"""

import gc
import math
import time
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np

from tauperp.robot_side import Answer

START_CYCLES = 4  # cycles tried before the guard counts as missing; one in lockstep checks a silent bus after 0.25 s
SPIN_S = 0.0005  # of the wait for a cycle is not slept, as a sleep ends late


@dataclass(frozen=True)
class Patience:
    """Seconds of real time without an answer after which the guard counts as missing: before its first answer, and
    later."""

    start_s: float = 2.0
    answer_s: float = 0.5


@dataclass(frozen=True)
class Kept:
    """How well a pace in real time was kept."""

    period_us: int
    cycles: int
    late_cycles: int  # by more than half a period
    skipped_periods: int
    permission_not_in_time: int
    p99_lateness_s: float
    largest_lateness_s: float
    times_slower_than_real: float | None  # None for a single cycle


class Pace:
    """Waits for no answer. A context manager around the run."""

    real_time = False
    answered = False  # the guard has, at least once
    patience: Patience | None = None  # None: silence is a stop like any other, and the run continues

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        pass

    def begin(self) -> None:
        """Returns when the next cycle starts."""

    @property
    def answer_timeout_s(self) -> float:
        """How long to wait for the answer to the cycle that was just sent; 0: check what has arrived."""
        return 0.0

    def note(self, answer: Answer) -> bool:
        """Record the result of the wait. True if the guard is given up."""
        self.answered |= answer is Answer.GOOD
        return False

    @property
    def kept(self) -> Kept | None:
        """How well the pace was kept; None where this is always perfect."""
        return None


class Patient(Pace):
    def __init__(self, patience: Patience) -> None:
        self.patience = patience
        self._patience = patience
        self._begun_s = math.nan

    def __enter__(self) -> Self:
        self._begun_s = time.monotonic()
        return self

    @property
    def answer_timeout_s(self) -> float:
        return self._patience.answer_s if self.answered else self._patience.start_s / START_CYCLES

    def note(self, answer: Answer) -> bool:
        if answer is Answer.GOOD:
            self.answered = True
            return False
        return self.answered or time.monotonic() >= self._begun_s + self._patience.start_s


class RealTime(Pace):
    """Absolute times, so that errors do not add up: sleep, then spin for the rest.

    A cycle is late if it begins more than half a period after it was due. Whole periods that are missed are skipped:
    the simulation is then slower than real time, and the report states by how much. A permission is in time until the
    middle of the cycle: the rest is for the motion of the arm. `patience` None if the guard is in this process.
    """

    real_time = True

    def __init__(self, period_s: float, patience: Patience | None) -> None:
        self.patience = patience
        self._period = period_s
        self._due_s = self._answered_s = self._begun_s = self._first_s = math.nan
        self._lateness_s: list[float] = []
        self._skipped = self._missing = 0
        self._collecting = False

    def __enter__(self) -> Self:
        self._collecting = gc.isenabled()
        gc.collect()
        gc.disable()  # it costs milliseconds whenever it likes
        self._due_s = self._answered_s = self._first_s = time.monotonic()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        if self._collecting:
            gc.enable()

    def begin(self) -> None:
        wait_s = self._due_s - SPIN_S - time.monotonic()
        if wait_s > 0:
            time.sleep(wait_s)
        while (now_s := time.monotonic()) < self._due_s:
            pass
        late_s = now_s - self._due_s
        self._lateness_s.append(late_s)
        missed = int(late_s / self._period)
        self._skipped += missed
        self._begun_s = now_s
        self._due_s += (missed + 1) * self._period

    @property
    def answer_timeout_s(self) -> float:
        """Never zero, because zero means a check without waiting."""
        return max(1e-6, self._begun_s + self._period / 2 - time.monotonic())

    def note(self, answer: Answer) -> bool:
        now_s = time.monotonic()
        if answer is Answer.GOOD:
            self.answered, self._answered_s = True, now_s
            return False
        self._missing += 1
        if self.patience is None:
            return False
        return now_s >= self._answered_s + (self.patience.answer_s if self.answered else self.patience.start_s)

    @property
    def kept(self) -> Kept:
        late_s = np.array(self._lateness_s)
        cycles = len(late_s)
        took_s = self._begun_s - self._first_s
        return Kept(
            period_us=round(self._period * 1e6),
            cycles=cycles,
            late_cycles=int((late_s > self._period / 2).sum()),
            skipped_periods=self._skipped,
            permission_not_in_time=self._missing,
            p99_lateness_s=float(np.percentile(late_s, 99)),
            largest_lateness_s=float(late_s.max()),
            times_slower_than_real=took_s / ((cycles - 1) * self._period) if cycles > 1 else None,
        )
