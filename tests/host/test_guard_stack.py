"""The stack of the SocketCAN process at worst, by gcc's call graphs of all its functions. Recursion, a frame without
bound or a call through a pointer is an error (tools/bench/stack.py). Functions of libc are left out."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import BUILD, ROOT, make

sys.path.insert(0, str(ROOT / "tools" / "bench"))

from stack import CallGraph

FOLDERS = {
    "float": ("rooms-float.dir", "linux-float.dir", "second-objects.dir"),
    "fixed": ("rooms-fixed.dir", "linux-fixed.dir"),
}
PROGRAMS = {"float": ("guard", BUILD / "tauperp-guard"), "fixed": ("guard-fixed", BUILD / "fixed" / "tauperp-guard")}
KNOWN = {"float": 17_040, "fixed": 17_040}  # bytes of loop_run, by gcc 12; deepest: bus_receive
MOST = 1.01
TOUCH = "main.c:touch_stack"  # its frame is mapped and locked before the loop starts
FOR_LIBC = 64 * 1024  # of that frame


def call_graph(numeric: str, defined: set[str]) -> CallGraph:
    def of_libc(name: str) -> int:
        if name in defined:
            raise ValueError(f"{name} has no call graph")
        return 0

    graph = CallGraph(of_libc)
    for folder in FOLDERS[numeric]:
        for path in sorted((BUILD / "cmake" / "host" / "CMakeFiles" / folder).glob("**/*.ci")):
            graph.read(path)
    return graph


def defined_functions(program: Path) -> set[str]:
    command = ["nm", "--defined-only", str(program)]
    rows = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return {row.split()[2] for row in rows if row.split()[1] in "tT"}


def compiler(program: Path) -> int:
    """Version of the gcc that compiled it; 0: another compiler."""
    found = re.search(rb"GCC: \([^)]*\) (\d+)", program.read_bytes())
    return int(found[1]) if found else 0


@pytest.mark.parametrize("numeric", KNOWN)
def test_the_stack_of_the_process_is_bounded_and_has_not_grown(numeric: str) -> None:
    goal, program = PROGRAMS[numeric]
    make(goal)
    version = compiler(program)
    if version < 10:
        pytest.skip("optional: call graphs are of gcc 10 or newer")
    graph = call_graph(numeric, defined_functions(program))
    (touched,) = (size for name, size in graph.frames.items() if name.endswith(TOUCH))
    assert graph.worst("main") >= touched
    needed = graph.worst("loop_run")
    assert needed <= touched - FOR_LIBC
    assert version != 12 or KNOWN[numeric] / MOST <= needed <= KNOWN[numeric] * MOST
