"""The checkout under test: its builds, and the tools of the machine."""

import fcntl
import functools
import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build"
REFUSED = "cannot run, and with CI=true every test must run: {}"


def ci_accepts(reason: str) -> bool:
    """Whether a test may be skipped for this reason. With CI=true only for a reason that is named optional."""
    return os.environ.get("CI") not in ("true", "1") or reason.startswith("optional:")


def make(*arguments: str, check: bool = True) -> subprocess.CompletedProcess[str]:
    """`make` in the checkout, one at a time. If it fails, the failure contains its output."""
    BUILD.mkdir(parents=True, exist_ok=True)
    # The options of an outer make do not apply to this one.
    environment = {
        name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")
    }
    with open(BUILD / "make.lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = subprocess.run(
            ["nice", "make", "-C", str(ROOT), "--no-print-directory", *arguments],  # the bus tests run in real time
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            env=environment,
        )
    assert done.returncode == 0 or not check, done.stdout[-4000:]
    return done


def rows(kind: str) -> list[str]:
    """The names of the processors or boards in cmake/table.cmake."""
    table = (ROOT / "cmake" / "table.cmake").read_text(encoding="utf-8")
    return re.findall(rf"^tauperp_{kind}\((\w+)", table, re.MULTILINE)


@functools.cache
def missing(tool: str) -> str:
    """Why tools/toolbox cannot provide this tool, in one line; empty if it can."""
    done = subprocess.run(
        [str(ROOT / "tools" / "toolbox"), tool],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines() or ["tools/toolbox failed"]
    return f"no {tool}: {lines[-1].removeprefix('toolbox: ')}"


def lacking(item: pytest.Item) -> str:
    """Why a tool of the item's marker `needs` is missing, in one line; empty if no tool is missing."""
    tools = [tool for marker in item.iter_markers("needs") for tool in marker.args]
    return next((missing(tool) for tool in tools if missing(tool)), "")
