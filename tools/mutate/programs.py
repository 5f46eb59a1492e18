"""The unit tests on instrumented sources: built once, then run under any number of mutants."""

import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from schemata import Mutant, Schemata, numeric_macros

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
BUILD = ROOT / "build" / "mutants"
TREE = BUILD / "tree"
COUNT = TREE / "mutant_count.h"
FIRMWARE = ROOT / "firmware"
MUTATED = ("core", "wire", "guard", "schedule")
INCLUDED = (*MUTATED, "wire/generated", "pair", "robot_side", "hosts/library")
FLAGS = [
    "-std=c11",
    "-O1",
    "-w",
    "-ffp-contract=off",
    "-fno-math-errno",
    # What the sanitizers of `make unit` find as well, here without their library: an instruction that traps.
    "-fsanitize=bounds,shift,signed-integer-overflow,integer-divide-by-zero,float-cast-overflow,builtin",
    "-fsanitize-undefined-trap-on-error",
    "-DTAUPERP_BUILD_ID=0u",
    "-DTAUPERP_CHANNELS=1",
]
NUMERICS: dict[str, list[str]] = {"float": [], "fixed": ["-DTAUPERP_FIXED=1"]}
OTHERS = ("test_board_", "test_fdcan", "test_linux_")  # these do not test a mutated source
JOBS = 2
CONTROL = 0  # number of the unmodified source


@dataclass(frozen=True)
class Test:
    """One test function of a program."""

    number: int
    name: str
    steps: int  # steps of loops without a mutant
    reaches: frozenset[int]


def run(command: list[object]) -> str:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{command[0]} failed:\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    return done.stdout


def instrument() -> list[Mutant]:
    """Writes the instrumented tree; returns its mutants. An unchanged file keeps its modification time."""
    files = [file for room in MUTATED for file in sorted((FIRMWARE / room).glob("*.[ch]"))]
    schemata = Schemata(numeric_macros([*files, *sorted((FIRMWARE / "wire" / "generated").glob("*.h"))]))
    texts = {file: schemata.instrument(str(file.relative_to(FIRMWARE)), file.read_text()) for file in files}
    folders = (FIRMWARE, *(ROOT / "tests" / name for name in ("unit", "robots")))
    wanted = {TREE / file.relative_to(ROOT): file for folder in folders for file in folder.rglob("*.[chS]")}
    for old in set(TREE.rglob("*.[chS]")) - {*wanted, COUNT}:
        old.unlink()
    for place, file in wanted.items():
        put(place, texts.get(file) or file.read_text())
    put(COUNT, f"#define MUTANT_COUNT {len(schemata.mutants)}\n")
    return schemata.mutants


def put(place: Path, text: str) -> None:
    if not place.exists() or place.read_text() != text:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)


class Programs:
    """All test programs in one numeric type. `sparser` divides the repetitions of random tests, as on an emulator.
    `quiet` programs do not note what they reach: they take as long to build again, but a third of the time to run."""

    def __init__(self, numeric: str, sparser: int, quiet: bool = False) -> None:
        self.numeric, self.sparser, self.quiet = numeric, sparser, quiet
        self.unity = Path(run([ROOT / "tools" / "toolbox", "unity"]).strip())
        self.names = [
            file.stem for file in sorted((TREE / "tests" / "unit").glob("test_*.c")) if not file.stem.startswith(OTHERS)
        ]

    def flags(self) -> list[object]:
        rooms = [f"-I{TREE / 'firmware' / room}" for room in INCLUDED]
        own = [
            f"-I{TREE}",
            f"-I{TREE / 'tests' / 'robots'}",
            f"-I{HERE}",
            "-isystem",
            self.unity,
            "-include",
            HERE / "mutant.h",
        ]
        return [*FLAGS, *NUMERICS[self.numeric], *(["-DMUTANT_QUIET"] if self.quiet else []), *rooms, *own]

    def built(self) -> dict[str, Path]:
        """The programs by name."""
        folder = BUILD / (f"{self.numeric}-quiet" if self.quiet else self.numeric)
        (folder / "object").mkdir(parents=True, exist_ok=True)
        sources = [file for room in INCLUDED for file in sorted((TREE / "firmware" / room).glob("*.c"))]
        sources.remove(TREE / "firmware" / "pair" / "second.c")  # only in a build of two channels
        sources += [*sorted((TREE / "tests" / "robots").glob("*.c")), HERE / "mutant_main.c", self.unity / "unity.c"]
        archive = folder / "firmware.a"
        headers = [*TREE.rglob("*.h"), *HERE.glob("mutant*"), HERE / "programs.py"]
        newest = max(file.stat().st_mtime for file in headers)

        def compiled(source: Path) -> Path:
            target = folder / "object" / f"{source.parent.name}-{source.stem}.o"
            if not target.exists() or target.stat().st_mtime < max(newest, source.stat().st_mtime):
                run(["gcc", *self.flags(), "-c", "-o", target, source])
            return target

        def linked(name: str) -> tuple[str, Path]:
            program = folder / f"{name}-{self.sparser}"
            dense = [f"-DSPARSER={self.sparser}"] if self.sparser > 1 else []
            sources = [TREE / "tests" / "unit" / f"{name}.c"]
            include = ["-include", HERE / "mutant_tests.h", f"-I{TREE / 'tests' / 'unit'}"]
            youngest = max(newest, archive.stat().st_mtime, sources[0].stat().st_mtime)
            if not program.exists() or program.stat().st_mtime < youngest:
                run(["gcc", *self.flags(), *dense, *include, "-o", program, *sources, archive, "-lm"])
            return name, program

        with ThreadPoolExecutor(JOBS) as pool:
            objects = list(pool.map(compiled, sources))
            if not archive.exists() or any(archive.stat().st_mtime < one.stat().st_mtime for one in objects):
                archive.unlink(missing_ok=True)
                run(["ar", "rcs", archive, *objects])
            return dict(pool.map(linked, self.names))

    @staticmethod
    def record(programs: dict[str, Path]) -> dict[str, list[Test]]:
        """What each test reaches, by program. Kept beside the program until that is built again."""

        def recorded(program: Path) -> str:
            kept = program.with_suffix(".reached")
            if not kept.exists() or kept.stat().st_mtime < program.stat().st_mtime:
                kept.write_text(run([program, "record"]))
            return kept.read_text()

        with ThreadPoolExecutor(JOBS) as pool:
            outputs = pool.map(recorded, programs.values())
        return {
            name: [test(line) for line in output.splitlines()] for name, output in zip(programs, outputs, strict=True)
        }


def test(line: str) -> Test:
    number, name, steps, failed, *reached = line.split()
    if failed != "0":
        raise SystemExit(f"{name} fails without a mutant")
    return Test(int(number), name, int(steps), frozenset(map(int, reached)))


def verdicts(program: Path, jobs: dict[int, list[Test]]) -> dict[int, tuple[str, Test]]:
    """How each mutant died, and of which of the tests given with it. They run in this order until one fails."""
    every = {one.number: one for tests in jobs.values() for one in tests}
    lines = [job(CONTROL, list(every.values()))] if jobs else []
    lines += [job(mutant, tests) for mutant, tests in jobs.items()]

    def share(part: int) -> str:
        done = subprocess.run([program], input="".join(lines[part::JOBS]), capture_output=True, text=True, check=True)
        return done.stdout

    with ThreadPoolExecutor(JOBS) as pool:
        answers = [line.split() for line in "".join(pool.map(share, range(JOBS))).splitlines()]
    died = {int(mutant): (end, every[int(last)]) for mutant, end, last in answers if end != "survived"}
    if CONTROL in died:
        raise SystemExit(f"{program.name} fails without a mutant")
    return died


def job(mutant: int, tests: list[Test]) -> str:
    return f"{mutant} {steps_limit(tests)} {' '.join(str(one.number) for one in tests)}\n"


def steps_limit(tests: list[Test]) -> int:
    """Loop steps after which a test hangs."""
    return 100_000 + 10 * max(test.steps for test in tests)
