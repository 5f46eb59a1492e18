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
import random
import sys
import tomllib
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from programs import NUMERICS, ROOT, Programs, Test, instrument, verdicts
from schemata import Mutant

LIST = ROOT / "tests" / "mutation" / "survivors.toml"
UNREVIEWED = "unreviewed"
SEED = 4711
SPARSE = 100  # divides the repetitions of random tests, as on the emulated targets
HEAD = f"""# Mutants that no unit test kills, by file and function, with the reason.
# tools/mutate/mutate.py --write adds new ones; a person adds the reasons. "{UNREVIEWED}" fails `make mutants`.
"""


def survivors(wanted: set[int]) -> tuple[set[int], Counter[str]]:
    """Numbers of the mutants that no test kills, and the counts of each way in which the others were killed."""
    alive, how = set(wanted), Counter[str]()
    reached: dict[str, dict[str, list[Test]]] = {}
    for numeric in NUMERICS:
        if not alive:
            break
        programs = Programs(numeric, SPARSE)
        reached[numeric] = programs.record()
        built = programs.built(record=False)
        order = sorted(reached[numeric], key=lambda name: sum(test.steps for test in reached[numeric][name]))
        for name in order:
            tests = reached[numeric][name]
            due = sorted(number for number in alive if any(number in test.reaches for test in tests))
            died = {number: end for number, end in verdicts(built[name], tests, due).items() if end != "survived"}
            how.update(died.values())
            alive -= set(died)
            if due:
                print(f"  {numeric} {name}: {len(died)} of {len(due)}", flush=True)
    everywhere = [test.reaches for programs in reached.values() for tests in programs.values() for test in tests]
    how["not reached"] = len(alive - frozenset().union(*everywhere))
    return alive, how


def listed() -> dict[str, str]:
    """Reasons by the key of a mutant."""
    if not LIST.exists():
        return {}
    entries = tomllib.loads(LIST.read_text())
    return {f"{where}: {change}": reason for where, changes in entries.items() for change, reason in changes.items()}


def quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def write(entries: dict[str, str]) -> None:
    lines, place = [HEAD], ""
    for key, reason in sorted(entries.items()):
        where, _, change = key.partition(": ")
        if where != place:
            lines.append(f"\n[{quoted(where)}]\n")
            place = where
        lines.append(f"{quoted(change)} = {quoted(reason)}\n")
    LIST.parent.mkdir(exist_ok=True)
    LIST.write_text("".join(lines))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", help="only files whose path below firmware/ begins with one of these")
    parser.add_argument("--sample", type=int, default=0)
    parser.add_argument("--listed", action="store_true", help="only the survivors on the list")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    mutants = instrument()
    files = tuple(arguments.files)
    wanted = {mutant.number for mutant in mutants if not files or mutant.file.startswith(files)}
    if arguments.listed:
        wanted = {mutant.number for mutant in mutants if mutant.number in wanted and mutant.key in listed()}
    if arguments.sample:  # a sample of the mutants that must be killed: a survivor takes the time of every test
        wanted = {mutant.number for mutant in mutants if mutant.number in wanted and mutant.key not in listed()}
        wanted = set(random.Random(arguments.seed).sample(sorted(wanted), min(arguments.sample, len(wanted))))
    alive, how = survivors(wanted)
    return report(mutants, wanted, alive, how, arguments.write)


def report(mutants: list[Mutant], wanted: set[int], alive: set[int], how: Counter[str], write_list: bool) -> int:
    keys = {mutant.number: mutant.key for mutant in mutants}
    reasons, whole = listed(), len(wanted) == len(mutants)
    survived = {keys[number] for number in alive}
    judged = {keys[number] for number in wanted}
    new = sorted(survived - set(reasons))
    stale = sorted((set(reasons) & judged) - survived)
    if whole:
        stale = sorted(set(reasons) - survived)
    if write_list:
        kept = {key: reason for key, reason in reasons.items() if key not in judged and not whole}
        write(kept | {key: reasons.get(key, UNREVIEWED) for key in survived})
    for title, some in (("survives and is not listed", new), ("is listed but does not survive", stale)):
        for key in some:
            print(f"{title}: {key}")
    unreviewed = sum(reasons.get(key, UNREVIEWED) == UNREVIEWED for key in survived)
    print(
        f"{len(wanted)} of {len(mutants)} mutants: {len(wanted) - len(alive)} killed "
        f"({how['assertion']} by an assertion, {how['signal']} by a signal, {how['hangs']} by the limit of steps), "
        f"{len(survived) - unreviewed} survive with a reason, {unreviewed} unreviewed, {how['not reached']} not reached"
    )
    return 1 if new or stale or (whole and unreviewed) else 0


if __name__ == "__main__":
    sys.exit(main())
