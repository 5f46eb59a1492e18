#!/usr/bin/env python3
"""mutate: checks that a unit test fails for each changed operator, constant and condition of the firmware.

    tools/mutate/mutate.py                 every mutant; a few minutes on two cores
    tools/mutate/mutate.py --sample 60     this many mutants of a fixed sample, as in CI
    tools/mutate/mutate.py --write         also writes new survivors to the list, as unreviewed

A mutant is killed by an assertion, a signal or the limit of loop steps, in either numeric type.
tests/mutation/survivors.toml lists the survivors with the reason why no test can detect or need detect them. Exit code
1: a survivor is not listed, a listed one is killed or gone, or (without --sample) one is unreviewed.
"""

import argparse
import fcntl
import json
import random
import sys
import tomllib
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from programs import BUILD, NUMERICS, ROOT, Programs, Test, instrument, verdicts
from schemata import Mutant

LIST = ROOT / "tests" / "mutation" / "survivors.toml"
KILLERS = BUILD / "killers.json"  # the test that killed a mutant the last time; saves time, decides nothing
BITS = "test_bits_"  # programs that compare with recorded bits
UNREVIEWED = "unreviewed"
FEW = 8  # tests: as many are tried first
LIKELY = 4  # tests that are tried first because they killed other mutants: of the function, of the file, of all
MANY = 400  # mutants: from here on a second build, which does not note what it reaches, saves more time than it takes
SEED = 4711
SPARSE = 100  # divides the repetitions of random tests, as on the emulated targets
HEAD = f"""# Mutants that no unit test kills, by file and function, with the reason.
# tools/mutate/mutate.py --write adds new ones; a person adds the reasons. "{UNREVIEWED}" fails `make mutants`.
"""


class Judge:
    """Runs the tests of all programs on mutants, until each is killed or no test is left."""

    def __init__(self, mutants: list[Mutant], wanted: set[int], near_only: bool) -> None:
        self.keys = {mutant.number: mutant.key for mutant in mutants}
        self.sources = {mutant.number: Path(mutant.file).stem for mutant in mutants}
        self.alive, self.how, self.near_only = set(wanted), Counter[str](), near_only
        self.killers: dict[str, list[str]] = json.loads(KILLERS.read_text()) if KILLERS.exists() else {}
        self.programs: dict[str, dict[str, Path]] = {}
        self.reached: dict[str, dict[str, list[Test]]] = {}

    def prepare(self, numeric: str) -> bool:
        """Builds the programs if a mutant is left for them."""
        if self.alive and numeric not in self.reached:
            recording = Programs(numeric, SPARSE).built()
            self.reached[numeric] = Programs.record(recording)
            many = len(self.alive) > MANY
            self.programs[numeric] = Programs(numeric, SPARSE, quiet=True).built() if many else recording
        return bool(self.alive)

    def run(self) -> None:
        """The likeliest killers first. Recorded bits say least, so that a mutant's own tests come before them."""
        for numeric in NUMERICS:
            last = {self.killers.get(self.keys[mutant], [""])[0] for mutant in self.alive}
            if numeric in last and self.prepare(numeric):
                self.by_the_same_test(numeric)
        for numeric in NUMERICS:
            if self.prepare(numeric):
                self.by_few_tests(numeric)
                self.by_likely_tests(numeric)
        rounds = [self.by_its_own_tests, self.by_bits]
        for numeric in NUMERICS:
            for round_of in rounds if self.near_only else [*rounds, self.by_any_test]:
                if self.prepare(numeric):
                    round_of(numeric)
        everywhere = [
            test.reaches for programs in self.reached.values() for tests in programs.values() for test in tests
        ]
        self.how["not reached"] = len(self.alive - frozenset().union(*everywhere))

    def by_the_same_test(self, numeric: str) -> None:
        for name, tests in self.reached[numeric].items():
            if name.startswith(BITS):
                continue
            last = {(numeric, name, test.name): test for test in tests}
            jobs = {
                mutant: [last[killer]]
                for mutant in self.alive
                if (killer := tuple(self.killers.get(self.keys[mutant], ()))) in last
            }
            self.judge(numeric, name, jobs)

    def by_few_tests(self, numeric: str) -> None:
        """Mutants that only few tests reach: by all of these, which were likely written for them."""
        jobs: dict[str, dict[int, list[Test]]] = {}
        for mutant in sorted(self.alive):
            reaching = [
                (name, test)
                for name, tests in self.reached[numeric].items()
                for test in tests
                if mutant in test.reaches
            ]
            for name, test in reaching if len(reaching) <= FEW else []:
                jobs.setdefault(name, {}).setdefault(mutant, []).append(test)
        self.judge_all(numeric, jobs)

    def judge_all(self, numeric: str, jobs: dict[str, dict[int, list[Test]]]) -> None:
        for name in [*self.in_order(numeric), *(name for name in jobs if name.startswith(BITS))]:
            left = {mutant: due for mutant, due in jobs.get(name, {}).items() if mutant in self.alive}
            self.judge(numeric, name, left)

    def by_likely_tests(self, numeric: str) -> None:
        """The tests that killed most mutants of the same function, of the same file, and of all, the last time."""
        killers: dict[str, Counter[tuple[str, str]]] = {}
        for key, (_, program, test) in self.killers.items():
            for place in (key.partition(": ")[0], key.partition(":")[0], ""):
                killers.setdefault(place, Counter())[program, test] += not program.startswith(BITS)
        tests = {(name, test.name): test for name, tests in self.reached[numeric].items() for test in tests}
        jobs: dict[str, dict[int, list[Test]]] = {}
        for mutant in sorted(self.alive):
            key = self.keys[mutant]
            due: dict[tuple[str, str], Test] = {}
            for place in (key.partition(": ")[0], key.partition(":")[0], ""):
                likely = [one for one, kills in killers.get(place, Counter()).most_common() if kills and one in tests]
                due |= {one: tests[one] for one in [one for one in likely if mutant in tests[one].reaches][:LIKELY]}
            for (name, _), test in due.items():
                jobs.setdefault(name, {}).setdefault(mutant, []).append(test)
        self.judge_all(numeric, jobs)

    def by_its_own_tests(self, numeric: str) -> None:
        """test_guard_report for guard_report.c, then every test_guard_* for it."""
        for name in self.in_order(numeric):
            self.judge(numeric, name, self.reaching(numeric, name, {name.removeprefix("test_")}))
        for name in self.in_order(numeric):
            self.judge(numeric, name, self.reaching(numeric, name, self.near(name)))

    def by_any_test(self, numeric: str) -> None:
        for name in self.in_order(numeric):
            self.judge(numeric, name, self.reaching(numeric, name, set(self.sources.values()) - self.near(name)))

    def near(self, program: str) -> set[str]:
        """config_tasks and others for test_config_times: the sources whose names begin with the same word."""
        return {source for source in self.sources.values() if source.startswith(program.split("_")[1])}

    def in_order(self, numeric: str) -> list[str]:
        """The programs in the order of steps for each mutant that they killed the last time, without BITS."""
        kills = Counter(name for _, name, _ in self.killers.values())
        steps = {name: sum(test.steps for test in tests) for name, tests in self.reached[numeric].items()}
        others = [name for name in steps if not name.startswith(BITS)]
        return sorted(others, key=lambda name: steps[name] / (1 + kills[name]))

    def by_bits(self, numeric: str) -> None:
        for name in self.reached[numeric]:
            if name.startswith(BITS):
                self.how["bits"] += self.judge(numeric, name, self.reaching(numeric, name, set(self.sources.values())))

    def reaching(self, numeric: str, name: str, sources: set[str]) -> dict[int, list[Test]]:
        """For each live mutant in the sources: the tests of the program that reach it, the cheapest first."""
        ordered = sorted(self.reached[numeric][name], key=lambda one: one.steps)
        due = sorted(mutant for mutant in self.alive if self.sources[mutant] in sources)
        found = {mutant: [one for one in ordered if mutant in one.reaches] for mutant in due}
        return {mutant: tests for mutant, tests in found.items() if tests}

    def judge(self, numeric: str, name: str, jobs: dict[int, list[Test]]) -> int:
        if not jobs:
            return 0
        died = verdicts(self.programs[numeric][name], jobs)
        self.how.update(end for end, _ in died.values())
        self.alive -= set(died)
        self.killers |= {self.keys[mutant]: [numeric, name, test.name] for mutant, (_, test) in died.items()}
        KILLERS.write_text(json.dumps(self.killers, indent=0))
        print(f"  {numeric} {name}: {len(died)} of {len(jobs)}", flush=True)
        return len(died)


def listed(path: Path) -> dict[str, str]:
    """Reasons by the key of a mutant."""
    entries = tomllib.loads(path.read_text())
    return {f"{where}: {change}": reason for where, changes in entries.items() for change, reason in changes.items()}


def quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def write(path: Path, entries: dict[str, str]) -> None:
    lines, place = [HEAD], ""
    for key, reason in sorted(entries.items()):
        where, _, change = key.partition(": ")
        if where != place:
            lines.append(f"\n[{quoted(where)}]\n")
            place = where
        lines.append(f"{quoted(change)} = {quoted(reason)}\n")
    path.write_text("".join(lines))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", help="only files whose path below firmware/ begins with one of these")
    parser.add_argument("--sample", type=int, default=0)
    parser.add_argument("--listed", action="store_true", help="only the survivors on the list")
    parser.add_argument("--near", action="store_true", help="only tests named after the mutant's file; judges less")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--only", metavar="KEY", help="one mutant, as the report names it")
    parser.add_argument("--list", type=Path, default=LIST, help="another list of survivors")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / "lock").open("w") as lock:  # one run at a time builds and uses the programs
        fcntl.flock(lock, fcntl.LOCK_EX)
        return run(arguments)


def run(arguments: argparse.Namespace) -> int:
    mutants = instrument()
    reasons = listed(arguments.list)
    wanted = chosen(mutants, reasons, arguments)
    judge = Judge(mutants, wanted, arguments.near)
    judge.run()
    if arguments.write:
        survived = {mutant.key for mutant in mutants if mutant.number in judge.alive}
        judged = {mutant.key for mutant in mutants if mutant.number in wanted}
        known = {mutant.key for mutant in mutants}
        kept = {key: reason for key, reason in reasons.items() if key in known - judged}
        write(arguments.list, kept | {key: reasons.get(key, UNREVIEWED) for key in survived})
    return report(mutants, wanted, judge.alive, judge.how, reasons)


def chosen(mutants: list[Mutant], reasons: dict[str, str], arguments: argparse.Namespace) -> set[int]:
    files = tuple(arguments.files)
    some = [mutant for mutant in mutants if not files or mutant.file.startswith(files)]
    if arguments.only:
        some = [mutant for mutant in some if mutant.key == arguments.only]
    if arguments.listed:
        some = [mutant for mutant in some if mutant.key in reasons]
    numbers = [mutant.number for mutant in some]
    if arguments.sample:  # a sample of the mutants that must be killed: a survivor takes the time of every test
        numbers = [mutant.number for mutant in some if mutant.key not in reasons]
        numbers = random.Random(arguments.seed).sample(numbers, min(arguments.sample, len(numbers)))
    if not numbers:
        raise SystemExit("no such mutant")
    return set(numbers)


def report(mutants: list[Mutant], wanted: set[int], alive: set[int], how: Counter[str], reasons: dict[str, str]) -> int:
    keys = {mutant.number: mutant.key for mutant in mutants}
    whole = len(wanted) == len(mutants)
    survived = {keys[number] for number in alive}
    judged = {keys[number] for number in wanted}
    new = sorted(survived - set(reasons))
    stale = sorted((set(reasons) & judged) - survived)
    if whole:
        stale = sorted(set(reasons) - survived)
    for title, some in (("survives and is not listed", new), ("is listed but does not survive", stale)):
        for key in some:
            print(f"{title}: {key}")
    unreviewed = sum(reasons.get(key, UNREVIEWED) == UNREVIEWED for key in survived)
    print(
        f"{len(wanted)} of {len(mutants)} mutants: {len(wanted) - len(alive)} killed "
        f"({how['assertion']} by an assertion, {how['signal']} by a signal, {how['hangs']} by the limit of steps; "
        f"{how['bits']} by recorded bits after its own tests), {len(survived) - unreviewed} survive with a reason, "
        f"{unreviewed} unreviewed; {how['not reached']} change no value in any test"
    )
    return 1 if new or stale or (whole and unreviewed) else 0


if __name__ == "__main__":
    sys.exit(main())
