"""Static checks of the firmware by clang-tidy (PyPI: clang-tidy).

    make tidy [ARGUMENTS="--build float"]

.clang-tidy lists the checks, with the reason for each that is off. Every finding fails. A finding that has to stay has
a comment at its line with the check's name and the reason:

    /* NOLINTNEXTLINE(misc-use-internal-linkage): why the code is right. */

A NOLINT without a check or without a reason fails, too. There are three builds: the library, its process and its
examples in float32 and in Q9.22, as build/cmake/host compiles them (compile_commands.json); and the boards, as clang
compiles them for their processor. Generated code is checked as well.
"""

import argparse
import importlib.util
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
DATABASE = ROOT / "build" / "cmake" / "host" / "compile_commands.json"
OUT = ROOT / "out" / "tidy"
ROOMS = ("core", "wire", "wire/generated", "guard", "schedule", "pair", "boards/common")
PROCESSORS = {
    "stm32g4": ("-mcpu=cortex-m4", "-mfloat-abi=hard", "-mthumb"),
    "versal_r5": ("-mcpu=cortex-r5", "-mfloat-abi=hard", "-mthumb"),
}
BOARD = ("clang", "--target=arm-none-eabi", "-std=c11", "-ffreestanding", "-DROBOT_JOINTS=7u", "-DTAUPERP_CHANNELS=2")
IDENTITY = ("-DTAUPERP_CONFIG_CRC=0u", "-DTAUPERP_BUILD_ID=0u", '-DTAUPERP_BOARD="board"')
BUILDS = ("float", "fixed", "boards")
# clang's own warnings are the business of `make lint-clang`. gcc's attributes are unknown to it.
PLAIN = ("-Wno-everything",)
OF_GCC = ("-Werror", "-fcallgraph-info=su")  # clang has other warnings, and no call graphs
FINDING = re.compile(r"^(\S+?):(\d+):(\d+): (?:warning|error): (.*) \[([\w.,-]+),-warnings-as-errors\]$", re.MULTILINE)
NOLINT = re.compile(r"NOLINT(?:NEXTLINE|BEGIN|END)?(?P<checks>\([\w.,-]+\))?(?P<rest>[^\n]*)")
Command = dict[str, str | list[str]]  # an entry of compile_commands.json


def of_the_host(numeric: str) -> list[Command]:
    """One command for each file of firmware/ that the host compiles in this numeric type, without -Werror."""
    chosen: dict[str, Command] = {}
    for entry in json.loads(DATABASE.read_text(encoding="utf-8")):
        words = [word for word in entry["command"].split() if word not in OF_GCC]
        is_fixed = "-DTAUPERP_FIXED=1" in words
        file = Path(entry["file"])
        if file.suffix == ".c" and FIRMWARE in file.parents and is_fixed == (numeric == "fixed"):
            chosen.setdefault(
                entry["file"], {"directory": entry["directory"], "file": entry["file"], "arguments": [*words, *PLAIN]}
            )
    return [entry for name, entry in sorted(chosen.items()) if not is_for_boards(Path(name))]


def is_for_boards(file: Path) -> bool:
    return FIRMWARE / "boards" in file.parents


def of_the_boards() -> list[Command]:
    """The boards' own files. Those of boards/common are compiled for the first board."""
    includes = [f"-I{FIRMWARE / room}" for room in ROOMS]
    found: list[Command] = []
    for number, (board, processor) in enumerate(PROCESSORS.items()):
        folders = [FIRMWARE / "boards" / board, *([FIRMWARE / "boards" / "common"] if number == 0 else [])]
        for file in sorted(file for folder in folders for file in folder.glob("*.c")):
            words = [*BOARD, *processor, *IDENTITY, *includes, f"-I{FIRMWARE / 'boards' / board}", *PLAIN]
            found.append({"directory": str(ROOT), "file": str(file), "arguments": [*words, "-c", str(file)]})
    return found


def without_reason(files: list[Path]) -> list[str]:
    """Every NOLINT that names no check, and every one that begins without a reason."""
    wrong = []
    for file in files:
        text = file.read_text(encoding="utf-8")
        for comment in NOLINT.finditer(text):
            words = re.findall(r"[A-Za-z]{2,}", comment["rest"])
            if not comment["checks"] or (len(words) < 4 and "NOLINTEND" not in comment[0]):
                line = text.count("\n", 0, comment.start()) + 1
                wrong.append(f"{file.relative_to(ROOT)}:{line}: NOLINT needs a check in brackets and a reason")
    return wrong


def check(build: str, jobs: int) -> tuple[int, set[str]]:
    """How many files, and the findings in them and in their headers."""
    place = importlib.util.find_spec("clang_tidy")
    if place is None or place.origin is None:
        sys.exit("tidy: there is no clang-tidy in .venv: make venv")
    program = Path(place.origin).parent / "data" / "bin" / "clang-tidy"
    commands = of_the_boards() if build == "boards" else of_the_host(build)
    folder = OUT / build
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "compile_commands.json").write_text(json.dumps(commands, indent=1), encoding="utf-8")

    def one(file: str) -> subprocess.CompletedProcess[str]:
        options = ["--quiet", "--warnings-as-errors=*", "-p", str(folder)]
        return subprocess.run([program, *options, file], cwd=ROOT, capture_output=True, text=True, check=False)

    findings: set[str] = set()
    with ThreadPoolExecutor(jobs) as pool:
        for command, done in zip(commands, pool.map(one, [str(entry["file"]) for entry in commands]), strict=True):
            said = FINDING.findall(done.stdout)
            name = os.path.relpath
            findings |= {f"{name(file, ROOT)}:{line}: {text} [{rule}]" for file, line, _, text, rule in said}
            if done.returncode != 0 and not said:
                sys.exit(f"clang-tidy ends with {done.returncode} on {command['file']}:\n{done.stdout}{done.stderr}")
    return len(commands), findings


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", choices=BUILDS, action="append", help="this build only")
    parser.add_argument("--jobs", type=int, default=int(os.environ.get("JOBS", "2")))
    arguments = parser.parse_args()
    if subprocess.run([ROOT / "tools" / "build", "tauperp_build_id"], check=False).returncode != 0:
        return 1
    wrong = without_reason(sorted(FIRMWARE.rglob("*.[ch]")))
    files = 0
    for build in arguments.build or BUILDS:
        count, findings = check(build, arguments.jobs)
        files += count
        wrong += sorted(f"{build}: {finding}" for finding in findings)
    print("\n".join([*wrong, f"{files} files by clang-tidy, {len(wrong)} findings"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
