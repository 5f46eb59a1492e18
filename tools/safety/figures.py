#!/usr/bin/env python3
"""Computes docs/safety/figures.md: residual error probability of the wire, and the reaction-time budget.

figures.py            writes the page
figures.py --check    exit code 1 if it is not current
"""

from __future__ import annotations

import sys
import textwrap

from wire import BITS, CAN_UNDETECTED, ERROR_RATE_LIMIT, WIRE_BITS, bit_error_at, estimate, weights

from tauperp.config import Configuration, load_configuration
from tauperp.files import repository_root
from tauperp.firmware import reaction_us

PAGE = repository_root() / "docs" / "safety" / "figures.md"
PRESETS = ("default", "paper")
ROBOTS = ("ku_dex", "panda", "iiwa7", "kinova3")
FRAMES_PER_CYCLE = 10  # Sync, TaskCommand, 7 joints, StopCommand


def wire_lines() -> list[str]:
    rate = FRAMES_PER_CYCLE * 1000.0
    limit = bit_error_at(ERROR_RATE_LIMIT, BITS)
    lines = [
        "## Residual error of the wire",
        "",
        *paragraph(
            f"Assumed: independent bit errors of probability p, {FRAMES_PER_CYCLE} frames of 8 bytes per cycle, 1000",
            f"cycles per second. In the {BITS} bits of a frame the CRC-8 of E2E profile 2 detects every error of up to",
            f"3 bits and of an odd number of bits, and misses {weights()[4]:,} errors of 4 bits (exact, by the",
            "weights of its code, for errors that do not change the counter).",
        ),
        *paragraph(
            f"With CAN's check before it: two or more errors among at most {WIRE_BITS} bits on the wire, which CAN's",
            f"CRC misses with {CAN_UNDETECTED:g} (two bit errors that move stuff bits; Tran, Multi-Bit Error",
            "Vulnerabilities in the Controller Area Network Protocol, Carnegie Mellon University, 1999; classic",
            "CAN), and the CRC-8 with 2^-8. CAN FD counts its stuff bits; the figures do not use this. At p =",
            f"{limit:.2g} one frame in 13 is wrong, which causes ErrorRate: the guard permits nothing on a worse bus.",
        ),
        "| p | wrong frames, CRC-8 alone | per hour | with CAN's check | per hour |",
        "|---|---|---|---|---|",
    ]
    for p in (limit, 1e-4, 1e-5, 1e-6):
        at = estimate(p, rate)
        lines.append(
            f"| {p:.1e} | {at.e2e:.1e} | {at.e2e_per_hour:.1e} | {at.with_can:.1e} | {at.with_can_per_hour:.1e} |"
        )
    return [
        *lines,
        "",
        *paragraph(
            "An undetected wrong frame is not yet a missed collision: it must also pass the range and",
            "plausibility checks, and one wrong reading changes the filtered index for one cycle. The figures do",
            "not use this.",
        ),
    ]


def paragraph(*words: str) -> list[str]:
    return [*textwrap.wrap(" ".join(words), 120), ""]


def budget(configuration: Configuration) -> str:
    """One row: the parts of the guard's worst case, ms."""
    block = configuration.block()
    period = configuration.period_us / 1000
    settings = configuration.settings
    joints = (settings.deadline.joint_cycles or 4) * period
    tick = settings.deadline.tick_cycles * period
    total = reaction_us(block) / 1000
    rest = total - period - joints - tick
    answer = period / 2
    return f"{period:g} | {joints:g} | {rest:g} | {tick:g} | **{total:g}** | {answer:g} | **{total + answer:g}**"


def reaction_lines() -> list[str]:
    lines = [
        "## Reaction time",
        "",
        *paragraph(
            "From a step of external torque of twice a threshold to the end of the robot's permission, ms. The",
            "guard's part is the firmware's own `config_reaction_us`, for the slowest task, with lost cycles up",
            "to the joint deadline. The integrator must add sensors, drives and the stopping",
            "time of the arm.",
        ),
        "| preset, robot | sample | lost cycles | filter, debounce | tick | guard | answer window | guard and wire |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for preset in PRESETS:
        for robot in ROBOTS:
            lines.append(f"| {preset}, {robot} | {budget(load_configuration(preset, robot=robot))} |")
    return [*lines, ""]


def page() -> str:
    head = ["# Figures of the safety record", ""]
    head += paragraph("Computed by `tools/safety/figures.py`; a test fails when this page is not current.")
    return "\n".join([*head, *wire_lines(), *reaction_lines()]).rstrip() + "\n"


def main() -> int:
    text = page()
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(text, encoding="utf-8")
        return 0
    current = PAGE.is_file() and PAGE.read_text(encoding="utf-8") == text
    if not current:
        print("docs/safety/figures.md is not current: tools/safety/figures.py", file=sys.stderr)
    return 0 if current else 1


if __name__ == "__main__":
    sys.exit(main())
