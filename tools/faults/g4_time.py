"""Faults of time in the stm32g4 image: its timer is fast, slow or stopped or jumps, or its core stands still, or is
late. The watchdog has its own oscillator and keeps true time.
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

TIME = "time"
WAYS = ("fast", "slow", "stopped", "back", "forward", "missed", "late")


@dataclass(frozen=True)
class Disturbance:
    """From cycle `start` at `begun_us` on: the timer's rate and a step in its count; or for `cycles` cycles the core
    stands still and loses its frames, or runs `late` microseconds after them."""

    way: str
    start: int
    begun_us: int
    factor: float = 1.0
    step_us: int = 0
    cycles: int = 0
    delay_us: int = 0

    def timer_us(self, number: int, now_us: int) -> int:
        true_us = self.late_us(number, now_us)
        return max(0, self.begun_us + int((true_us - self.begun_us) * self.factor) + self.step_us)

    def late_us(self, number: int, now_us: int) -> int:
        return now_us + (self.delay_us if number < self.start + self.cycles else 0)

    def stands(self, number: int) -> bool:
        return self.way == "missed" and number < self.start + self.cycles

    def __str__(self) -> str:
        return f"time {self.way} factor {self.factor} step {self.step_us} cycles {self.cycles} delay {self.delay_us}"


def disturbance(random: Random, start: int, begun_us: int, period_us: int) -> Disturbance:
    """The ranges of draw.c."""
    way, share = random.choice(WAYS), random.random()
    most_us = int(share * 100 * period_us) + 1
    if way == "fast":
        return Disturbance(way, start, begun_us, factor=1.02 + 3.0 * share * share)
    if way == "slow":
        return Disturbance(way, start, begun_us, factor=0.98 * share + 0.001)
    if way == "stopped":
        return Disturbance(way, start, begun_us, factor=0.0)
    if way == "missed":
        return Disturbance(way, start, begun_us, cycles=random.randint(1, 40))
    if way == "late":
        return Disturbance(way, start, begun_us, cycles=random.randint(1, 3), delay_us=int(share * period_us))
    return Disturbance(way, start, begun_us, step_us=-most_us if way == "back" else most_us)
