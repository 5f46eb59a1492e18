"""Faults in the stm32g4 image while it runs: one bit of a register, of the stack, of its data or of its flash flips at
a random instruction of a cycle.

The emulated board (tools/g4) receives a recorded run once without a fault. Each fault starts from the state of the
board at the beginning of its cycle. It ends when the live memory equals that of the reference, when no further
permission is possible, or after HORIZON cycles. Outcomes have the classes of faults.c; the judge is the check of
tauperp.robot_side.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import can
from g4.board import FLASH, FLOATS, RAM, RAM_BYTES, REGISTERS, Board, Snapshot, segments
from g4.fdcan import Frame
from g4.peer import STOP_COMMAND, frame_of, message_of
from record import Cycle
from unicorn import arm_const as arm

from tauperp.config.block import block_dtype
from tauperp.robot_side import StopCheck
from tauperp.wire import Wire
from tauperp.wire_values import REASON_CLASS, ReasonClass

PLACES = ("register", "float register", "stack", "data", "code", "block")
HORIZON = 60
BEFORE, AFTER = 40, 60  # cycles around a stop
CYCLE_INSTRUCTIONS = {1: 24_000, 2: 110_000}  # of a cycle, by channels, about
IDLE_LIMIT = 1_000_000  # instructions after which a core that is not idle counts as hung
NONE, DETECTED, NEEDLESS, LATE, WRONG = range(5)
OUTCOMES = ("none", "detected", "needless", "late", "wrong")


@dataclass
class Reference:
    """The run without a fault: permission, live memory and the StopCommand of each cycle."""

    permits: list[bool] = field(default_factory=list)
    memory: list[int] = field(default_factory=list)
    answers: list[list[Frame]] = field(default_factory=list)
    instructions: int = 0


class Injector:
    """One image with one recorded run."""

    def __init__(self, image: Path, channels: int, reaction: int, cycles: list[Cycle]) -> None:
        """reaction: worst-case reaction time of the block, in cycles."""
        self._board = Board(image)
        self._cycles = [(now_us, [frame_of(message) for message in messages]) for now_us, messages in cycles]
        self._numbers = [_sync_cycle(messages) for _, messages in cycles]
        self._reaction = reaction
        self._places = places(image, channels)
        self._instructions = CYCLE_INSTRUCTIONS[channels]
        self._wire = Wire.read()
        self.reference = Reference()

    def run_reference(self, wanted: list[int]) -> Iterator[tuple[int, Snapshot]]:
        """Runs the complete recording once. Returns the board's state at the beginning of each wanted cycle."""
        board, reference = self._board, self.reference
        check = StopCheck(self._wire)
        board.run()
        for number, (now_us, frames) in enumerate(self._cycles):
            if number in wanted:
                yield number, board.snapshot()
            answers = self._cycle(number, now_us, frames)
            reference.answers.append(answers)
            reference.permits.append(self._permits(check, number, answers))
            reference.memory.append(self._live())

    def inject(self, start: int, snapshot: Snapshot, random: Random) -> tuple[str, int, int, str]:
        """Place, outcome, cycles until the reaction, and the flipped bit."""
        board, reference = self._board, self.reference
        board.restore(snapshot)
        check = StopCheck(self._wire)
        for frame in reference.answers[start - 1] if start else ():
            check.forget(message_of(frame))
        place = random.choice(PLACES)
        worst, after, undo = NONE, 0, None
        what = ""
        for number in range(start, min(start + HORIZON, len(self._cycles))):
            now_us, frames = self._cycles[number]
            if number == start:
                board.advance(now_us)
                for frame in frames:
                    board.receive(frame)
                board.fdcan.looks = 0
                board.step(random.randrange(self._instructions))
                what, undo = self._flip(place, random)
                answers = board.run(IDLE_LIMIT)
            else:
                answers = self._cycle(number, now_us, frames)
            permits = self._permits(check, number, answers)
            outcome = NONE
            if permits and not reference.permits[number]:
                outcome = WRONG if self._long_stopped(number) else LATE
            elif not permits and reference.permits[number]:
                outcome = NEEDLESS if _is_ordinary_stop(answers) else DETECTED
            elif board.halted or board.resets:
                outcome = DETECTED
            if outcome and (worst == NONE or outcome >= LATE):
                after = number - start
            worst = max(worst, outcome)
            if worst == WRONG or board.halted or board.resets:
                break
            if undo is None and self._live() == reference.memory[number]:
                break
        if undo is not None:
            board.load()
            board.core.ctl_flush_tb()
        board.resets = 0
        return place, worst, after, what

    def _cycle(self, number: int, now_us: int, frames: list[Frame]) -> list[Frame]:
        self._board.advance(now_us)
        for frame in frames:
            self._board.receive(frame)
        return self._board.run(IDLE_LIMIT)

    def _permits(self, check: StopCheck, number: int, answers: list[Frame]) -> bool:
        check.begin(self._numbers[number])
        for frame in answers:
            if frame.id == STOP_COMMAND:
                check.hear(message_of(frame))
        return check.permit().allowed

    def _long_stopped(self, number: int) -> bool:
        return not any(self.reference.permits[max(0, number - self._reaction) : number + 1])

    def _live(self) -> int:
        """The data, the used part of the stack, and the registers that an idle loop preserves."""
        core = self._board.core
        stack = core.reg_read(arm.UC_ARM_REG_SP)
        if not RAM <= stack < RAM + RAM_BYTES:
            return -1
        memory = core.mem_read(stack, RAM + RAM_BYTES - stack)
        kept = [core.reg_read(register) for register in REGISTERS[4:12]]
        return zlib.crc32(memory, zlib.crc32(repr((stack, kept)).encode()))

    def _flip(self, place: str, random: Random) -> tuple[str, bool | None]:
        core, bit = self._board.core, 1 << random.randrange(32)
        if place in ("register", "float register"):
            register = random.choice(REGISTERS if place == "register" else FLOATS)
            value = core.reg_read(register) ^ bit
            core.reg_write(register, value | (1 if register == arm.UC_ARM_REG_PC else 0))
            return f"{place} {register} bit {bit:#x}", None
        begin, end = self._places[place]
        if place == "stack":
            begin = max(begin, core.reg_read(arm.UC_ARM_REG_SP) & ~3)
        address = random.randrange(begin, end, 4) if begin < end else self._places[place][0]
        word = int.from_bytes(core.mem_read(address, 4), "little") ^ bit
        core.mem_write(address, word.to_bytes(4, "little"))
        in_flash = address < FLASH + 0x80000
        if in_flash:
            core.ctl_flush_tb()
        return f"{place} {address:#010x} bit {bit:#x}", True if in_flash else None


def places(image: Path, channels: int) -> dict[str, tuple[int, int]]:
    """Addresses of each place in memory (stm32g4.ld): the stack is the first 8 KiB of the RAM."""
    elf = image.read_bytes()
    flash = max((address + len(data) for address, data in segments(elf) if address < RAM), default=FLASH)
    block = FLASH + b"".join(data for address, data in segments(elf) if address == FLASH).index(b"TERP")
    code = block + channels * block_dtype("float32").itemsize
    (table,) = struct.unpack_from("<I", elf, 28)
    size, count = struct.unpack_from("<2H", elf, 42)
    headers = [struct.unpack_from("<6I", elf, table + size * number) for number in range(count)]
    data = max(address + length for kind, _, address, _, _, length in headers if kind == 1 and address >= RAM)
    top = RAM + 8192
    return {"stack": (RAM, top), "data": (top, data), "block": (block, code), "code": (code, flash & ~3)}


def _is_ordinary_stop(answers: list[Frame]) -> bool:
    """A consistent StopCommand with a reason that is not a fault of the guard."""
    stops = [frame.data for frame in answers if frame.id == STOP_COMMAND]
    kinds = [REASON_CLASS.get(data[4], ReasonClass.UNKNOWN) for data in stops if data[2] == 0xF0]
    return bool(kinds) and all(kind not in (ReasonClass.FAULT, ReasonClass.UNKNOWN) for kind in kinds)


def _sync_cycle(messages: list[can.Message]) -> int:
    return next((int.from_bytes(m.data[2:4], "little") for m in messages if m.arbitration_id == 0x020), 0)
