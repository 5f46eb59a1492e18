"""Functions that the firmware needs from a compiler's libraries on every target: clearing and copying memory, integer
arithmetic and, where the processor has no float unit, float arithmetic. No libm, no double, no fused multiply-add."""

import re
import subprocess
from functools import cache
from pathlib import Path

import pytest
from checkout import ROOT, make

pytestmark = pytest.mark.needs("arm")
ROOMS = ("core", "wire", "wire/generated", "guard", "schedule")
TARGETS = ("m3", "m4f", "m7", "r5f")
MEMORY = {"memset", "memcpy"}
INTEGERS = {"__aeabi_uldivmod", "__aeabi_ldivmod"}
# Software floating point. sqrtf of newlib is exact, as IEEE 754 requires, and replaces the missing instruction.
FLOATS = re.compile(r"__aeabi_(f(add|sub|rsub|mul|div|cmp\w\w)|u?i2f|f2u?iz|fcmpun)|sqrtf")
FUSED_OR_DOUBLE = re.compile(r"\bv(fn?m[as]|\w+\.f64)\w*|\.f64")


def objects(target: str, numeric: str) -> list[Path]:
    make(f"firmware-objects-{target}-{numeric}")
    place = ROOT / "build" / "cmake" / target / "CMakeFiles" / f"firmware-{numeric}.dir"
    sources = [source for room in ROOMS for source in (ROOT / "firmware" / room).glob("*.c")]
    return [place / source.relative_to(ROOT).with_suffix(".obj") for source in sources]


@cache
def output(tool: str, option: str, *files: Path) -> str:
    return subprocess.run([tool, option, *files], capture_output=True, text=True, check=True).stdout


def symbols(files: list[Path], kind: str) -> set[str]:
    """Symbols by nm's letter: U is an undefined symbol, any other letter a defined one."""
    lines = [line.split() for line in output("arm-none-eabi-nm", "-g", *files).splitlines()]
    return {line[-1] for line in lines if len(line) >= 2 and (line[-2] == "U") == (kind == "U")}


@pytest.mark.gate
@pytest.mark.parametrize("numeric", ["float", "fixed"])
@pytest.mark.parametrize("target", TARGETS)
def test_the_firmware_needs_nothing_of_libm_and_no_double(target: str, numeric: str) -> None:
    files = objects(target, numeric)
    asked = symbols(files, "U") - symbols(files, "defined")
    allowed = MEMORY | INTEGERS | ({name for name in asked if FLOATS.fullmatch(name)} if target == "m3" else set())
    assert "memset" in asked  # the list is not empty
    assert asked - allowed == set()


@pytest.mark.parametrize("numeric", ["float", "fixed"])
@pytest.mark.parametrize("target", [target for target in TARGETS if target != "m3"])
def test_no_instruction_is_fused_or_has_double_precision(target: str, numeric: str) -> None:
    files = objects(target, numeric)
    code = output("arm-none-eabi-objdump", "-d", *files)
    assert "vmul.f32" in code or numeric == "fixed"
    assert [line for line in code.splitlines() if FUSED_OR_DOUBLE.search(line)] == []


def test_the_library_for_the_host_needs_no_more() -> None:
    make("library", "library-fixed")
    for library in ("build/libtauperp.so", "build/fixed/libtauperp.so"):
        lines = output("nm", "-Du", ROOT / library).splitlines()
        asked = {line.split()[-1].partition("@")[0] for line in lines}
        assert {name for name in asked if not name.startswith(("_ITM_", "__cxa_", "__gmon"))} <= MEMORY, library
