"""One board: the core in Unicorn with the devices around it, and time that the caller sets."""

from __future__ import annotations

import copy
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import unicorn
from unicorn import arm_const as arm

from g4.devices import CSR, PIN_RST, PORRST, WATCHDOG_RST, Gpio, Rcc, Timer, Uart, Watchdog, Words
from g4.fdcan import Fdcan, Frame

FLASH, FLASH_BYTES = 0x08000000, 512 * 1024
RAM, RAM_BYTES = 0x20000000, 96 * 1024
MESSAGE_RAM, MESSAGE_RAM_PAGE = 0x4000A400, 0x4000A000
PAGE = 0x1000
INSTRUCTIONS = 20_000_000  # limit of one run: a core that takes longer counts as an endless loop
HARD_FAULT = 3
HANDLER = 20_000  # more instructions than the handler of exceptions takes before its endless loop
REGISTERS = [getattr(arm, f"UC_ARM_REG_R{number}") for number in range(13)]
REGISTERS += [arm.UC_ARM_REG_SP, arm.UC_ARM_REG_LR, arm.UC_ARM_REG_PC]
FLOATS = [getattr(arm, f"UC_ARM_REG_S{number}") for number in range(32)]


@dataclass(frozen=True)
class Snapshot:
    """The state on which a later run depends, except flash."""

    context: Any
    ram: bytes
    message_ram: bytes
    devices: tuple[Any, ...]
    fdcan: Any
    halted: bool
    handling: bool
    now_us: int


class Board:
    """An image after power-on. `now_us` is the model's time."""

    def __init__(self, image: Path) -> None:
        self._segments = segments(image.read_bytes())
        uc = self.core = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        uc.mem_map(FLASH, FLASH_BYTES, unicorn.UC_PROT_READ | unicorn.UC_PROT_EXEC)
        uc.mem_map(RAM, RAM_BYTES)
        uc.mem_map(MESSAGE_RAM_PAGE, PAGE, unicorn.UC_PROT_READ | unicorn.UC_PROT_WRITE)
        uc.mem_map(0xE000E000, PAGE, unicorn.UC_PROT_READ | unicorn.UC_PROT_WRITE)
        self.fdcan = Fdcan(
            lambda offset, size: bytes(uc.mem_read(MESSAGE_RAM + offset, size)),
            lambda offset, data: uc.mem_write(MESSAGE_RAM + offset, data),
        )
        self.rcc, self.gpio, self.timer, self.watchdog, self.uart = Rcc(), Gpio(), Timer(), Watchdog(), Uart()
        self._power, self._flash = Words(), Words()
        self._map(0x40000000, self.timer)
        self._map(0x40003000, self.watchdog)
        self._map(0x40004000, self.uart, 0x400)
        self._map(0x40006000, self.fdcan, 0x400)
        self._map(0x40007000, self._power)
        self._map(0x40021000, self.rcc)
        self._map(0x40022000, self._flash)
        self._map(0x48000000, self.gpio)
        uc.hook_add(unicorn.UC_HOOK_INTR, self._interrupt)
        self.timer_stands = False
        self.resets = 0
        self.faults = 0  # exceptions taken
        uc.mem_write(FLASH, b"\xff" * FLASH_BYTES)  # erased, and no instruction
        self.load()
        uc.mem_write(RAM, bytes(RAM_BYTES))
        self.rcc.words[CSR] = PORRST
        self._start()

    @property
    def _devices(self) -> tuple[Words, ...]:
        return self.rcc, self.gpio, self.timer, self.watchdog, self._power, self._flash

    @property
    def now_us(self) -> int:
        return self.watchdog.now_us

    @property
    def halted(self) -> bool:
        """The core has no visible effect any more: an endless loop or lockup."""
        return self._halted

    @property
    def lines(self) -> list[str]:
        """Lines of the UART."""
        return self.uart.text.decode("ascii", "replace").replace("\r", "").splitlines()

    def load(self) -> None:
        """Writes the image into flash (again)."""
        for address, data in self._segments:
            self.core.mem_write(address, data)

    def advance(self, now_us: int, timer_us: int | None = None) -> None:
        """Advances time. A watchdog that was not served resets the core. timer_us: what a wrong timer shows."""
        self.watchdog.now_us = now_us
        if not self.timer_stands:
            self.timer.now_us = now_us if timer_us is None else timer_us
        if self.watchdog.expired:
            self.resets += 1
            for device in self._devices:
                device.words.clear()
            self.watchdog.started = False
            self.fdcan.reset()
            self.rcc.words[CSR] = WATCHDOG_RST | PIN_RST
            self._start()

    def receive(self, frame: Frame) -> None:
        """Adds a frame of another node, which waits for the bus."""
        self.fdcan.bus.append(frame)

    def run(self, instructions: int = INSTRUCTIONS) -> list[Frame]:
        """Runs until the core is idle; returns the frames that it sent. A core that exceeds the limit has halted."""
        self.fdcan.looks = 0
        left = instructions
        while not self._halted and self.fdcan.looks < 2 and left > 0:
            taken = self.faults
            left -= self.step(left)
            if self.faults != taken:
                left = min(left, HANDLER)
        self._halted = self._halted or self.fdcan.looks < 2
        sent, self.fdcan.sent = self.fdcan.sent, []
        return sent

    def step(self, count: int) -> int:
        """Runs this many instructions, or fewer if the core becomes idle. Returns an upper bound of their number."""
        self._pending = None
        try:
            self.core.emu_start(self.core.reg_read(arm.UC_ARM_REG_PC) | 1, 0xFFFFFFFE, count=count)
        except unicorn.UcError:
            self._pending = HARD_FAULT
        if self._pending is not None:
            self._enter_exception()
            return 1
        return count

    def snapshot(self) -> Snapshot:
        return Snapshot(
            self.core.context_save(),
            bytes(self.core.mem_read(RAM, RAM_BYTES)),
            bytes(self.core.mem_read(MESSAGE_RAM_PAGE, PAGE)),
            tuple(copy.deepcopy(vars(device)) for device in self._devices),
            self.fdcan.state(),
            self._halted,
            self._handling,
            self.now_us,
        )

    def restore(self, snapshot: Snapshot) -> None:
        self.core.mem_write(RAM, snapshot.ram)
        self.core.mem_write(MESSAGE_RAM_PAGE, snapshot.message_ram)
        self.core.context_restore(snapshot.context)
        for device, state in zip(self._devices, snapshot.devices, strict=True):
            vars(device).update(copy.deepcopy(state))
        self.fdcan.restore(snapshot.fdcan)
        self._halted, self._handling = snapshot.halted, snapshot.handling

    def _map(self, page: int, device: Any, base: int = 0) -> None:
        def read(_: Any, offset: int, size: int, __: Any) -> int:
            value: int = device.read(offset - base & ~3)
            if self.fdcan.looks >= 2:
                self.core.emu_stop()
            return value >> 8 * (offset & 3) & (1 << 8 * size) - 1

        def write(_: Any, offset: int, size: int, value: int, __: Any) -> None:
            device.write(offset - base & ~3, value << 8 * (offset & 3))

        self.core.mmio_map(page, PAGE, read, None, write, None)

    def _interrupt(self, core: Any, number: int, _: Any) -> None:
        self._pending = HARD_FAULT
        core.emu_stop()

    def _start(self) -> None:
        stack, entry = struct.unpack("<2I", self.core.mem_read(FLASH, 8))
        self.core.reg_write(arm.UC_ARM_REG_SP, stack)
        self.core.reg_write(arm.UC_ARM_REG_LR, 0xFFFFFFFF)
        self.core.reg_write(arm.UC_ARM_REG_PC, entry | 1)
        self._halted = False
        self._handling = False
        self._pending: int | None = None

    def _enter_exception(self) -> None:
        """Every exception of the image goes to one handler (startup.c). A second one, or a stack frame without memory,
        causes lockup."""
        self.faults += 1
        core, read = self.core, self.core.reg_read
        stack = read(arm.UC_ARM_REG_SP) - 32 & ~7
        if self._handling or not RAM <= stack <= RAM + RAM_BYTES - 32:
            self._halted = True
            return
        frame = [read(register) for register in (*REGISTERS[:4], REGISTERS[12], arm.UC_ARM_REG_LR, arm.UC_ARM_REG_PC)]
        core.mem_write(stack, struct.pack("<8I", *frame, read(arm.UC_ARM_REG_XPSR)))
        (handler,) = struct.unpack("<I", core.mem_read(FLASH + 4 * HARD_FAULT, 4))
        self._handling = True
        core.reg_write(arm.UC_ARM_REG_SP, stack)
        core.reg_write(arm.UC_ARM_REG_LR, 0xFFFFFFF9)
        core.reg_write(arm.UC_ARM_REG_PC, handler | 1)


def segments(elf: bytes) -> list[tuple[int, bytes]]:
    """Load address and bytes of each loaded segment (ELF specification 1.2, chapter 2)."""
    (table,) = struct.unpack_from("<I", elf, 28)
    size, count = struct.unpack_from("<2H", elf, 42)
    headers = [struct.unpack_from("<5I", elf, table + size * number) for number in range(count)]
    return [(address, elf[at : at + filled]) for kind, at, _, address, filled in headers if kind == 1 and filled]
