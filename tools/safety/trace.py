#!/usr/bin/env python3
"""Requirement to code to test to result: checks docs/safety/requirements.toml and writes docs/safety/requirements.md.

    trace.py                      writes the page
    trace.py --check              one line for each gap, and for a page that is not current; exit code 1
    trace.py --results FILE.xml   prints the page with the results of that run (JUnit)

A gap is: a requirement without a hazard, code or test; a hazard without a requirement; a function or test that does not
exist; a test that no program runs; a reason of StopCommand that no requirement names; a source of the firmware that
neither a requirement nor a row of those that only inform names; with results, a test that did not run or failed.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

from tauperp.files import repository_root
from tauperp.wire_values import Reason

ROOT = repository_root()
FOLDER = ROOT / "docs" / "safety"
PAGE = FOLDER / "requirements.md"
SOURCES = ("core", "wire", "guard", "schedule", "pair", "robot_side", "boards/*", "hosts/linux")


@dataclass(frozen=True)
class Requirement:
    """One row of requirements.toml."""

    id: str
    text: str
    hazards: list[str]
    code: list[str]
    tests: list[str]
    reasons: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Informs:
    """Sources on which no requirement depends, and what they do."""

    files: list[str]
    reason: str


def read_informs(path: Path = FOLDER / "requirements.toml") -> list[Informs]:
    return [Informs(**row) for row in tomllib.loads(path.read_text(encoding="utf-8"))["informs"]]


def read(path: Path = FOLDER / "requirements.toml") -> list[Requirement]:
    return [Requirement(**row) for row in tomllib.loads(path.read_text(encoding="utf-8"))["requirement"]]


def hazards(path: Path = FOLDER / "hazards.md") -> list[str]:
    """Ids of the first column of the hazard list."""
    return re.findall(r"^\| (H-\d+) \|", path.read_text(encoding="utf-8"), re.MULTILINE)


def defines(reference: str, root: Path = ROOT) -> bool:
    """Whether `file:name` names a function or test of that file."""
    name, _, function = reference.partition(":")
    path = root / name
    if not path.is_file():
        return False
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return re.search(rf"^\s*def {re.escape(function)}\(", text, re.MULTILINE) is not None
    if function.startswith("test_") and f"RUN_TEST({function})" not in text:
        return False
    # A definition ends its line of parameters with a brace; a declaration ends with a semicolon.
    return re.search(rf"^[a-zA-Z_][^;={{}}]*\b{re.escape(function)}\([^;{{}}]*\) \{{", text, re.MULTILINE) is not None


def untraced(requirements: list[Requirement], informs: list[Informs], root: Path = ROOT) -> list[str]:
    """The sources that neither a requirement nor a row of `informs` names, or both; and rows without their source."""
    named = {reference.partition(":")[0] for requirement in requirements for reference in requirement.code}
    other = {name for row in informs for name in row.files}
    sources = {str(file.relative_to(root)) for room in SOURCES for file in (root / "firmware").glob(f"{room}/*.c")}
    lines = [f"{name}: no requirement" for name in sorted(sources - named - other)]
    lines += [f"{name}: both in a requirement and among those that only inform" for name in sorted(named & other)]
    return lines + [f"{name}: does not exist" for name in sorted(other - sources)]


def gaps(requirements: list[Requirement], known_hazards: list[str], root: Path = ROOT) -> list[str]:
    """The gaps from requirements to hazards, code, tests and reasons, one line each."""
    lines = []
    ids = [requirement.id for requirement in requirements]
    lines += [f"{name}: twice" for name in sorted({name for name in ids if ids.count(name) > 1})]
    for requirement in requirements:
        for kind in ("hazards", "code", "tests"):
            if not getattr(requirement, kind):
                lines.append(f"{requirement.id}: no {kind}")
        lines += [f"{requirement.id}: no hazard {name}" for name in requirement.hazards if name not in known_hazards]
        lines += [
            f"{requirement.id}: {reference} does not exist"
            for reference in (*requirement.code, *requirement.tests)
            if not defines(reference, root)
        ]
    met = {name for requirement in requirements for name in requirement.hazards}
    lines += [f"{name}: no requirement" for name in known_hazards if name not in met]
    named = {name for requirement in requirements for name in requirement.reasons}
    lines += [f"reason {reason.name}: no requirement" for reason in Reason if reason.name not in named]
    lines += [f"reason {name}: not in the DBC" for name in sorted(named - {reason.name for reason in Reason})]
    return lines


def results(path: Path) -> dict[str, str]:
    """passed, failed or skipped by `file:test`, of a JUnit file; the worst of a test's parameters. pytest drops .py
    from the name of a file, and keeps .c."""
    found: dict[str, str] = {}
    order = ["passed", "skipped", "failed"]
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        module, name = case.get("classname", ""), case.get("name", "").partition("[")[0]
        kinds = {child.tag for child in case}
        result = "failed" if kinds & {"failure", "error"} else "skipped" if "skipped" in kinds else "passed"
        file = module.removesuffix(".c").replace(".", "/") + (".c" if module.endswith(".c") else ".py")
        key = f"{file}:{name}"
        found[key] = max(found.get(key, "passed"), result, key=order.index)
    return found


def short(reference: str) -> str:
    return Path(reference).name.replace(":", " ")


def page(requirements: list[Requirement], informs: list[Informs], found: dict[str, str] | None = None) -> str:
    lines = [
        "# Requirements and their trace",
        "",
        "Written by `tools/safety/trace.py` from `docs/safety/requirements.toml`. A test fails on a gap.",
        "`make evidence` adds the result of each test.",
        "",
        "| id | requirement | hazards | code | tests | reasons |",
        "|---|---|---|---|---|---|",
    ]
    for requirement in requirements:
        code = ", ".join(f"`{short(reference)}`" for reference in requirement.code)
        tests = "<br>".join(
            f"`{short(reference)}`" + (f": {found.get(reference, 'not run')}" if found else "")
            for reference in requirement.tests
        )
        met, reasons = ", ".join(requirement.hazards), ", ".join(requirement.reasons)
        lines.append(f"| {requirement.id} | {requirement.text} | {met} | {code} | {tests} | {reasons} |")
    lines += ["", "## Sources that only inform", "", "Every other source of the firmware is in a row above.", ""]
    lines += ["| source | what it does |", "|---|---|"]
    for row in informs:
        lines.append(f"| {', '.join(f'`{name}`' for name in row.files)} | {row.reason} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--results", type=Path)
    arguments = parser.parse_args()
    requirements, informs = read(), read_informs()
    lines = gaps(requirements, hazards()) + untraced(requirements, informs)
    if arguments.results:
        found = results(arguments.results)
        for requirement in requirements:
            lines += [
                f"{requirement.id}: {reference} {found.get(reference, 'did not run')}"
                for reference in requirement.tests
                if found.get(reference) != "passed"
            ]
        print(page(requirements, informs, found), end="")
    elif arguments.check:
        if not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page(requirements, informs):
            lines.append("docs/safety/requirements.md is not current: tools/safety/trace.py")
    else:
        PAGE.write_text(page(requirements, informs), encoding="utf-8")
    for line in lines:
        print(line, file=sys.stderr)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
