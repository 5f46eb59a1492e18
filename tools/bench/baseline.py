"""Comparison of counts with the committed ones. Counts are exact and repeatable: a growth of more than 1 % is real."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

LIMIT = 1.01
UNJUDGED = ("permitted_ticks", "rank_deficient")  # these depend on the states, not on the code

Counts = dict[str, Any]

# Most instructions that a case may take at worst, by target and numeric type: (case, stage or "") to number.
BOUNDS: dict[tuple[str, str], dict[tuple[str, str], int]] = {
    ("m4f", "float"): {
        ("d_p", ""): 7_500,
        ("d_e", ""): 8_400,
        ("d_r", ""): 11_500,
        ("guard_tick", "tick"): 14_500,
    },
}


def system() -> str:
    """Distribution and release, which determine the compilers' versions."""
    try:
        lines = Path("/etc/os-release").read_text().splitlines()
    except OSError:
        return "unknown"
    words = dict(line.split("=", 1) for line in lines if "=" in line)
    return f"{words.get('ID', '')} {words.get('VERSION_ID', '')}".replace('"', "").strip()


def grown(now: Counts, before: Counts, place: str) -> list[str]:
    """Every number above LIMIT times the baseline's and every missing one, with its place."""
    found: list[str] = []
    for key, old in before.items():
        where = f"{place}.{key}"
        new = now.get(key)
        if new is None:
            found.append(f"{where} is in the baseline and was not counted")
        elif isinstance(old, dict):
            found += grown(new, old, where)
        elif key == "states":
            if new != old:
                found.append(f"{where}: {new}, the baseline has {old}")
        elif key not in UNJUDGED and new > old * LIMIT:
            found.append(f"{where}: {new}, the baseline is {old}")
    return found


def beyond_bounds(counts: Counts, target: str, numeric: str) -> list[str]:
    """Every worst count that is above its bound, with its place."""
    found: list[str] = []
    for (case, stage), bound in BOUNDS.get((target, numeric), {}).items():
        numbers = counts[case]["stages"][stage] if stage else counts[case]
        if numbers["worst"] > bound:
            found.append(f"{target}.{numeric}.{case}{'.' + stage if stage else ''}: {numbers['worst']}, above {bound}")
    return found


@dataclass
class Verdict:
    passed: int = 0  # targets and numeric types
    failures: list[str] = field(default_factory=list)
    failed: int = 0
    skipped: list[str] = field(default_factory=list)


def judge(results: Counts, compilers: dict[str, str], baseline: Counts, here: str) -> Verdict:
    """results: {target: {numeric: counts, ...}}; baseline: that and {"about": {"system", "compilers"}}.

    A target that another compiler built is not compared, and this is reported. On the baseline's own system, where the
    release determines the version, it is a failure of the baseline, not optional.
    """
    verdict = Verdict()
    about = baseline["about"]
    for target, numerics in results.items():
        known, built = about["compilers"].get(target), compilers[target]
        if known is not None and known != built:
            optional = "" if here == about["system"] else "optional: "
            verdict.skipped.append(f"{optional}counts on {target}: the baseline is by {known}, these by {built}")
            continue
        for numeric, counts in numerics.items():
            if not isinstance(counts, dict):
                continue
            before = baseline.get(target, {}).get(numeric)
            missing = [f"{target}.{numeric} has no baseline"]
            found = missing if before is None else grown(counts, before, f"{target}.{numeric}")
            found = found + beyond_bounds(counts, target, numeric)
            verdict.failures += found
            verdict.failed += bool(found)
            verdict.passed += not found
    return verdict
