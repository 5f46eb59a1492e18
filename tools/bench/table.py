"""The counts as text of 80 columns."""

from typing import Any

INDEXES = ("d_p", "d_e", "d_f", "d_r")
CASES = ("none", "payload", "contact", "guard_tick")
LABEL, CELL = 20, 15

Counts = dict[str, Any]


def row(label: str, cells: list[str]) -> str:
    return (f"{label:<{LABEL}}" + "".join(f"{cell:>{CELL}}" for cell in cells)).rstrip()


def short(number: int) -> str:
    return str(number) if number < 1_000_000 else f"{number / 1e6:.2f}M"


def pair(numbers: Counts | None) -> str:
    return f"{short(numbers['mean'])}/{short(numbers['worst'])}" if numbers else ""


def ratio(peer: Counts, ours: Counts) -> str:
    return f"x{peer['mean'] / ours['mean']:.2f}/{peer['worst'] / ours['worst']:.2f}"


def ours_text(target: str, numeric: str, counts: Counts) -> list[str]:
    lines = [row(f"{target} {numeric}", [pair(counts[case]) for case in CASES])]
    for stage in dict.fromkeys(stage for case in CASES for stage in counts[case]["stages"]):
        lines.append(row(f"  {stage}", [pair(counts[case]["stages"].get(stage)) for case in CASES]))
    lines.append(row("  of lower rank", [str(counts[case]["rank_deficient"]) for case in CASES]))
    lines.append(row("", list(INDEXES)))
    for label, suffix in (("  bank of three", ""), ("  one channel", "_one")):
        lines.append(row(label, [pair(counts[index + suffix]) for index in INDEXES]))
    lines.append(
        f"  flash {counts['flash_bytes']} bytes, guard_t {counts['guard_bytes']}, "
        f"stack {counts['stack_bytes']} ({counts['painted_stack_bytes']} touched)"
    )
    return lines


def peer_text(ours: Counts, peers: Counts) -> list[str]:
    lines = []
    for name in peers[CASES[0]]["each"]:
        cases = [peers[case]["each"][name] for case in CASES]
        lines.append(row(f"  {name}", [pair(case) for case in cases]))
        lines.append(row("    times ours", [ratio(case, ours[key]) for case, key in zip(cases, CASES, strict=True)]))
    return lines


def agreement_text(agreement: Counts) -> str:
    worst: dict[str, int] = {}
    for name, quantities in agreement.items():
        peer = name.rpartition("-")[0]
        worst[peer] = max(worst.get(peer, 0), *(numbers["ppm"] for numbers in quantities.values()))
    return "  ppm off ours: " + ", ".join(f"{peer} {ppm}" for peer, ppm in sorted(worst.items()))


def table(results: Counts, peers: Counts) -> str:
    counted = [counts for numerics in results.values() for counts in numerics.values() if isinstance(counts, dict)]
    states = sorted({counts[case]["states"] for counts in counted for case in CASES})
    lines = [f"Instructions, mean/worst of {', '.join(f'{n:,}' for n in states)} random states", row("", list(CASES))]
    for target, numerics in results.items():
        for numeric, counts in numerics.items():
            if not isinstance(counts, dict):
                continue
            lines += ours_text(target, numeric, counts)
            theirs = peers.get(target, {}).get(numeric)
            if theirs:
                lines += [*peer_text(counts, theirs), agreement_text(theirs["agreement"])]
    return "\n".join(lines)
