"""pytest collects the unit tests of the firmware: each test function of tests/unit/test_*.c, in both numeric types.

A file is one Unity program, linked with the whole firmware under the address and undefined-behaviour sanitizers. All
programs of a session are built when the first test is due. Each is run once; every test then has its own verdict. A
program that does not build, crashes or hangs fails each test without a verdict. A test function that is never run
fails too.
"""

import functools
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from checkout import BUILD, ROOT, make

NUMERICS = ("float", "fixed")
TIMEOUT_S = 600
VERDICT = re.compile(r"^[^\n:]*:\d+:(\w+):(PASS|FAIL|IGNORE)", re.MULTILINE)
WRITTEN = re.compile(r"^(?:static\s+)?void\s+(test_\w+)\s*\(\s*void\s*\)\s*\{", re.MULTILINE)


wanted: set[str] = set()  # the programs of this session, below build


@functools.cache
def build_wanted() -> bool:
    """Builds all programs of the session at once: looking at each one alone takes longer than running it."""
    command = ["nice", ROOT / "tools" / "build", "-k", *sorted(wanted)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode == 0


@functools.cache
def verdicts(program: str, numeric: str) -> tuple[dict[str, str], str]:
    """The verdict on each test of the program, and the output of a failure."""
    path = BUILD / "unit" / numeric / program
    if not build_wanted():
        built = make(str(path.relative_to(ROOT)), check=False)
        if built.returncode != 0:
            return {}, f"{program} does not build:\n{built.stdout[-4000:]}"
    try:
        done = subprocess.run(
            [path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT_S, cwd=ROOT, check=False
        )
    except subprocess.TimeoutExpired as error:
        output = (error.stdout or b"").decode(errors="replace")
        return dict(VERDICT.findall(output)), f"{program} still runs after {TIMEOUT_S} s:\n{output[-4000:]}"
    output = done.stdout.decode(errors="replace")
    found = dict(VERDICT.findall(output))
    if done.returncode != 0 and "FAIL" not in found.values():
        return {}, f"{program} ended with {done.returncode}:\n{output[-4000:]}"
    return found, output


class UnityFailure(Exception):
    """What the program printed."""


class UnityItem(pytest.Item):
    def __init__(self, *, test: str, numeric: str, **more: object) -> None:
        super().__init__(name=f"{test}[{numeric}]", **more)  # type: ignore[arg-type]
        self.test, self.numeric = test, numeric

    def runtest(self) -> None:
        found, output = verdicts(self.path.stem, self.numeric)
        verdict = found.get(self.test, "is written but has no verdict")
        if verdict != "PASS":
            lines = [line for line in output.splitlines() if f":{self.test}:" in line]
            raise UnityFailure(f"{self.test} {verdict}\n" + "\n".join(lines or [output]))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None) -> str:
        if isinstance(excinfo.value, UnityFailure):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.path, None, self.name


class UnityFile(pytest.File):
    def collect(self) -> Iterator[pytest.Item]:
        names = WRITTEN.findall(self.path.read_text(encoding="utf-8"))
        if not names:
            raise self.CollectError(f"{self.path.name}: no test in it")
        for numeric in NUMERICS:
            for name in names:
                yield UnityItem.from_parent(self, test=name, numeric=numeric)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    if file_path.parent == ROOT / "tests" / "unit" and file_path.match("test_*.c"):
        return UnityFile.from_parent(parent, path=file_path)
    return None


def pytest_collection_finish(session: pytest.Session) -> None:
    for item in session.items:
        if isinstance(item, UnityItem):
            wanted.add(f"build/unit/{item.numeric}/{item.path.stem}")
