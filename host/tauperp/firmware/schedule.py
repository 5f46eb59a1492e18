"""When a guard ticks: firmware/schedule, the same state machine as on the boards and in the Linux process."""

import can

from tauperp.firmware.guard import Guard, Verdict


class Schedule:
    """Drives one guard by the caller's clock (microseconds, monotonic), in real time or in lockstep with the bus.

    Each method returns the verdicts of the ticks that became due, in order. The caller sends their frames.
    """

    def __init__(self, guard: Guard, *, in_lockstep: bool, now_us: int) -> None:
        self._guard = guard
        self._lib = guard.library.lib
        self._schedule = guard.library.new("schedule_t *")
        self._lib.schedule_init(self._schedule, guard.config, in_lockstep, now_us)

    @property
    def in_lockstep(self) -> bool:
        return bool(self._schedule.in_lockstep)

    @property
    def due_us(self) -> int:
        """Time of the next call of `look` with an effect, on the caller's clock."""
        return int(self._schedule.due_us)

    def receive(self, frame: can.Message, now_us: int) -> list[Verdict]:
        """Process one frame of another node. In lockstep, ticks that become due are made before it."""
        if frame.is_error_frame:
            return []
        verdicts = []
        self._lib.schedule_hear(self._schedule, self._guard.frame_of(frame), now_us)
        while self._lib.schedule_owes_tick(self._schedule):
            verdicts.append(self.tick(now_us))
        self._guard.receive(frame, self._time_us(now_us))
        if self._lib.schedule_complete(self._schedule, self._guard.cycle_complete()):
            verdicts.append(self.tick(now_us))
        return verdicts

    def look(self, now_us: int) -> list[Verdict]:
        """Time has passed."""
        return [self.tick(now_us)] if self._lib.schedule_is_due(self._schedule, now_us) else []

    def tick(self, now_us: int) -> Verdict:
        """A tick now, due or not."""
        verdict = self._guard.tick(self._time_us(now_us))
        self._lib.schedule_ticked(self._schedule, now_us, verdict.fresh)
        return verdict

    def _time_us(self, now_us: int) -> int:
        return int(self._lib.schedule_time(self._schedule, now_us))
