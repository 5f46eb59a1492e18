"""The library's guard on a virtual bus, in a thread of its own: an external guard for tests."""

import threading
import time

import can
from can.interfaces.virtual import VirtualBus

from tauperp.config import Configuration
from tauperp.firmware import Guard, Variant
from tauperp.wire import Wire

CHANNEL = "test run"
PERIOD_S, PERIOD_US = 0.002, 2000
SYNC, STOP_COMMAND = 0x020, 0x010


class GuardThread(threading.Thread):
    """The library's guard in lockstep on a virtual bus, as an external guard.

    `mute_from` and `restart_at` are cycles; `delays_s` is the delay before the answer to a cycle. With `alone` the
    guard receives no StopCommand of other guards.
    """

    def __init__(
        self,
        configuration: Configuration,
        *,
        mute_from: int | None = None,
        restart_at: int | None = None,
        delays_s: dict[int, float] | None = None,
        alone: bool = False,
        variant: Variant = Variant.LOCKSTEP,
    ) -> None:
        super().__init__(daemon=True)
        self.bus = virtual()
        self._block = configuration.block()
        self._variant = variant
        self._guard = Guard(self._block, variant=variant)
        self._mute_from, self._restart_at = mute_from, restart_at
        self._delays_s = delays_s or {}
        self._alone = alone
        self._ended = threading.Event()
        self.permits = 0

    def __enter__(self) -> "GuardThread":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self.join()
        self.bus.shutdown()

    def run(self) -> None:
        guard, cycle, first = self._guard, -1, 0
        wire = Wire.read()
        while not self._ended.is_set():
            frame = self.bus.recv(timeout=0.1)
            if frame is not None and frame.arbitration_id == SYNC:
                cycle = int(wire.message("Sync").decode(frame.data)["Cycle"])
                if cycle == self._restart_at:
                    guard, first = Guard(self._block, variant=self._variant), cycle
            if frame is not None and not (self._alone and frame.arbitration_id == STOP_COMMAND):
                guard.receive(frame, cycle * PERIOD_US)
            # The first frame of each sender is only a reference, so the first cycle stays incomplete: silence ends it.
            if guard.cycle_complete() or (frame is None and cycle == first):
                first = -2
                time.sleep(self._delays_s.get(cycle, 0.0))
                verdict = guard.tick(cycle * PERIOD_US)
                self.permits += verdict.permitted
                for answer in verdict.frames:
                    if self._mute_from is None or cycle < self._mute_from:
                        self.bus.send(answer)


def virtual() -> can.BusABC:
    return VirtualBus(channel=CHANNEL)
