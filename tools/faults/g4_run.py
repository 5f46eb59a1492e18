#!/usr/bin/env python3
"""One chunk of faults in the stm32g4 image: g4_run.py EXPERIMENT CHANNELS SEED FIRST COUNT. Its result is JSON."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from random import Random

from record import record

from tauperp.files import repository_root
from tauperp.firmware import reaction_us

ROOT = repository_root()
sys.path.insert(0, str(ROOT / "tools"))

from g4_faults import AFTER, BEFORE, OUTCOMES, WRONG, Injector  # noqa: E402

PER_CYCLE = 10  # faults that start at the same cycle


def image_of(experiment: str, blocks: tuple[bytes, ...]) -> Path:
    folder = ROOT / "build" / "g4"
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{experiment}-faults-{len(blocks)}"
    block_file, image = folder / f"{name}.bin", folder / f"{name}.elf"
    block_file.write_bytes(b"".join(blocks))
    command = ["make", "-C", str(ROOT), "firmware", "BOARD=stm32g4", f"BLOCK={block_file}", f"CHANNELS={len(blocks)}"]
    subprocess.run([*command, f"IMAGE={image.relative_to(ROOT)}"], check=True, stdout=subprocess.DEVNULL)
    return image


def chosen(random: Random, stops: list[int], cycles: int) -> int:
    """Random cycles: half of them just before a stop, a quarter after one, a quarter anywhere."""
    kind = random.randrange(4)
    near = random.choice(stops)
    at = near - random.randrange(BEFORE) if kind < 2 else near + random.randrange(AFTER)
    return min(max(at if kind < 3 else random.randrange(cycles), 0), cycles - 1)


def main() -> int:
    experiment, channels, seed, first, count = sys.argv[1], *map(int, sys.argv[2:6])
    run = record(experiment, channels)
    period_us = run.cycles[1][0] - run.cycles[0][0]
    reaction = -(-reaction_us(run.blocks[0]) // period_us)
    random = Random(f"{seed} {experiment} {first}")
    starts = sorted({chosen(random, run.stops, len(run.cycles)) for _ in range(-(-count // PER_CYCLE))})
    injector = Injector(image_of(experiment, run.blocks), channels, reaction, run.cycles)
    snapshots = dict(injector.run_reference(starts))
    rows: dict[tuple[str, str], list[int]] = {}
    wrong: list[str] = []
    for number in range(first, first + count):
        draw = Random(f"{seed} {experiment} {number}")
        start = starts[number % len(starts)]
        place, outcome, after, what = injector.inject(start, snapshots[start], draw)
        row = rows.setdefault((place, OUTCOMES[outcome]), [0, 0, 0])
        row[0], row[1], row[2] = row[0] + 1, row[1] + after, max(row[2], after)
        if outcome == WRONG:
            wrong.append(f"wrong {what} cycle {start} number {number}")
    result = {
        "reaction_cycles": reaction,
        "rows": [[*key, *row] for key, row in sorted(rows.items())],
        "wrong": wrong,
    }
    print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
