"""FDCAN1 by its registers (RM0440 rev 8, chapter 44), on a bus without other traffic."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

CCCR, NBTP, PSR, IR, RXGFC, TXFQS, TXBRP, TXBAR, TXBCR = 0x18, 0x1C, 0x44, 0x50, 0x80, 0xC4, 0xC8, 0xCC, 0xD0
STATUS, ACKNOWLEDGE = {0x90: 0, 0x98: 1}, {0x94: 0, 0x9C: 1}  # RXF0S, RXF1S; RXF0A, RXF1A
PROTECTED = {0x0C, 0x1C, 0x48, 0x80, 0xC0}  # DBTP, NBTP, TDCR, RXGFC, TXBC
INIT, CCE, FDOE, BRSE = 1 << 0, 1 << 1, 1 << 8, 1 << 9
FILTERS, FIFO, BUFFERS, ELEMENT = 0x000, (0x0B0, 0x188), 0x278, 72
XTD, RTR, FDF, BRS = 1 << 30, 1 << 29, 1 << 21, 1 << 20
DEPTH = 3


@dataclass(frozen=True, slots=True)
class Frame:
    """One CAN frame with up to 8 bytes. flags: as CAN_FRAME_* of firmware/wire/frame.h."""

    id: int
    data: bytes
    fd: bool = False
    brs: bool = False
    extended: bool = False
    remote: bool = False


class Fdcan:
    """Registers and bus. `ram` reads and writes words of the message RAM, by offset."""

    def __init__(self, read: Callable[[int, int], bytes], write: Callable[[int, bytes], None]) -> None:
        self._read, self._write = read, write
        self.sent: list[Frame] = []
        self.bus: deque[Frame] = deque()  # frames of other nodes that wait for the bus
        self.reset()

    def reset(self) -> None:
        self.control = INIT
        self.registers: dict[int, int] = {}
        self.get, self.fill = [0, 0], [0, 0]
        self.pending = 0
        self.looks = 0  # frames sent on the empty bus, in order

    def state(self) -> tuple[int, dict[int, int], list[int], list[int], int]:
        return self.control, dict(self.registers), list(self.get), list(self.fill), self.pending

    def restore(self, state: tuple[int, dict[int, int], list[int], list[int], int]) -> None:
        control, registers, get, fill, pending = state
        self.control, self.registers, self.pending = control, dict(registers), pending
        self.get, self.fill = list(get), list(fill)
        self.sent.clear()
        self.bus.clear()
        self.looks = 0

    def read(self, offset: int) -> int:
        if offset in STATUS:
            fifo = STATUS[offset]
            if fifo == 0:
                self._carry()
            elif self.fill == [0, 0]:
                self.looks += 1
            return self.fill[fifo] | self.get[fifo] << 8
        if offset == CCCR:
            return self.control
        if offset == TXFQS:
            free = next((b for b in range(DEPTH) if not self.pending >> b & 1), None)
            return 1 << 21 if free is None else free << 16
        if offset == TXBRP:
            return self.pending
        return self.registers.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        if offset in ACKNOWLEDGE:
            fifo = ACKNOWLEDGE[offset]
            if self.fill[fifo]:
                self.get[fifo] = (self.get[fifo] + 1) % DEPTH
                self.fill[fifo] -= 1
        elif offset == CCCR:
            configuring = self.control & (INIT | CCE) == INIT | CCE
            mask = INIT | (CCE if self.control & INIT else 0) | (FDOE | BRSE if configuring else 0)
            self.control = (self.control & ~mask) | (value & mask)
            if not self.control & INIT:
                self.control &= ~CCE
        elif offset == IR:
            self.registers[IR] = self.registers.get(IR, 0) & ~value
        elif offset == TXBAR:
            if not self.control & INIT:
                self.pending |= value & 7
                self._transmit()
        elif offset == TXBCR:
            self.pending &= ~value
        elif offset not in PROTECTED or self.control & (INIT | CCE) == INIT | CCE:
            self.registers[offset] = value

    def _word(self, offset: int) -> int:
        return int.from_bytes(self._read(offset, 4), "little")

    def _transmit(self) -> None:
        waiting = [self._buffered(b) for b in range(DEPTH) if self.pending >> b & 1]
        self.sent += sorted(waiting, key=lambda frame: frame.id)
        self.pending = 0

    def _buffered(self, buffer: int) -> Frame:
        at = BUFFERS + ELEMENT * buffer
        id_word, dlc_word = self._word(at), self._word(at + 4)
        fd = bool(dlc_word & FDF and self.control & FDOE)
        data = self._read(at + 8, min(dlc_word >> 16 & 15, 8))
        return Frame(id_word >> 18 & 0x7FF, data, fd, fd and bool(dlc_word & BRS and self.control & BRSE))

    def _carry(self) -> None:
        """Stores the next frame that passes the filters, once both FIFOs are empty."""
        while self.bus and self.fill == [0, 0] and not self.control & INIT:
            frame = self.bus.popleft()
            fifo = self._filter(frame)
            if fifo is not None:
                self._store(frame, fifo)
        if self.fill != [0, 0]:
            self.looks = 0

    def _filter(self, frame: Frame) -> int | None:
        config = self.registers.get(RXGFC, 0)
        count = config >> 16 & 0x1F
        if not frame.extended and count:
            for word in struct.unpack(f"<{count}I", self._read(FILTERS, 4 * count)):
                if word >> 30 == 1 and frame.id in (word >> 16 & 0x7FF, word & 0x7FF):
                    return {1: 0, 2: 1}.get(word >> 27 & 7)
        return {0: 0, 1: 1}.get(config >> (2 if frame.extended else 4) & 3)

    def _store(self, frame: Frame, fifo: int) -> None:
        id_word = frame.id | XTD if frame.extended else frame.id << 18
        id_word |= RTR if frame.remote else 0
        dlc_word = len(frame.data) << 16 | (FDF if frame.fd else 0) | (BRS if frame.brs else 0)
        at = FIFO[fifo] + ELEMENT * ((self.get[fifo] + self.fill[fifo]) % DEPTH)
        self._write(at, id_word.to_bytes(4, "little") + dlc_word.to_bytes(4, "little") + frame.data)
        self.fill[fifo] += 1
