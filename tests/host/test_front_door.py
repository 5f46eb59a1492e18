"""The firmware in a foreign program: one header, one prefix, both numeric types in one image, any CMake project."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tauperp.cli import main
from tauperp.files import repository_root

ROOT = repository_root()
FIRMWARE = ROOT / "firmware"
EXAMPLE = FIRMWARE / "examples" / "minimal" / "minimal.c"
STRICT = ["-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror"]
CORTEX_M = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]
BLOCKS = {"float": "float32", "fixed": "q9.22"}

PROJECT = f"""
cmake_minimum_required(VERSION 3.18)
project(foreign LANGUAGES C)
add_subdirectory("{FIRMWARE}" tauperp)
if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
    add_executable(example "{EXAMPLE}" board.c block_float.c)
    target_link_libraries(example PRIVATE tauperp::float)
    add_executable(both both.c one_float.c one_fixed.c)
    set_source_files_properties(one_float.c one_fixed.c PROPERTIES INCLUDE_DIRECTORIES "{FIRMWARE}/api")
    set_source_files_properties(one_fixed.c PROPERTIES COMPILE_DEFINITIONS TAUPERP_FIXED=1)
    target_link_libraries(both PRIVATE "$<TARGET_FILE:tauperp_float>" "$<TARGET_FILE:tauperp_fixed>")
    add_dependencies(both tauperp_float tauperp_fixed)
else()
    add_library(example STATIC "{EXAMPLE}")
    target_link_libraries(example PRIVATE tauperp::fixed)
endif()
"""

# A board with a clock that advances by 100 us per call and a silent bus: self-test, waiting, no permission.
BOARD = """
#include <stdio.h>
#include "tauperp.h"
bool board_init(void); uint32_t board_start_cause(void); uint32_t board_restarts(void); uint64_t board_clock_us(void);
bool board_runs(void); bool board_receive(tauperp_frame_t *frame); uint32_t board_bus_fault(void);
void board_answer(const tauperp_frame_t frames[], uint32_t count); void board_permission(bool permitted);
void board_watchdog(void);
static uint64_t now_us; static uint32_t stops, others, permissions;
bool board_init(void) { return true; }
uint32_t board_start_cause(void) { return TAUPERP_START_POWER_ON; }
uint32_t board_restarts(void) { return 0; }
uint64_t board_clock_us(void) { return now_us += 100u; }
bool board_runs(void) {
    if (now_us < 3000000u) { return true; }
    printf("%u %u %u\\n", stops, others, permissions);
    return false;
}
bool board_receive(tauperp_frame_t *frame) { (void)frame; return false; }
uint32_t board_bus_fault(void) { return 0; }
void board_answer(const tauperp_frame_t frames[], uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) { stops += frames[i].id == 0x010u; others += frames[i].id != 0x010u; }
}
void board_permission(bool permitted) { permissions += permitted; }
void board_watchdog(void) {}
"""

ONE = """
#include <stdio.h>
#include "tauperp.h"
BLOCK
void run_NUMERIC(void);
void run_NUMERIC(void) {
    static tauperp_guard_t guard;
    static tauperp_output_t out;
    const uint32_t status = tauperp_init(&guard, tauperp_block, sizeof tauperp_block, TAUPERP_START_POWER_ON, 0, 0);
    for (uint64_t now_us = 0; now_us < 3000000u; now_us += 2000u) {
        if (tauperp_is_due(&guard, now_us)) { tauperp_tick(&guard, now_us, &out); }
    }
    const uint32_t refused = tauperp_init(&guard, tauperp_block, 8u, TAUPERP_START_POWER_ON, 0, 0);
    printf("NUMERIC %u %u %u %d %u\\n", status, out.state, out.reason, out.permitted, refused);
}
"""
BOTH = "void run_float(void); void run_fixed(void); int main(void) { run_float(); run_fixed(); return 0; }\n"


def _run(command: list[str | Path], folder: Path) -> str:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # CMake may be that of .venv alone
    environment = os.environ | {"PATH": path}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, f"{command}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A foreign project that uses the firmware, built. Returns its build folder."""
    folder = tmp_path_factory.mktemp("foreign")
    for name, numeric in BLOCKS.items():
        block = folder / f"block_{name}.c"
        assert main(["config", "default", "--robot", "panda", "--numeric", numeric, "-o", str(block)]) == 0
        array = re.sub(r"^extern.*$|^const size_t.*$", "", block.read_text(), flags=re.MULTILINE)
        one = ONE.replace("BLOCK", array.replace("const uint32_t", "static const uint32_t")).replace("NUMERIC", name)
        (folder / f"one_{name}.c").write_text(one)
    (folder / "both.c").write_text(BOTH)
    (folder / "board.c").write_text(BOARD)
    (folder / "CMakeLists.txt").write_text(PROJECT)
    _run(["cmake", "-S", folder, "-B", folder / "build", "-DCMAKE_BUILD_TYPE=Release"], folder)
    _run(["cmake", "--build", folder / "build", "--parallel", "2"], folder)
    return folder / "build"


def test_the_example_runs_against_a_silent_bus_and_permits_nothing(foreign: Path) -> None:
    stops, others, permissions = map(int, _run([foreign / "example"], foreign).split())
    assert stops > 500
    assert others > 0
    assert permissions == 0


def test_both_numeric_types_run_in_one_program(foreign: Path) -> None:
    waiting, sync, bad_size = 2, 3, 4
    lines = [f"{numeric} 1 {waiting} {sync} 0 {bad_size}" for numeric in BLOCKS]
    assert _run([foreign / "both"], foreign).splitlines() == lines


@pytest.mark.parametrize("numeric", list(BLOCKS))
def test_every_external_symbol_has_the_prefix(foreign: Path, numeric: str) -> None:
    """After a new function: tools/names2c."""
    symbols = _run(["nm", "--extern-only", "--defined-only", foreign / "tauperp" / f"libtauperp_{numeric}.a"], foreign)
    names = {line.split()[2] for line in symbols.splitlines() if len(line.split()) == 3}
    assert len(names) > 80
    assert [name for name in sorted(names) if not name.startswith(f"tauperp_{numeric}_")] == []


@pytest.mark.gate
def test_every_macro_of_the_public_header_has_the_prefix() -> None:
    defines = re.findall(r"^#define (\w+)", (FIRMWARE / "api" / "tauperp.h").read_text(), re.MULTILINE)
    assert [name for name in defines if not name.lower().startswith("tauperp_")] == []


@pytest.mark.parametrize("definition", [[], ["-DTAUPERP_FIXED=1"]], ids=["float", "fixed"])
def test_the_interface_and_the_example_build_without_a_warning(tmp_path: Path, definition: list[str]) -> None:
    rooms = [f"-I{FIRMWARE / room}" for room in ("core", "wire", "wire/generated", "guard", "schedule")]
    api = ["gcc", *STRICT, *definition, f"-I{FIRMWARE / 'api'}"]
    _run([*api, *rooms, "-O2", "-c", FIRMWARE / "api" / "api.c", "-o", tmp_path / "api.o"], tmp_path)
    _run([*api, "-O2", "-c", EXAMPLE, "-o", tmp_path / "example.o"], tmp_path)


@pytest.mark.needs("eigen")  # with it comes a C++ compiler
def test_the_header_is_valid_in_cpp_and_needs_no_other(tmp_path: Path) -> None:
    source = (
        '#include "tauperp.h"\nstatic tauperp_guard_t guard;\nbool due(void) { return tauperp_is_due(&guard, 0); }\n'
    )
    (tmp_path / "due.cpp").write_text(source)
    _run(["g++", "-Wall", "-Wextra", "-Werror", f"-I{FIRMWARE / 'api'}", "-c", "due.cpp", "-o", "due.o"], tmp_path)
    assert "tauperp_float_is_due" in _run(["nm", "--undefined-only", "due.o"], tmp_path)


@pytest.mark.needs("arm")
def test_a_foreign_project_builds_it_for_a_cortex_m(tmp_path: Path) -> None:
    (tmp_path / "CMakeLists.txt").write_text(PROJECT)
    cross = ["-DCMAKE_SYSTEM_NAME=Generic", "-DCMAKE_C_COMPILER=arm-none-eabi-gcc"]
    cross += [f"-DCMAKE_C_FLAGS={' '.join(CORTEX_M)}", "-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY"]
    _run(["cmake", "-S", tmp_path, "-B", tmp_path / "build", "-DTAUPERP_JOINTS=7", *cross], tmp_path)
    _run(["cmake", "--build", tmp_path / "build", "--parallel", "2"], tmp_path)
    _run(["arm-none-eabi-size", tmp_path / "build" / "tauperp" / "libtauperp_float.a"], tmp_path)
