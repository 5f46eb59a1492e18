"""python-can's virtual bus for lockstep: the same channels, without the copy that it makes of every frame and the locks
of its queues, which together cost a third of a run.

The copies are not needed here, because no node changes a frame that it has sent or received. Time stamps stay as the
sender set them, which is simulated time. Ordinary virtual buses may share the channel.
"""

from collections.abc import Hashable
from queue import Empty, SimpleQueue

import can
from can.interfaces.virtual import VirtualBus, channels_lock


class LockstepBus(VirtualBus):
    """One node's connection to the virtual channel `channel`; close it with `shutdown` or as a context manager."""

    def __init__(self, channel: Hashable) -> None:
        super().__init__(channel=channel, preserve_timestamps=True)  # type: ignore[arg-type]
        quick: SimpleQueue[can.Message] = SimpleQueue()
        with channels_lock:
            self.channel[self.channel.index(self.queue)] = quick  # type: ignore[call-overload]
            self.queue = quick  # type: ignore[assignment]

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """To everybody else on the channel. The queues have no limit, so there is nothing to wait for."""
        self._check_if_open()
        for queue in self.channel:
            if queue is not self.queue:
                queue.put(msg)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """As every bus, with a faster path for a check without waiting."""
        if timeout != 0.0 or self._filters:
            return super().recv(timeout)
        self._check_if_open()
        try:
            return self.queue.get_nowait()
        except Empty:
            return None
