"""Structural coverage of the firmware by its unit tests: lines, regions, branches and MC/DC, by clang 19.

    make coverage [ARGUMENTS="--numeric float"]

Each numeric type is a build and a verdict of its own: what float32 reaches does not count for Q9.22. Inside one build
the copies of an inline function in several files count as one. A condition counts as shown where one copy shows it.
The second channel of the float build is not instrumented again, because it is the fixed build; only pair/second.c is,
which nothing else compiles.

Code that is not reached is a failure, unless a comment above its line explains it:

    /* Uncovered in fixed: 1 region, 2 branches. Why no input can reach it. */

`both` means both numeric types, `in both, 4 lines` that number of lines. The counts are exact: a second gap on the
same line fails, and so does a comment whose gap is closed. A region is what clang counts between two branches: a missed
line has a missed region. Code that only the second channel compiles (projection.c) is not counted.
The report is out/coverage/report.md.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ROOT / "build" / "cmake" / "coverage" / "python" / "unit"
REPORT = ROOT / "out" / "coverage" / "report.md"
ROOMS = ("core", "wire", "guard", "schedule", "pair", "robot_side")
NUMERICS = ("float", "fixed")
# The second channel of the float build is in Q9.22; the fixed build measures its arithmetic.
ELSEWHERE = {"float": "firmware/core/num_fixed.h", "fixed": "firmware/core/num_float.h"}
PLURALS = {"region": "regions", "branch": "branches", "condition": "conditions"}
MEASURED = re.compile(rf"firmware/(?:{'|'.join(ROOMS)})/[^/]+\.[ch]")
EXCLUSION = re.compile(
    r"/\* Uncovered in (float|fixed|both)(?:, (\d+) lines)?: "
    r"((?:\d+ (?:region|branch|condition)(?:e?s)?(?:, )?)+)\.\s(.{20,}?)\*/",
    re.DOTALL,
)
COUNT = re.compile(r"(\d+) (region|branch|condition)")
CODE = re.compile(r"\s*(?:/\*.*?\*/\s*|\n)*", re.DOTALL)

Place = tuple[str, int, int, int, int]  # file, from line and column, to line and column
Line = tuple[str, int, str]  # file, line, kind


def run(*command: str | Path) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))[:400]}\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    return done.stdout


@dataclass
class Coverage:
    """How often each region ran, how often each branch went either way, which conditions showed their effect."""

    regions: Counter[Place] = field(default_factory=Counter)
    branches: dict[Place, list[int]] = field(default_factory=lambda: defaultdict(lambda: [0, 0]))
    decisions: dict[Place, list[bool]] = field(default_factory=dict)
    lines: dict[str, tuple[int, int]] = field(default_factory=dict)  # of each file: all, missed

    def add(self, function: dict[str, Any]) -> None:
        """One function of `llvm-cov export`."""
        files = [name.removeprefix(f"{ROOT}/") for name in function["filenames"]]
        if not MEASURED.fullmatch(files[0]):
            return
        for *at, count, file, _, kind in function["regions"]:
            if kind == 0:
                self.regions[(files[file], *at)] += count
        for *at, true, false, file, _, _ in function["branches"]:
            both = self.branches[(files[file], *at)]
            both[0] += true
            both[1] += false
        for *at, file, _, shown in function["mcdc_records"]:
            place = (files[file], *at)
            before = self.decisions.get(place, [False] * len(shown))
            self.decisions[place] = [a or b for a, b in zip(before, shown, strict=True)]

    def places(self) -> Iterator[tuple[str, Place, int, int]]:
        """Kind, place, how many there are, how many of them are missed."""
        for place, count in self.regions.items():
            yield "region", place, 1, int(count == 0)
        for place, both in self.branches.items():
            yield "branch", place, 2, both.count(0)
        for place, shown in self.decisions.items():
            yield "condition", place, len(shown), shown.count(False)


def measure(numeric: str, jobs: int) -> Coverage:
    """Runs every unit test of the numeric type. One that fails is an error."""
    folder = PROGRAMS / numeric
    tests = sorted((ROOT / "tests" / "unit").glob("test_*.c"))
    programs = [folder / test.stem for test in tests]
    failed: list[str] = []
    for old in folder.glob("*.profraw"):
        old.unlink()

    def run_one(program: Path) -> None:
        environment = os.environ | {"LLVM_PROFILE_FILE": f"{program}.profraw"}
        done = subprocess.run([program], capture_output=True, text=True, check=False, cwd=ROOT, env=environment)
        if done.returncode != 0:
            failed.append(f"{program.name} ends with {done.returncode}:\n{done.stdout[-4000:]}{done.stderr[-4000:]}")

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(run_one, programs))
    if failed:
        sys.exit("\n".join(failed))
    profile = folder / "all.profdata"
    run("llvm-profdata-19", "merge", "-o", profile, *(f"{program}.profraw" for program in programs))
    objects = [part for program in programs[1:] for part in ("-object", program)]
    rooms = [ROOT / "firmware" / room for room in ROOMS]
    exported = json.loads(run("llvm-cov-19", "export", "-instr-profile", profile, programs[0], *objects, *rooms))
    coverage = Coverage()
    for function in exported["data"][0]["functions"]:
        coverage.add(function)
    for file in exported["data"][0]["files"]:
        lines = file["summary"]["lines"]
        coverage.lines[file["filename"].removeprefix(f"{ROOT}/")] = lines["count"], lines["count"] - lines["covered"]
    return coverage


@dataclass(frozen=True)
class Exclusion:
    file: str
    lines: range
    numerics: tuple[str, ...]
    missed: dict[str, int]
    reason: str


def exclusions(files: Iterable[Path]) -> list[Exclusion]:
    """The comments that explain a gap. A line of code with one is the first below it."""
    found = []
    for file in files:
        text = file.read_text(encoding="utf-8")
        for comment in EXCLUSION.finditer(text):
            skipped = CODE.match(text, comment.end())
            line = text.count("\n", 0, skipped.end() if skipped else comment.end()) + 1
            numerics = NUMERICS if comment[1] == "both" else (comment[1],)
            missed = {kind: int(count) for count, kind in COUNT.findall(comment[3])}
            reason = " ".join(comment[4].split())
            lines = range(line, line + int(comment[2] or 1))
            found.append(Exclusion(str(file.relative_to(ROOT)), lines, numerics, missed, reason))
        if text.count("Uncovered in") != sum(str(file.relative_to(ROOT)) == one.file for one in found):
            sys.exit(f"{file}: an `Uncovered in` that tools/coverage/coverage.py cannot read")
    return found


def judge(numeric: str, coverage: Coverage, explained: list[Exclusion]) -> tuple[list[str], dict[str, Counter[str]]]:
    """What is missed without an explanation or explained without a miss; and the totals of each file."""
    missed: Counter[Line] = Counter()
    totals: dict[str, Counter[str]] = defaultdict(Counter)
    for kind, place, count, absent in coverage.places():
        if MEASURED.fullmatch(place[0]) and place[0] != ELSEWHERE[numeric]:
            totals[place[0]][kind] += count
            totals[place[0]][f"{kind} missed"] += absent
            missed[(place[0], place[1], kind)] += absent
    for file, row in totals.items():
        row["line"], row["line missed"] = coverage.lines[file]
    wrong = []
    for one in explained:
        for kind in PLURALS if numeric in one.numerics else ():
            absent = sum(missed.pop((one.file, line, kind), 0) for line in one.lines)
            if absent != one.missed.get(kind, 0):
                said = f"{one.missed.get(kind, 0)} {kind} explained, {absent} missed"
                wrong.append(f"{numeric}: {one.file}:{one.lines[0]}: {said}")
    for (file, line, kind), absent in sorted(missed.items()):
        if absent:
            code = (ROOT / file).read_text(encoding="utf-8").splitlines()[line - 1].strip()
            wrong.append(f"{numeric}: {file}:{line}: {absent} {kind} missed: {code}")
    return wrong, totals


def table(totals: dict[str, Counter[str]]) -> list[str]:
    kinds = ("line", *PLURALS)
    rows = ["| file | lines | regions | branches | conditions (MC/DC) |", "|---|---|---|---|---|"]
    whole: Counter[str] = Counter()
    for row in totals.values():
        whole.update(row)
    for name, row in [*sorted(totals.items()), ("all", whole)]:
        reached = (f"{row[kind] - row[f'{kind} missed']} of {row[kind]}" for kind in kinds)
        rows.append(f"| {name.removeprefix('firmware/')} | {' | '.join(reached)} |")
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--numeric", choices=NUMERICS, action="append", help="one numeric type only")
    parser.add_argument("--jobs", type=int, default=int(os.environ.get("JOBS", "2")))
    arguments = parser.parse_args()
    if subprocess.run([ROOT / "tools" / "toolbox", "clang19"], check=False).returncode != 0:
        return 1
    numerics = arguments.numeric or NUMERICS
    goals = [f"coverage-programs-{numeric}" for numeric in numerics]
    if subprocess.run([ROOT / "tools" / "build", *goals], check=False).returncode != 0:
        return 1
    sources = [file for room in ROOMS for file in sorted((ROOT / "firmware" / room).glob("*.[ch]"))]
    explained = exclusions(sources)
    wrong: list[str] = []
    page = [
        "# Structural coverage by the unit tests",
        "",
        "`make coverage`; every number is what was reached of how many.",
    ]
    for numeric in numerics:
        found, totals = judge(numeric, measure(numeric, arguments.jobs), explained)
        rows = table(totals)
        print(f"{numeric}: lines, regions, branches, conditions: {rows[-1].removeprefix('| all').strip(' |')}")
        page += ["", f"## {numeric}", "", *rows]
        wrong += found
    page += ["", "## Not reached, with the reason", ""]
    page += [f"- {one.file}:{one.lines[0]} ({' and '.join(one.numerics)}): {one.reason}" for one in explained]
    page += ["", "## Not reached, without one", "", *(f"- {line}" for line in wrong)]
    REPORT.parent.mkdir(parents=True, exist_ok=True)
    REPORT.write_text("\n".join(page) + "\n", encoding="utf-8")
    print("\n".join([*wrong, f"{len(explained)} explained gaps, {len(wrong)} others: {REPORT.relative_to(ROOT)}"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
