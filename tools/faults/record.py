"""A run of an experiment as a file for tools/faults/faults.c: the block, then each cycle with its time and frames."""

from __future__ import annotations

import contextlib
import struct
from dataclasses import dataclass

import can

from tauperp.config import Numeric
from tauperp.firmware import Guard, Start, Variant, Verdict
from tauperp.run.lockstep import Lockstep
from tauperp.run.scenario import load_scenario, shipped
from tauperp.run.virtual import LockstepBus

Cycle = tuple[int, list[can.Message]]
NUMERICS: tuple[Numeric, ...] = ("float32", "q9.22")  # of the channels


@dataclass(frozen=True)
class Recording:
    """A run without a fault."""

    blocks: tuple[bytes, ...]  # of each channel: float32, Q9.22
    cycles: list[Cycle]  # time, and the robot's frames
    stops: list[int]  # cycles in which the permission ends


class _Listener:
    """The library's guard, which keeps all frames that the robot sends."""

    remote = False
    verdict: Verdict | None = None

    def __init__(self, bus: can.BusABC, guard: Guard, limit: int | None) -> None:
        self._bus, self._guard, self._limit = bus, guard, limit
        self.cycles: list[Cycle] = []
        self.stops: list[int] = []

    def turn(self, now_us: int) -> None:
        heard = []
        while (message := self._bus.recv(timeout=0.0)) is not None:
            heard.append(message)
            self._guard.receive(message, now_us)
        permitted = self.verdict is not None and self.verdict.permitted
        self.verdict = self._guard.tick(now_us)
        if permitted and not self.verdict.permitted:
            self.stops.append(len(self.cycles))
        for frame in self.verdict.frames:
            self._bus.send(frame)
        self.cycles.append((now_us, heard))
        if len(self.cycles) == self._limit:
            raise _Enough


class _Enough(Exception):
    """The limit of cycles was reached."""


def record(experiment: str, channels: int = 1, limit: int | None = None) -> Recording:
    """One of the experiments, with the library's guard. limit: cycles after which it ends."""
    scenario = load_scenario(shipped(experiment))
    blocks = tuple(scenario.configuration.block(numeric) for numeric in NUMERICS[:channels])
    with LockstepBus("faults") as robot, LockstepBus("faults") as bus:
        second = blocks[1] if channels == 2 else None
        guard = Guard(blocks[0], start=Start.POWER_ON, variant=Variant.PRODUCT, second=second)
        listener = _Listener(bus, guard, limit)
        with contextlib.suppress(_Enough):
            Lockstep(scenario, robot, listener).run()
    return Recording(blocks, listener.cycles, listener.stops)


def as_file(recording: Recording) -> bytes:
    """Little-endian, as read_recording of reference.c takes it."""
    blocks, cycles = recording.blocks, recording.cycles
    frames = sum(len(messages) for _, messages in cycles)
    parts = [struct.pack("<4I", len(blocks), len(blocks[0]), len(cycles), frames), *blocks]
    for now_us, messages in cycles:
        parts.append(struct.pack("<QI", now_us, len(messages)))
        for message in messages:
            flags = message.is_fd | message.bitrate_switch << 1
            data = bytes(message.data[:8]).ljust(8, b"\0")
            parts.append(struct.pack("<IBBH8s", message.arbitration_id, flags, message.dlc, 0, data))
    return b"".join(parts)
