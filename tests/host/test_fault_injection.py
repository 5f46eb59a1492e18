"""A small seeded part of `make faults`: no fault in state, clock or ticks is undetected and wrong."""

import dataclasses
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import BUILD, ROOT, make

sys.path.insert(0, str(ROOT / "tools" / "faults"))

from record import NUMERICS, as_file, record

from tauperp.run.scenario import load_scenario, shipped

OUTCOMES = {"none", "detected", "needless", "late", "wrong"}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    """The same frames for a guard of one channel and of two."""
    make("build/faults")
    run = record("contact")
    configuration = load_scenario(shipped("contact")).configuration
    files = {}
    for channels in (1, 2):
        blocks = tuple(configuration.block(numeric) for numeric in NUMERICS[:channels])
        files[channels] = tmp_path_factory.mktemp("faults") / "contact.rec"
        files[channels].write_bytes(as_file(dataclasses.replace(run, blocks=blocks)))
    return files


@pytest.fixture
def recording(recordings: dict[int, Path]) -> Path:
    return recordings[1]


def outcomes(recording: Path, seed: int, count: int, *parts: str) -> dict[str, int]:
    command = [str(BUILD / "faults"), str(recording), str(seed), "0", str(count), *parts]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    result = dict.fromkeys(OUTCOMES, 0)
    for row in [line.split() for line in lines if line.startswith("count ")]:
        result[row[3]] += int(row[4])
    assert sum(result.values()) == count
    return result


@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize(("part", "count"), [("state", 8000), ("time", 1000)])
def test_no_fault_is_undetected_and_wrong(
    recordings: dict[int, Path], seed: int, part: str, count: int, channels: int
) -> None:
    found = outcomes(recordings[channels], seed, count, part)
    assert found["wrong"] == 0, found
    assert found["detected"] > 0


@pytest.mark.parametrize("channels", [1, 2])
def test_every_flipped_bit_of_the_block_is_detected(recordings: dict[int, Path], seed: int, channels: int) -> None:
    assert outcomes(recordings[channels], seed, 4000, "table")["detected"] == 4000


def test_faults_reach_every_part_of_both_channels(recordings: dict[int, Path]) -> None:
    """A part of each channel by its name: an offset that is not of the channel would give another outcome."""
    for part in ("state_inverted", "second.state_inverted", "watch", "second.watch"):
        assert outcomes(recordings[2], 7, 100, part)["detected"] == 100, part


def test_a_fault_is_the_same_in_every_run(recording: Path) -> None:
    assert outcomes(recording, 5, 500) == outcomes(recording, 5, 500)
    assert outcomes(recording, 5, 500) != outcomes(recording, 6, 500)


def test_a_permission_after_the_stop_was_due_is_wrong(recording: Path) -> None:
    """The judge can fail: it reports a threshold that a flipped bit raised, with a sum that contains it."""
    assert outcomes(recording, 2, 6000, "unwatched")["wrong"] > 0
