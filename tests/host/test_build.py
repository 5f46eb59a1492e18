"""The build: every preset configures, a change recompiles only what depends on it, a new board is a folder and one row,
and CMake may come from the environment."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT, rows

from tauperp.config import load_configuration

BIN = Path(sys.executable).parent
HOST_PRESETS = ("host", "sanitizers")


def run(command: list[str | Path], folder: Path, **environment: str) -> str:
    path = f"{BIN}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "PATH": path, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{command}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of all files that the build of the firmware reads."""
    folder = tmp_path_factory.mktemp("checkout")
    for name in ("firmware", "cmake", "tools"):
        shutil.copytree(ROOT / name, folder / name)
    for name in ("CMakeLists.txt", "CMakePresets.json", "Makefile"):
        shutil.copy(ROOT / name, folder)
    (folder / "dbc").mkdir()
    shutil.copy(ROOT / "dbc" / "tauperp.dbc", folder / "dbc")
    return folder


def configures(preset: str, folder: Path) -> list[str]:
    """The files that the preset's compile_commands.json names."""
    run(["cmake", "--preset", preset, "-B", folder], ROOT)
    return [entry["file"] for entry in json.loads((folder / "compile_commands.json").read_text())]


@pytest.mark.parametrize("preset", HOST_PRESETS)
def test_a_preset_for_this_machine_configures_and_lists_its_commands(preset: str, tmp_path: Path) -> None:
    assert str(ROOT / "firmware" / "core" / "motion.c") in configures(preset, tmp_path / "build")


@pytest.mark.needs("arm")
@pytest.mark.parametrize("preset", rows("processor"))
def test_each_processor_of_the_table_has_a_preset(preset: str, tmp_path: Path) -> None:
    assert str(ROOT / "firmware" / "core" / "motion.c") in configures(preset, tmp_path / "build")


def test_a_change_of_a_core_file_compiles_what_depends_on_it(checkout: Path) -> None:
    folder = checkout / "build" / "cmake" / "host"
    run(["tools/build", "library"], checkout)

    def compiled_after_touching(name: str) -> set[str]:
        (checkout / "firmware" / "core" / name).touch()
        said = run(["ninja", "-C", folder, "library"], checkout)
        return {Path(object_file).stem for object_file in re.findall(r"Building C object (\S+)", said)}

    users = {
        path.stem for path in (checkout / "firmware").rglob("*.c") if '"soft.h"' in path.read_text(encoding="utf-8")
    }
    assert compiled_after_touching("soft.c") == {"soft"}
    with_header = compiled_after_touching("soft.h")
    assert {"soft", *users} - {"controller", "minimal"} <= with_header
    assert {"crc32", "e2e", "vec3", "motion", "robot_side"} & with_header == set()
    assert compiled_after_touching("../../CMakePresets.json") == set()


@pytest.mark.needs("arm")
def test_a_new_board_is_its_folder_and_one_row(checkout: Path, tmp_path: Path) -> None:
    boards = checkout / "firmware" / "boards"
    shutil.copytree(boards / "stm32g4", boards / "mine")
    (boards / "mine" / "stm32g4.ld").rename(boards / "mine" / "mine.ld")
    with open(checkout / "cmake" / "table.cmake", "a", encoding="utf-8") as table:
        table.write("tauperp_board(mine m4f 1)\n")
    block = tmp_path / "block.bin"
    block.write_bytes(load_configuration("default", robot="ku_dex").block())
    run([BIN / "python", "tools/firmware"], checkout, BOARD="mine", BLOCK=str(block), IMAGE="build/mine.elf")
    assert b"mine\0" in (checkout / "build" / "mine.elf").read_bytes()


def test_a_machine_without_cmake_uses_that_of_the_environment(checkout: Path, tmp_path: Path) -> None:
    for name in ("sh", "env", "gcc", "cc", "ld", "as", "ar", "ranlib", "python3"):
        (tmp_path / name).symlink_to(sys.executable if name == "python3" else shutil.which(name) or "/missing")
    shutil.rmtree(checkout / "build" / "cmake" / "host", ignore_errors=True)
    run(["tools/build", "declarations-fixed"], checkout, PATH=str(tmp_path), VENV=str(BIN.parent))
    cache = (checkout / "build" / "cmake" / "host" / "CMakeCache.txt").read_text()
    for name in ("CMAKE_COMMAND", "CMAKE_MAKE_PROGRAM"):
        (tool,) = re.findall(rf"^{name}:\w+=(.*)$", cache, re.MULTILINE)
        assert Path(tool).is_relative_to(BIN.parent)
