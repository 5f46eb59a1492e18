"""A small seeded part of `make faults`: no fault in state, clock or ticks is undetected and wrong."""

import subprocess
import sys
from pathlib import Path

import pytest
from checkout import BUILD, ROOT, make

sys.path.insert(0, str(ROOT / "tools" / "faults"))

from record import as_file, record

OUTCOMES = {"none", "detected", "needless", "late", "wrong"}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    make("build/faults")
    path = tmp_path_factory.mktemp("faults") / "contact.rec"
    path.write_bytes(as_file(record("contact")))
    return path


def outcomes(recording: Path, seed: int, count: int, *parts: str) -> dict[str, int]:
    command = [str(BUILD / "faults"), str(recording), str(seed), "0", str(count), *parts]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    result = dict.fromkeys(OUTCOMES, 0)
    for row in [line.split() for line in lines if line.startswith("count ")]:
        result[row[3]] += int(row[4])
    assert sum(result.values()) == count
    return result


@pytest.mark.parametrize(("part", "count"), [("state", 8000), ("time", 1000)])
def test_no_fault_is_undetected_and_wrong(recording: Path, seed: int, part: str, count: int) -> None:
    found = outcomes(recording, seed, count, part)
    assert found["wrong"] == 0, found
    assert found["detected"] > 0


def test_few_flipped_bits_of_the_block_hide_a_collision(recording: Path, seed: int) -> None:
    """The CRC over the block takes 200 ticks. This is the weak point of a single channel (docs/safety/faults.md)."""
    found = outcomes(recording, seed, 4000, "table")
    assert found["wrong"] <= 4000 / 100
    assert found["detected"] > 0.8 * 4000


def test_a_fault_is_the_same_in_every_run(recording: Path) -> None:
    assert outcomes(recording, 5, 500) == outcomes(recording, 5, 500)
    assert outcomes(recording, 5, 500) != outcomes(recording, 6, 500)


def test_a_permission_after_the_stop_was_due_is_wrong(recording: Path) -> None:
    """The judge can fail: it reports a threshold that a flipped bit raised just after the CRC had passed it."""
    assert outcomes(recording, 2, 6000, "unwatched")["wrong"] > 0
