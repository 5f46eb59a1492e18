"""The layers of firmware and host: allowed dependencies, and that the lower layers of the firmware build alone."""

import ast
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tauperp.files import repository_root

FIRMWARE = repository_root() / "firmware"
LAYERS = {  # folder: the folders whose headers it may include besides its own
    "core": (),
    "wire": (),
    "guard": ("core", "wire"),
    "pair": ("core", "wire", "guard"),
    "schedule": ("core", "wire", "guard"),
    "robot_side": ("wire",),
    "api": ("core", "wire", "guard", "schedule"),
    "boards": ("core", "wire", "guard", "pair", "schedule"),
    "hosts": ("core", "wire", "guard", "pair", "schedule", "robot_side"),
    "examples": ("api", "robot_side", "wire"),
}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)

HOST = repository_root() / "host" / "tauperp"
HOST_LAYERS = (  # a package or module may import those of earlier rows only
    {"__init__", "errors"},
    {"files", "toml", "words", "intervals", "page", "plot", "wire_values"},
    {"robot", "wire"},
    {"bus", "robot_side"},
    {"busload"},
    {"config"},
    {"firmware", "image"},
    {"provenance", "sim"},
    {"run", "kernel"},
    {"judge", "recording", "replay", "sensitivity"},
    {"experiment", "calibrate"},
    {"campaign", "monitor", "playing"},
    {"view"},
    {"cli"},
    {"commands"},
)
NARROW = {"sim": {"robot"}, "robot": {"errors", "toml"}}  # these may use no more than that


def climbing(firmware: Path) -> list[str]:
    """Every forbidden include, as "file -> folder"."""
    folders: dict[str, set[str]] = {}
    for header in firmware.rglob("*.h"):
        folders.setdefault(header.name, set()).add(header.relative_to(firmware).parts[0])
    found = []
    for source in sorted([*firmware.rglob("*.c"), *firmware.rglob("*.h")]):
        place = source.relative_to(firmware)
        own = place.parts[0]
        for name in INCLUDE.findall(source.read_text()):
            homes = folders.get(Path(name).name, {own})
            if own not in homes and not homes & set(LAYERS[own]):
                found.append(f"{place} -> {sorted(homes)[0]}")
    return found


@pytest.mark.gate
def test_no_include_goes_to_a_higher_layer() -> None:
    assert climbing(FIRMWARE) == []


def test_an_include_of_a_higher_layer_is_found(tmp_path: Path) -> None:
    for place, text in (
        ("core/motion.c", '#include "guard.h"\n'),
        ("guard/guard.h", ""),
        ("guard/guard.c", '#include "guard.h"\n'),
    ):
        (tmp_path / place).parent.mkdir(exist_ok=True)
        (tmp_path / place).write_text(text)
    assert climbing(tmp_path) == ["core/motion.c -> guard"]


def imported(source: Path) -> Iterator[str]:
    """The packages and modules of the host that a file imports, at its top or inside a function."""
    for node in ast.walk(ast.parse(source.read_text())):
        modules = []
        if isinstance(node, ast.ImportFrom):
            whole = node.module == "tauperp"
            modules = [f"tauperp.{one.name}" for one in node.names] if whole else [node.module or ""]
        elif isinstance(node, ast.Import):
            modules = [one.name for one in node.names]
        yield from (module.split(".")[1] for module in modules if module.startswith("tauperp."))


def climbing_imports(host: Path) -> list[str]:
    """Every import that does not go down the rows, as "file -> package".

    A name that is in no row is a value of the package itself, such as `__version__`.
    """
    row = {name: at for at, names in enumerate(HOST_LAYERS) for name in names}
    found = []
    for source in sorted(host.rglob("*.py")):
        place = source.relative_to(host)
        own = place.parts[0].removesuffix(".py")
        for name in set(imported(source)) - {own}:
            if row.get(name, 0) >= row[own] or name not in NARROW.get(own, {name}):
                found.append(f"{place} -> {name}")
    return found


@pytest.mark.gate
def test_no_import_of_the_host_goes_to_a_higher_layer() -> None:
    assert climbing_imports(HOST) == []


def test_an_import_of_a_higher_layer_is_found(tmp_path: Path) -> None:
    for place, text in (
        ("sim/arm.py", "from tauperp.robot import Robot\n\n\ndef late():\n    from tauperp.config import Settings\n"),
        ("robot/model.py", "from tauperp import sim\n"),
        ("run/node.py", "import tauperp.kernel.bench\nfrom tauperp.sim.arm import Arm\n"),
    ):
        (tmp_path / place).parent.mkdir(exist_ok=True)
        (tmp_path / place).write_text(text)
    assert climbing_imports(tmp_path) == [
        "robot/model.py -> sim",
        "run/node.py -> kernel",
        "sim/arm.py -> config",
    ]


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
