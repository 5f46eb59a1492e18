"""Images of board stm32g4 for its emulator (tools/g4)."""

import os
import sys
from pathlib import Path

from checkout import BUILD, ROOT, make

sys.path.insert(0, str(ROOT / "tools"))

COMPLETE_IN_CI = ("contact", "float")  # with CI=true all other runs end after SLICE_CYCLES
SLICE_CYCLES = 800


def g4_image(name: str, block: bytes, *, numeric: str = "float") -> Path:
    """The shipped image, with this configuration block."""
    folder = BUILD / "g4"
    folder.mkdir(parents=True, exist_ok=True)
    block_file, image = folder / f"{name}.bin", folder / f"{name}.elf"
    block_file.write_bytes(block)
    place = image.relative_to(ROOT)
    make("firmware", "BOARD=stm32g4", f"NUMERIC={numeric}", f"BLOCK={block_file}", f"IMAGE={place}")
    return image


def slice_of(name: str, numeric: str) -> int | None:
    """Number of cycles after which an experiment is stopped; None: the experiment runs to its end."""
    return SLICE_CYCLES if os.environ.get("CI") == "true" and (name, numeric) != COMPLETE_IN_CI else None
