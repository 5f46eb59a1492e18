"""Faults in the stm32g4 image while it runs: one bit of a register, of the stack, of its data or of its flash flips at
a random instruction of a cycle; or its clock or its ticks are disturbed from a cycle on.

The emulated board (tools/g4) receives a recorded run once without a fault. Each fault starts from the state of the
board at the beginning of its cycle. It ends when the live memory equals that of the reference; when the flipped bit
alone differs for DORMANT cycles and the reference's permission does not change any more; when no further permission is
possible; or after HORIZON cycles. Outcomes have the classes of faults.c; the judge is the check of
tauperp.robot_side.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import can
from g4.board import FLASH, FLOATS, RAM, REGISTERS, Board, Snapshot, segments
from g4.fdcan import Frame
from g4.peer import STOP_COMMAND, frame_of, message_of
from g4_time import TIME, Disturbance, disturbance
from record import Cycle
from unicorn import arm_const as arm

from tauperp.config.block import block_dtype
from tauperp.robot_side import StopCheck
from tauperp.wire import Wire
from tauperp.wire_values import REASON_CLASS, ReasonClass

PLACES = ("register", "float register", "stack", "data", "code", "block", TIME)
HORIZON, DORMANT, FINAL = 60, 10, 10
BEFORE, AFTER = 40, 60  # cycles around a stop
CYCLE_INSTRUCTIONS = {1: 18_000, 2: 84_000}  # of a cycle at worst, by channels, about (tools/bench/baseline.json)
REASON_BYTE = 4  # of a StopCommand
IDLE_LIMIT = 1_000_000  # instructions after which a core that is not idle counts as hung
KEPT = REGISTERS[4:12]  # registers that an idle loop preserves
NONE, DETECTED, NEEDLESS, LATE, WRONG = range(5)
OUTCOMES = ("none", "detected", "needless", "late", "wrong")


@dataclass(frozen=True)
class Flip:
    """One flipped bit. address: in memory, or None; register: its number in Unicorn."""

    place: str
    bit: int
    address: int | None = None
    register: int = 0

    @property
    def in_flash(self) -> bool:
        return self.address is not None and self.address < RAM

    def __str__(self) -> str:
        where = self.register if self.address is None else f"{self.address:#010x}"
        return f"{self.place} {where} bit {self.bit:#x}"


@dataclass
class Reference:
    """The run without a fault: permission, live memory and the answers of each cycle, and for how many cycles more the
    permission stays as it is."""

    permits: list[bool] = field(default_factory=list)
    memory: list[int] = field(default_factory=list)
    answers: list[list[Frame]] = field(default_factory=list)
    quiet: list[int] = field(default_factory=list)

    def count_quiet(self) -> None:
        self.quiet = [HORIZON] * len(self.permits)
        for at in range(len(self.permits) - 2, -1, -1):
            self.quiet[at] = self.quiet[at + 1] + 1 if self.permits[at] == self.permits[at + 1] else 0


class Judge:
    """The robot's check of each answer. As long as they are the reference's, so is its verdict."""

    def __init__(self, wire: Wire, reference: Reference, numbers: list[int], start: int) -> None:
        self._wire, self._reference, self._numbers, self._start = wire, reference, numbers, start
        self._check: StopCheck | None = None

    def permits(self, at: int, answers: list[Frame]) -> bool:
        if self._check is None:
            if answers == self._reference.answers[at]:
                return self._reference.permits[at]
            self._check = StopCheck(self._wire)
            for frame in self._reference.answers[self._start - 1] if self._start else ():
                self._check.forget(message_of(frame))
            for cycle in range(self._start, at):
                hear(self._check, self._numbers[cycle], self._reference.answers[cycle])
        return hear(self._check, self._numbers[at], answers)


def hear(check: StopCheck, cycle: int, answers: list[Frame]) -> bool:
    check.begin(cycle)
    for frame in answers:
        if frame.id == STOP_COMMAND:
            check.hear(message_of(frame))
    return check.permit().allowed


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

    def run_reference(self, wanted: Collection[int]) -> Iterator[tuple[int, Snapshot]]:
        """Runs the complete recording once. Returns the board's state at the beginning of each wanted cycle."""
        board, reference = self._board, self.reference
        check = StopCheck(self._wire)
        board.run()
        for number in range(len(self._cycles)):
            if number in wanted:
                yield number, board.snapshot()
            answers = self._cycle(number)
            reference.answers.append(answers)
            reference.permits.append(hear(check, self._numbers[number], answers))
            reference.memory.append(self._live(None))
        reference.count_quiet()

    def inject(self, start: int, snapshot: Snapshot, random: Random) -> tuple[str, int, int, str]:
        """Place, outcome, cycles until the reaction, and the flipped bit or disturbance."""
        board, reference = self._board, self.reference
        board.restore(snapshot)
        judge = Judge(self._wire, reference, self._numbers, start)
        place = random.choice(PLACES)
        disturbed, flip = self._time_fault(start, random) if place == TIME else None, None
        end = min(start + HORIZON, len(self._cycles))
        worst, after, final = NONE, 0, 0
        for number in range(start, end):
            if place != TIME and number == start:
                flip, answers = self._flipped_cycle(number, place, random)
            else:
                answers = self._cycle(number, disturbed)
            outcome = self._outcome(number, judge.permits(number, answers), answers)
            if outcome and (worst == NONE or outcome >= LATE):
                after = number - start
            worst = max(worst, outcome)
            final = final + 1 if is_fault(answers) else 0
            if worst == WRONG or board.halted or board.resets or final == FINAL:
                break
            if disturbed is None and self._is_over(number, number - start, end, flip):
                break
        if flip is not None and flip.in_flash:
            board.restore(snapshot)  # Unicorn forgets translated code only while the core is in order
            self._write(flip)
        board.resets = 0
        return place, worst, after, str(disturbed or flip)

    def is_clean(self, start: int, snapshot: Snapshot) -> bool:
        """Whether a cycle without a fault still has the answer of the reference: nothing of a fault has remained."""
        self._board.restore(snapshot)
        return self._cycle(start) == self.reference.answers[start]

    def _outcome(self, at: int, permits: bool, answers: list[Frame]) -> int:
        if permits and not self.reference.permits[at]:
            return WRONG if self._long_stopped(at) else LATE
        if not permits and self.reference.permits[at]:
            return NEEDLESS if is_ordinary_stop(answers) else DETECTED
        return DETECTED if self._board.halted or self._board.resets else NONE

    def _is_over(self, at: int, since: int, end: int, flip: Flip | None) -> bool:
        """Nothing differs any more; or only the flipped bit, which nothing has used."""
        quiet = since >= DORMANT and at + self.reference.quiet[at] >= end
        if flip is not None and flip.in_flash:
            return quiet and self._live(None) == self.reference.memory[at]
        if self._live(None) == self.reference.memory[at]:
            return True
        return quiet and self._live(flip) == self.reference.memory[at]

    def _time_fault(self, start: int, random: Random) -> Disturbance:
        period_us = self._cycles[1][0] - self._cycles[0][0]
        return disturbance(random, start, self._cycles[start][0], period_us)

    def _cycle(self, number: int, disturbed: Disturbance | None = None) -> list[Frame]:
        now_us, frames = self._cycles[number]
        if disturbed is None:
            self._board.advance(now_us)
        else:
            self._board.advance(disturbed.late_us(number, now_us), disturbed.timer_us(number, now_us))
            if disturbed.stands(number):
                return []
        for frame in frames:
            self._board.receive(frame)
        return self._board.run(IDLE_LIMIT)

    def _flipped_cycle(self, number: int, place: str, random: Random) -> tuple[Flip, list[Frame]]:
        board = self._board
        now_us, frames = self._cycles[number]
        board.advance(now_us)
        for frame in frames:
            board.receive(frame)
        board.fdcan.looks = 0
        board.step(random.randrange(self._instructions))
        flip = self._choose(place, random)
        self._write(flip)
        return flip, board.run(IDLE_LIMIT)

    def _long_stopped(self, number: int) -> bool:
        return not any(self.reference.permits[max(0, number - self._reaction) : number + 1])

    def _live(self, without: Flip | None) -> int:
        """The data, the used part of the stack, and the registers that an idle loop preserves; without a flipped
        bit."""
        core = self._board.core
        stack = core.reg_read(arm.UC_ARM_REG_SP)
        if not RAM <= stack < self._places["data"][0]:
            return -1
        memory = core.mem_read(stack, self._places["data"][1] - stack)
        kept = [core.reg_read(register) for register in KEPT]
        if without is not None and without.register in KEPT:
            kept[KEPT.index(without.register)] ^= without.bit
        elif without is not None and without.address is not None and without.address >= stack:
            at = without.address - stack
            memory[at : at + 4] = (int.from_bytes(memory[at : at + 4], "little") ^ without.bit).to_bytes(4, "little")
        return zlib.crc32(memory, zlib.crc32(repr((stack, kept)).encode()))

    def _choose(self, place: str, random: Random) -> Flip:
        bit = 1 << random.randrange(32)
        if place in ("register", "float register"):
            return Flip(place, bit, register=random.choice(REGISTERS if place == "register" else FLOATS))
        begin, end = self._places[place]
        if place == "stack":
            begin = max(begin, self._board.core.reg_read(arm.UC_ARM_REG_SP) & ~3)
        return Flip(place, bit, random.randrange(begin, end, 4) if begin < end else self._places[place][0])

    def _write(self, flip: Flip) -> None:
        core = self._board.core
        if flip.address is None:
            value = core.reg_read(flip.register) ^ flip.bit
            core.reg_write(flip.register, value | (1 if flip.register == arm.UC_ARM_REG_PC else 0))
            return
        word = int.from_bytes(core.mem_read(flip.address, 4), "little") ^ flip.bit
        core.mem_write(flip.address, word.to_bytes(4, "little"))
        if flip.place == "code":
            core.ctl_remove_cache(flip.address, flip.address + 4)


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


def _classes(answers: list[Frame]) -> list[ReasonClass]:
    """Of the reason of each StopCommand with a consistent stop. A fault can shorten the frame."""
    stops = [frame.data for frame in answers if frame.id == STOP_COMMAND and len(frame.data) > REASON_BYTE]
    return [REASON_CLASS.get(data[REASON_BYTE], ReasonClass.UNKNOWN) for data in stops if data[2] == 0xF0]


def is_ordinary_stop(answers: list[Frame]) -> bool:
    """A reason that is not a fault of the guard."""
    kinds = _classes(answers)
    return bool(kinds) and all(kind not in (ReasonClass.FAULT, ReasonClass.UNKNOWN) for kind in kinds)


def is_fault(answers: list[Frame]) -> bool:
    kinds = _classes(answers)
    return bool(kinds) and all(kind is ReasonClass.FAULT for kind in kinds)


def _sync_cycle(messages: list[can.Message]) -> int:
    return next((int.from_bytes(m.data[2:4], "little") for m in messages if m.arbitration_id == 0x020), 0)
