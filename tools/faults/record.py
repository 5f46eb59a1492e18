"""A run of an experiment as a file for tools/faults/faults.c: the block, then each cycle with its time and frames."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import can

from tauperp.config import Numeric
from tauperp.firmware import Guard, Start, Variant, Verdict
from tauperp.run.lockstep import Lockstep
from tauperp.run.scenario import load_scenario, shipped
from tauperp.run.virtual import LockstepBus

Cycle = tuple[int, list[can.Message]]


@dataclass(frozen=True)
class Recording:
    """A run without a fault."""

    block: bytes
    cycles: list[Cycle]  # time, and the robot's frames
    stops: list[int]  # cycles in which the permission ends


class _Listener:
    """The library's guard, which keeps all frames that the robot sends."""

    remote = False
    verdict: Verdict | None = None

    def __init__(self, bus: can.BusABC, guard: Guard) -> None:
        self._bus, self._guard = bus, guard
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


def record(experiment: str, numeric: Numeric = "float32") -> Recording:
    """One of the experiments, with the library's guard."""
    scenario = load_scenario(shipped(experiment))
    block = scenario.configuration.block(numeric)
    with LockstepBus("faults") as robot, LockstepBus("faults") as bus:
        listener = _Listener(bus, Guard(block, start=Start.POWER_ON, variant=Variant.PRODUCT))
        Lockstep(scenario, robot, listener).run()
    return Recording(block, listener.cycles, listener.stops)


def as_file(recording: Recording) -> bytes:
    """Little-endian, as reference.c takes it."""
    block, cycles = recording.block, recording.cycles
    frames = sum(len(messages) for _, messages in cycles)
    parts = [struct.pack("<3I", len(block), len(cycles), frames), block]
    for now_us, messages in cycles:
        parts.append(struct.pack("<QI", now_us, len(messages)))
        for message in messages:
            flags = message.is_fd | message.bitrate_switch << 1
            data = bytes(message.data[:8]).ljust(8, b"\0")
            parts.append(struct.pack("<IBBH8s", message.arbitration_id, flags, message.dlc, 0, data))
    return b"".join(parts)
