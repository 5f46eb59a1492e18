"""A small part of the measurements of `make bench-can`, with their verdicts; and a check that the soak can fail."""

import json
import subprocess
import sys
import zlib
from pathlib import Path

import bus_guard
import numpy as np
import pytest
from bus_robot import POSE_RAD

from tauperp.config import Configuration
from tauperp.config.block import CRC_END, block_dtype
from tauperp.firmware import Core
from tauperp.wire import Wire

BENCH = bus_guard.ROOT / "tools" / "bench-can"
SOAK = bus_guard.ROOT / "build" / "bus-soak"


def test_a_part_of_the_measurements_passes() -> None:
    result = subprocess.run([sys.executable, BENCH, "--short"], capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stdout + result.stderr
    report = json.loads((bus_guard.ROOT / "out" / "bus" / "bench-short.json").read_text())
    assert report["lockstep"]["answered"] == report["lockstep"]["cycles"] == 2000
    assert report["lockstep"]["lost"] == report["lockstep"]["overflows"] == 0
    assert report["flood"]["frames_per_s"] > 0


def soak(block: Path, cycles: int, seed: int, configuration: Configuration) -> "subprocess.CompletedProcess[str]":
    torque = Core(configuration.robot, config=configuration).terms(POSE_RAD, 0 * POSE_RAD).gravity
    message = Wire.read().message("JointState1")
    rest = [
        {"SensorStatus": 0, "Position": position, "Velocity": 0.0, "Torque": float(moment)}
        for position, moment in zip(POSE_RAD, torque, strict=True)
    ]
    payloads = [bytes(message.encode(signals)).hex() for signals in rest]
    return subprocess.run([SOAK, block, str(cycles), str(seed), *payloads], capture_output=True, text=True, timeout=200)


def test_minutes_of_random_faults_lose_no_frame_and_cause_no_wrong_permission(
    configuration: Configuration, tmp_path: Path
) -> None:
    block = tmp_path / "block.bin"
    block.write_bytes(configuration.block())
    result = soak(block, 200_000, 2130070, configuration)
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["unaccounted"] == 0
    assert report["trips"] > 10
    assert report["resumed"] >= report["trips"]
    assert all(count > 0 for count in report["faults"].values())


@pytest.mark.parametrize(
    ("field", "cycles", "breach"),
    [
        ("threshold_nm", 400_000, "permitted during a push"),
        ("debounce_ticks", 400_000, "permitted during a push"),
    ],
)
def test_a_guard_that_does_not_detect_pushes_is_a_violation(
    configuration: Configuration, tmp_path: Path, field: str, cycles: int, breach: str
) -> None:
    """The soak can fail: with the largest threshold or debounce of a block, above any push."""
    dtype = block_dtype("float32")
    block = np.frombuffer(configuration.block(), dtype).copy()
    if field == "threshold_nm":
        block["task"][0][1]["detector"][field][:] = [*(j.torque_max / 3 for j in configuration.robot.joints), 0.0]
    else:
        block["task"][0][1]["detector"][field] = 100
    block["crc"] = zlib.crc32(block.tobytes()[CRC_END:])
    path = tmp_path / "blind.bin"
    path.write_bytes(block.tobytes())
    result = soak(path, cycles, 1, configuration)
    assert result.returncode == 1
    assert breach in result.stderr
