"""The layers of the firmware: who may include whom, and that the lower ones stand alone."""

import re
import subprocess
from pathlib import Path

import pytest

from tauperp.files import repository_root

FIRMWARE = repository_root() / "firmware"
LAYERS = {  # room: the rooms whose headers it may include besides its own
    "core": (),
    "wire": (),
    "guard": ("core", "wire"),
    "schedule": ("core", "wire", "guard"),
    "robot_side": ("wire",),
    "robots": ("core",),
    "api": ("core", "wire", "guard", "schedule"),
    "boards": ("core", "wire", "guard", "schedule", "robots"),
    "hosts": ("core", "wire", "guard", "schedule", "robot_side", "robots"),
    "examples": ("api", "robot_side", "wire"),
}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def climbing(firmware: Path) -> list[str]:
    """Every include of a room that the including one may not use, as "file -> room"."""
    rooms: dict[str, set[str]] = {}
    for header in firmware.rglob("*.h"):
        rooms.setdefault(header.name, set()).add(header.relative_to(firmware).parts[0])
    found = []
    for source in sorted([*firmware.rglob("*.c"), *firmware.rglob("*.h")]):
        place = source.relative_to(firmware)
        own = place.parts[0]
        for name in INCLUDE.findall(source.read_text()):
            homes = rooms.get(Path(name).name, {own})
            if own not in homes and not homes & set(LAYERS[own]):
                found.append(f"{place} -> {sorted(homes)[0]}")
    return found


@pytest.mark.gate
def test_no_include_climbs() -> None:
    assert climbing(FIRMWARE) == []


def test_an_include_that_climbs_is_found(tmp_path: Path) -> None:
    for place, text in (
        ("core/motion.c", '#include "guard.h"\n'),
        ("guard/guard.h", ""),
        ("guard/guard.c", '#include "guard.h"\n'),
    ):
        (tmp_path / place).parent.mkdir(exist_ok=True)
        (tmp_path / place).write_text(text)
    assert climbing(tmp_path) == ["core/motion.c -> guard"]


@pytest.mark.gate
@pytest.mark.parametrize("numeric", ["float", "fixed"])
@pytest.mark.parametrize("room", ["core", "wire"])
def test_a_lower_layer_builds_alone(room: str, numeric: str) -> None:
    """With its own folder as the only -I."""
    sources = sorted((FIRMWARE / room).rglob("*.c"))
    assert len(sources) > 2
    define = ["-DTAUPERP_FIXED=1"] if numeric == "fixed" else []
    command = ["gcc", "-std=c11", "-fsyntax-only", "-Wall", "-Werror", *define, f"-I{FIRMWARE / room}", *sources]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
