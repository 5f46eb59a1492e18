#!/usr/bin/env python3
"""Faults in the stm32g4 image: g4_run.py EXPERIMENT CHANNELS SEED COUNT FOLDER.

Writes a JSON file for each CHUNK faults that have none yet, into a folder of FOLDER for this image, and prints the
names of all files. The run without a fault comes first, once for all of them.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from random import Random
from typing import Any

from record import Recording, record

from tauperp.files import repository_root
from tauperp.firmware import reaction_us

ROOT = repository_root()
sys.path.insert(0, str(ROOT / "tools"))

from g4.board import Snapshot  # noqa: E402
from g4_faults import AFTER, BEFORE, OUTCOMES, WRONG, Injector  # noqa: E402

CHUNK = 500
PER_CYCLE = 10  # faults that start at the same cycle
Result = dict[str, Any]


def image_of(experiment: str, blocks: tuple[bytes, ...]) -> Path:
    folder = ROOT / "build" / "g4"
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{experiment}-faults-{len(blocks)}"
    block_file, image = folder / f"{name}.bin", folder / f"{name}.elf"
    block_file.write_bytes(b"".join(blocks))
    command = ["make", "-C", str(ROOT), "firmware", "BOARD=stm32g4", f"BLOCK={block_file}", f"CHANNELS={len(blocks)}"]
    subprocess.run([*command, f"IMAGE={image.relative_to(ROOT)}"], check=True, stdout=subprocess.DEVNULL)
    return image


def starts_of(random: Random, run: Recording, faults: int) -> list[int]:
    return sorted({chosen(random, run.stops, len(run.cycles)) for _ in range(-(-faults // PER_CYCLE))})


def chosen(random: Random, stops: list[int], cycles: int) -> int:
    """Random cycles: half of them just before a stop, a quarter after one, a quarter anywhere."""
    kind = random.randrange(4)
    near = random.choice(stops)
    at = near - random.randrange(BEFORE) if kind < 2 else near + random.randrange(AFTER)
    return min(max(at if kind < 3 else random.randrange(cycles), 0), cycles - 1)


def chunk(injector: Injector, snapshots: dict[int, Snapshot], starts: list[int], seed: str, numbers: range) -> Result:
    rows: dict[tuple[str, str], list[int]] = {}
    wrong: list[str] = []
    for number in numbers:
        start = starts[number % len(starts)]
        place, outcome, after, what = injector.inject(start, snapshots[start], Random(f"{seed} {number}"))
        row = rows.setdefault((place, OUTCOMES[outcome]), [0, 0, 0])
        row[0], row[1], row[2] = row[0] + 1, row[1] + after, max(row[2], after)
        if outcome == WRONG:
            wrong.append(f"wrong {what} cycle {start} number {number}")
    if not all(injector.is_clean(start, snapshots[start]) for start in starts):
        raise SystemExit(f"a fault has changed the emulator: no result for {seed} {numbers.start} to {numbers.stop}")
    return {"rows": [[*key, *row] for key, row in sorted(rows.items())], "wrong": wrong}


def main() -> int:
    experiment, channels, seed, count = sys.argv[1], *map(int, sys.argv[2:5])
    run = record(experiment, channels)
    image = image_of(experiment, run.blocks)
    folder = Path(sys.argv[5]) / hashlib.sha256(image.read_bytes()).hexdigest()[:16]
    files = {
        range(first, min(first + CHUNK, count)): folder / f"g4-{experiment}-{first}-{min(CHUNK, count - first)}.json"
        for first in range(0, count, CHUNK)
    }
    missing = {numbers: file for numbers, file in files.items() if not file.is_file()}
    if missing:
        run_missing(missing, run, image, channels, f"{seed} {experiment}")
    print("\n".join(str(file) for file in files.values()))
    return 0


def run_missing(missing: dict[range, Path], run: Recording, image: Path, channels: int, seed: str) -> None:
    period_us = run.cycles[1][0] - run.cycles[0][0]
    reaction = -(-reaction_us(run.blocks[0]) // period_us)
    starts = {numbers: starts_of(Random(f"{seed} {numbers.start}"), run, len(numbers)) for numbers in missing}
    injector = Injector(image, channels, reaction, run.cycles)
    snapshots = dict(injector.run_reference({start for some in starts.values() for start in some}))
    for numbers, file in missing.items():
        result = chunk(injector, snapshots, starts[numbers], seed, numbers)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.with_suffix(".new").write_text(json.dumps({"reaction_cycles": reaction, **result}))
        file.with_suffix(".new").rename(file)


if __name__ == "__main__":
    sys.exit(main())
