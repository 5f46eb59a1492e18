"""The compiled firmware as a node of a python-can bus: what a board's main loop does, in this process."""

import time
from typing import Protocol

import can

from tauperp.bus import OwnFrames
from tauperp.firmware import Guard, Verdict


class GuardPeer(Protocol):
    """The guard on the bus: in this process, or external."""

    remote: bool  # it runs on its own, and only its frames show its state
    verdict: Verdict | None  # of the last tick; None for an external guard

    def turn(self, now_us: int) -> None:
        """Receive, tick and answer for the cycle that was just sent."""


class GuardNode:
    """The library's guard, ticked once a cycle in simulated time.

    patience_s      of real time, wait for the frames of a cycle on a bus with delays; 0: the frames have arrived
    """

    remote = False

    def __init__(self, bus: can.BusABC, guard: Guard, patience_s: float = 0.0) -> None:
        self.guard = guard
        self.patience_s = patience_s
        self.verdict: Verdict | None = None
        self._bus = bus
        self._own = OwnFrames(bus)

    def turn(self, now_us: int) -> None:
        """Receive all frames of the bus, make one tick, and send its frames."""
        end_s = time.monotonic() + self.patience_s if self.patience_s else 0.0
        while (frame := self._bus.recv(timeout=self._wait_s(end_s))) is not None:
            if not self._own.has(frame):
                self.guard.receive(frame, now_us)
        self.verdict = self.guard.tick(now_us)
        for frame in self.verdict.frames:
            self._bus.send(frame)
            self._own.note(frame)

    def _wait_s(self, end_s: float) -> float:
        if not self.patience_s or self.guard.cycle_complete():
            return 0.0
        return max(0.0, end_s - time.monotonic())


class RemoteGuard:
    """A guard somewhere else on the bus."""

    remote = True
    verdict: Verdict | None = None

    def turn(self, now_us: int) -> None:
        """Nothing to do: the external guard receives the frames itself."""
