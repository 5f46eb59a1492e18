"""Clocks, timer, watchdog, UART and pins of the STM32G474 (RM0440 rev 8), as far as the image uses them."""

from __future__ import annotations

from dataclasses import dataclass, field

PORRST, WATCHDOG_RST, PIN_RST, RMVF = 1 << 27, 1 << 29, 1 << 26, 1 << 23  # RCC_CSR
CR, CFGR, CSR = 0x00, 0x08, 0x94
CORE_MHZ = 170
PERMISSION = 1 << 8  # PA8


@dataclass
class Words:
    """A block of registers without behaviour."""

    words: dict[int, int] = field(default_factory=dict)

    def read(self, offset: int) -> int:
        return self.words.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        self.words[offset] = value


class Rcc(Words):
    """Crystal and PLL are ready as soon as they are switched on, and the core's clock follows its switch."""

    crystal = True  # whether the crystal starts

    def write(self, offset: int, value: int) -> None:
        if offset == CR:
            hse = self.crystal and value >> 16 & 1
            value = (value & ~(1 << 17 | 1 << 25)) | hse << 17 | (value >> 24 & 1) << 25
        elif offset == CFGR:
            value = (value & ~0xC) | (value & 3) << 2
        elif offset == CSR and value & RMVF:
            value = 0
        self.words[offset] = value


class Gpio(Words):
    """Port A: BSRR sets and clears ODR."""

    edges = 0

    @property
    def permission(self) -> bool:
        return bool(self.read(0x14) & PERMISSION)

    def write(self, offset: int, value: int) -> None:
        if offset != 0x18:
            self.words[offset] = value
            return
        before = self.read(0x14)
        after = (before & ~(value >> 16)) | (value & 0xFFFF)
        self.edges += (before ^ after) & PERMISSION != 0
        self.words[0x14] = after


class Timer(Words):
    """TIM2: counts the model's microseconds, with its prescaler from 170 MHz."""

    now_us = 0

    def read(self, offset: int) -> int:
        if offset != 0x24:
            return self.words.get(offset, 0)
        if not self.words.get(0, 0) & 1:
            return 0
        ticks = self.now_us * CORE_MHZ // (self.words.get(0x28, 0) % 65536 + 1)
        return ticks % (self.words.get(0x2C, 0xFFFFFFFF) + 1)


class Watchdog(Words):
    """IWDG, on its own oscillator at its nominal 32 kHz."""

    started = unlocked = False
    loaded_us = 0
    now_us = 0

    def write(self, offset: int, value: int) -> None:
        if offset == 0:
            self.started |= value == 0xCCCC
            self.unlocked = value == 0x5555
            self.loaded_us = self.now_us if value == 0xAAAA else self.loaded_us
        elif self.unlocked:
            self.words[offset] = value

    def read(self, offset: int) -> int:
        return 0 if offset == 0xC else self.words.get(offset, 0)  # SR: an update is immediate

    @property
    def expired(self) -> bool:
        ticks = (self.words.get(8, 0xFFF) & 0xFFF) + 1
        timeout_us = ticks * (4 << (self.words.get(4, 0) & 7)) * 1000 // 32
        return self.started and self.now_us - self.loaded_us > timeout_us


class Uart(Words):
    """USART2: always ready for a character."""

    def __init__(self) -> None:
        super().__init__()
        self.text = bytearray()

    def read(self, offset: int) -> int:
        return 1 << 7 if offset == 0x1C else self.words.get(offset, 0)  # ISR: TXFNF

    def write(self, offset: int, value: int) -> None:
        if offset == 0x28:
            self.text.append(value & 0xFF)
        else:
            self.words[offset] = value
