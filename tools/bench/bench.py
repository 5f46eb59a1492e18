#!/usr/bin/env python3
"""Runs the counting images on their emulated targets and writes what they counted.

    bench.py [--json OUT] [--baseline FILE] [--write-baseline] [--opt -O2] TARGET:NUMERIC...

Reads build/bench/TARGET-NUMERIC-OPT-{stages,guard,image}.elf, which `make bench` has built. Instruction counts are
exact and repeat, so a count that grows by more than 1 % over the committed baseline is a failure, not noise.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from stack import worst_stack

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build"
CASES = ("none", "payload", "contact", "guard_tick")
ROOTS = ("guard_init", "guard_receive", "guard_tick", "guard_note_tick_time", "guard_trip", "guard_cycle_complete")
LIMIT = 1.01  # growth over the baseline that fails
TIMEOUT_S = 600

Counts = dict[str, Any]


def run_image(target: str, image: Path) -> list[list[str]]:
    """The lines that an image printed, split into words. Raises RuntimeError if it did not end well."""
    command = [str(ROOT / "tools" / "qemu-run"), target, str(image)]
    # QEMU prints what comes by semihosting to stderr.
    done = subprocess.run(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT_S, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"{image.name} ended with {done.returncode}: {done.stdout[-300:]}")
    return [line.split() for line in done.stdout.splitlines() if line.strip()]


def flash_bytes(image: Path) -> int:
    """Code, constants and initial data of an ELF: everything that is loaded."""
    lines = subprocess.run(["arm-none-eabi-size", str(image)], capture_output=True, text=True, check=True).stdout
    text, data = lines.splitlines()[1].split()[:2]
    return int(text) + int(data)


def count(target: str, numeric: str, opt: str) -> Counts:
    """All counts of one target and numeric type, in the shape of bench.json."""
    image = BUILD / "bench" / f"{target}-{numeric}{opt}"
    result: Counts = {}
    for program in ("stages", "guard"):
        for kind, *words in run_image(target, Path(f"{image}-{program}.elf")):
            if kind == "count":
                case, stage, mean, worst, _ = words
                entry = result.setdefault(case, {"stages": {}})
                numbers = {"mean": int(mean), "worst": int(worst)}
                if stage == "total":
                    entry.update(numbers)
                else:
                    entry["stages"][stage] = numbers
            elif kind == "size":
                result[words[0]] = int(words[1])
            else:
                raise RuntimeError(f"{image.name}-{program}: {kind} {' '.join(words)}")
    result["flash_bytes"] = flash_bytes(Path(f"{image}-image.elf"))
    result["stack_bytes"] = worst_stack(BUILD / "object" / f"{target}-{numeric}{opt}" / "firmware", ROOTS)
    if result["painted_stack_bytes"] > result["stack_bytes"]:
        raise RuntimeError(
            f"{image.name}: stack {result['painted_stack_bytes']} touched, {result['stack_bytes']} known"
        )
    return result


def grown(now: Counts, before: Counts, place: str = "") -> list[str]:
    """Every number that is above LIMIT times the baseline's, with its place."""
    found: list[str] = []
    for key, old in before.items():
        where = f"{place}.{key}" if place else key
        new = now.get(key)
        if isinstance(old, dict) and isinstance(new, dict):
            found += grown(new, old, where)
        elif isinstance(old, int) and isinstance(new, int) and new > old * LIMIT and key != "permitted_ticks":
            found.append(f"{where}: {new}, the baseline is {old}")
    return found


def table(results: Counts) -> str:
    lines = [f"{'instructions, mean / worst':<30}" + "".join(f"{case:>18}" for case in CASES)]
    for target, numerics in results.items():
        for numeric, counts in numerics.items():
            if not isinstance(counts, dict):
                continue
            cells = [f"{counts[case]['mean']:>8} /{counts[case]['worst']:>7}" for case in CASES]
            lines.append(f"{target + ' ' + numeric:<30}" + "".join(f"{cell:>18}" for cell in cells))
            stages = sorted({stage for case in CASES for stage in counts[case]["stages"]})
            for stage in stages:
                rows = [counts[case]["stages"].get(stage) for case in CASES]
                cells = [f"{row['mean']:>8} /{row['worst']:>7}" if row else "" for row in rows]
                lines.append(f"{'  ' + stage:<30}" + "".join(f"{cell:>18}" for cell in cells))
            lines.append(
                f"  flash {counts['flash_bytes']} bytes, guard_t {counts['guard_bytes']}, "
                f"stack {counts['stack_bytes']} ({counts['painted_stack_bytes']} touched)"
            )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("images", nargs="+", metavar="TARGET:NUMERIC")
    parser.add_argument("--opt", default="-O2")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--baseline", type=Path)
    parser.add_argument("--write-baseline", action="store_true")
    args = parser.parse_args()

    results: Counts = {}
    for name in args.images:
        target, _, numeric = name.partition(":")
        try:
            results.setdefault(target, {})[numeric] = count(target, numeric, args.opt)
        except (RuntimeError, ValueError, OSError, subprocess.SubprocessError) as error:
            print(f"bench: {error}", file=sys.stderr)
            return 1
    for numerics in results.values():  # the numbers of the type that ships
        shipped = numerics.get("float") or next(iter(numerics.values()))
        numerics.update({key: shipped[key] for key in ("flash_bytes", "guard_bytes", "stack_bytes")})
    print(table(results))
    if args.json:
        args.json.parent.mkdir(parents=True, exist_ok=True)
        args.json.write_text(json.dumps({"optimisation": args.opt, **results}, indent=1) + "\n")
    if args.baseline and args.write_baseline:
        args.baseline.write_text(json.dumps(results, indent=1) + "\n")
    elif args.baseline and args.baseline.exists():
        failures = grown(results, json.loads(args.baseline.read_text()))
        for failure in failures:
            print(f"bench: grown: {failure}", file=sys.stderr)
        return 1 if failures else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
