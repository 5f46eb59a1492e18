"""The stack that an image for a board needs at worst, by gcc's call graphs: from its start, over every path. A call
graph with recursion, with a frame without bound or with a call through a pointer is an error (tools/bench/stack.py)."""

import subprocess
import sys
from pathlib import Path

import pytest
from checkout import BUILD, ROOT, make

sys.path.insert(0, str(ROOT / "tools" / "bench"))

from library_stack import bound, read_functions
from stack import worst_stack

ROOTS = {"stm32g4": ("reset_handler", "fault_stop"), "versal_r5": ("main", "fault_stop")}
MOST = 1.01  # growth by more than one percent is refused
# Bytes by board, numeric type and number of channels, and the build folder of `make firmware`.
KNOWN = {
    ("stm32g4", "float", "1"): (1808, "stm32g4-7-float"),
    ("stm32g4", "fixed", "1"): (2124, "stm32g4-7-fixed"),
    ("versal_r5", "float", "2"): (2620, "versal_r5-7-float"),
    ("versal_r5", "fixed", "1"): (2124, "versal_r5-7-fixed"),
}


def text(image: Path, name: str, *options: str) -> str:
    command = [f"arm-none-eabi-{name}", *options, str(image)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def reserved(image: Path) -> int:
    """Bytes of the section .stack."""
    rows = [line.split() for line in text(image, "size", "-A").splitlines()]
    return next(int(row[1]) for row in rows if row and row[0] == ".stack")


def wrong(needed: int, known: int, size: int) -> list[str]:
    """A stack beyond its section, beyond what is known, or so far below that the table is not current."""
    lines = [] if needed <= size else [f"{needed} bytes needed, {size} reserved"]
    return lines + ([] if known / MOST <= needed <= known * MOST else [f"{needed} bytes needed, {known} known"])


@pytest.mark.gate
@pytest.mark.slow
@pytest.mark.needs("arm")
@pytest.mark.parametrize("image", KNOWN, ids="-".join)
def test_the_stack_of_an_image_is_bounded_and_has_not_grown(image: tuple[str, str, str]) -> None:
    board, numeric, channels = image
    known, folder = KNOWN[image]
    elf = BUILD / "stack" / f"{'-'.join(image)}.elf"
    elf.parent.mkdir(parents=True, exist_ok=True)
    place = elf.relative_to(ROOT)
    make("firmware", f"BOARD={board}", f"NUMERIC={numeric}", f"CHANNELS={channels}", f"IMAGE={place}")
    functions = read_functions(text(elf, "objdump", "-d", "--no-show-raw-insn"), text(elf, "nm"))
    objects = BUILD / "cmake" / folder / "CMakeFiles"
    needed = worst_stack(objects, ROOTS[board], lambda name: bound(functions, name))
    assert wrong(needed, known, reserved(elf)) == []


def test_a_stack_that_grew_or_is_too_large_is_refused() -> None:
    assert wrong(1000, 1000, 8192) == []
    assert wrong(1011, 1000, 8192) == ["1011 bytes needed, 1000 known"]
    assert wrong(980, 1000, 8192) == ["980 bytes needed, 1000 known"]
    assert wrong(9000, 9000, 8192) == ["9000 bytes needed, 8192 reserved"]
