"""Small helpers of the bus tests: a command, the type of the fixture `start`, an impossible tick budget."""

import subprocess
import zlib
from collections.abc import Callable

import bus_guard
import numpy as np

from tauperp.config import Configuration, Numeric
from tauperp.config.block import CRC_END, block_dtype

Start = Callable[..., bus_guard.GuardProcess]


class HurriedConfiguration(Configuration):
    """No tick is that fast."""

    def block(self, numeric: Numeric = "float32") -> bytes:
        block = np.frombuffer(super().block(numeric), block_dtype(numeric)).copy()
        block["tick_budget_us"] = 1
        block["crc"] = zlib.crc32(block.tobytes()[CRC_END:])
        return block.tobytes()


def run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=20).stdout
