"""The emulated board and the library's guard: the same frames at the same times must give the same answers."""

from __future__ import annotations

from collections.abc import Sequence

import can

from g4.board import Board
from g4.fdcan import Frame
from tauperp.firmware import Guard, Schedule, Start, Variant, Verdict

STOP_COMMAND = 0x010
_FROM_GUARD = range(0x200, 0x210)


def frame_of(message: can.Message) -> Frame:
    return Frame(
        message.arbitration_id,
        bytes(message.data[:8]),
        message.is_fd,
        message.bitrate_switch,
        message.is_extended_id,
        message.is_remote_frame,
    )


def message_of(frame: Frame) -> can.Message:
    return can.Message(
        arbitration_id=frame.id, data=frame.data, is_extended_id=False, is_fd=frame.fd, bitrate_switch=frame.brs
    )


class Twin:
    """The library's guard, driven as the board drives its own (firmware/boards/common/loop.c), in zero time."""

    def __init__(self, block: bytes, *, variant: Variant = Variant.PRODUCT, start: Start = Start.POWER_ON) -> None:
        self.guard = Guard(block, start=start, variant=variant, with_events=variant is not Variant.LOCKSTEP)
        self._schedule = Schedule(self.guard, in_lockstep=variant is Variant.LOCKSTEP, now_us=0)
        self.verdict: Verdict | None = None
        self.completed = False  # the last frames completed a cycle, and it had its tick

    def receive(self, messages: Sequence[can.Message], now_us: int) -> list[Frame]:
        """Receives these frames at this time; returns the answers. An idle board waits after it has read the bus and
        before it reads the clock, so the clock comes first."""
        answers: list[Frame] = []
        self.completed = False
        for message in (None, *messages):
            verdicts = [] if message is None else self._schedule.receive(message, now_us)
            self.completed = self.completed or bool(verdicts)
            for verdict in (*verdicts, *self._schedule.look(now_us)):
                self.verdict = verdict
                answers += [frame_of(frame) for frame in verdict.frames]
        return answers


class Enough(Exception):
    """The limit of cycles was reached."""


class EmulatedGuard:
    """The guard of a simulated robot (GuardPeer): the board's answers move the robot.

    patience_s     wait for the frames of a cycle on a bus with delays; 0: the frames have arrived
    limit          cycles, after which it raises Enough
    Raises AssertionError when an answer differs from the library's.
    """

    remote = False

    def __init__(
        self, bus: can.BusABC, board: Board, twin: Twin, patience_s: float = 0.0, limit: int | None = None
    ) -> None:
        self.board, self.twin = board, twin
        self.verdict: Verdict | None = None
        self.cycles = 0
        self.stop_commands = 0
        self._bus = bus
        self._patience_s = patience_s
        self._limit = limit
        self._compare(board.run(), twin.receive([], 0), 0)  # the first tick is due at once

    def turn(self, now_us: int) -> None:
        self.board.advance(now_us)
        answered = False
        while not answered and (message := self._bus.recv(timeout=self._patience_s)) is not None:
            if message.arbitration_id == STOP_COMMAND or message.arbitration_id in _FROM_GUARD:
                continue  # its own frames, where the bus returns them
            self.board.receive(frame_of(message))
            heard = self.board.run()
            self._compare(heard, self.twin.receive([message], now_us), now_us)
            answered = bool(self._patience_s) and self.twin.completed
        self.verdict = self.twin.verdict
        self.cycles += 1
        if self.cycles == self._limit:
            raise Enough

    def _compare(self, heard: list[Frame], expected: list[Frame], now_us: int) -> None:
        assert heard == expected, f"at {now_us} us: {heard} instead of {expected}; {self.board.lines[-3:]}"
        self.stop_commands += sum(frame.id == STOP_COMMAND for frame in heard)
        for frame in heard:
            self._bus.send(message_of(frame))
