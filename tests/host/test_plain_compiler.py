"""The firmware's sources build with a C compiler alone: without special flags and without a library."""

import subprocess
from pathlib import Path

import pytest

from tauperp.files import repository_root

PROGRAM = """
#include "guard.h"

int main(void) {
    static guard_t guard;
    guard_output_t output;
    guard_tick(&guard, 0, &output);
    return output.permitted ? 1 : 0;
}
"""
FOLDERS = ("firmware/core", "firmware/wire", "firmware/wire/generated", "firmware/guard")


@pytest.mark.parametrize("compiler", ["gcc", pytest.param("clang", marks=pytest.mark.needs("clang"))])
def test_a_program_links_without_libm(tmp_path: Path, compiler: str) -> None:
    root = repository_root()
    (tmp_path / "program.c").write_text(PROGRAM)
    sources = [str(file) for folder in FOLDERS for file in sorted((root / folder).glob("*.c"))]
    includes = [f"-I{root / folder}" for folder in FOLDERS]
    command = [compiler, "-std=c11", *includes, "program.c", *sources, "-o", "program"]
    built = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert built.returncode == 0, built.stderr[-500:]
    assert subprocess.run(tmp_path / "program", timeout=10, check=False).returncode == 0
