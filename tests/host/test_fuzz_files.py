"""Damaged files of every kind: a reader returns a result or one line, never a traceback."""

import gzip
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path

import can
import numpy as np
import pytest
from mutations import mutations
from robot_makers import random_robot, urdf_of

from tauperp.config import load_configuration
from tauperp.errors import InputError
from tauperp.recording import read_recording
from tauperp.recording.mapping import column_map
from tauperp.replay.buslog import BusLog
from tauperp.robot import load
from tauperp.robot.check import check

SEED = 20261125
N = 2
NAMES = ["time", "q0", "q1", "dq0", "dq1", "tau_J0", "tau_J1", "label"]

MJCF = b"""<mujoco model="Arm"><compiler angle="degree"/><asset><mesh name="m" file="gone.stl"/></asset><worldbody>
<body name="one" pos="0 0 0.1" euler="10 20 30"><joint name="j1" axis="0 1 0" ref="30" range="-100 120"/>
<inertial mass="2" pos="0.01 0.02 0.1" fullinertia="0.02 0.03 0.02 0.001 0.002 -0.001"/>
<geom type="mesh" mesh="m"/><body name="two" pos="0.1 0 0.3" quat="1 2 3 4"><joint name="j2" axis="1 0 1"/>
<geom type="capsule" fromto="0 0 0 0.1 0 0.3" size="0.04" density="800"/><site name="tcp" pos="0 0 0.3"/></body>
</body></worldbody><actuator><motor joint="j1" gear="50" ctrllimited="true" ctrlrange="-2 1"/></actuator></mujoco>
"""
CELL = b"""robot = "ku_dex"
preset = "paper"
[wire]
rate_hz = 500
format = "classic"
[task.none]
threshold_nm = [1.2, 1.4, 0.9, 0.7, 0.8, 0.4, 0.4]
"""
MAP = b"""[file]
separator = ";"
[time]
columns = ["stamp.sec", "stamp.nanosec"]
[position]
column = "axis{}_deg"
first = 1
unit = "deg"
sign = [1, -1]
[torque]
columns = ["A1", "A2"]
factor = [0.1, 2]
"""


def urdf(_: Path) -> bytes:
    return urdf_of(random_robot(5, 3)).encode()


def table(_: Path) -> bytes:
    rows = np.random.default_rng(2).uniform(-2, 2, (20, len(NAMES))).round(3)
    rows[:, 0] = np.arange(20) * 0.002
    return "\n".join([",".join(NAMES), *(",".join(map(repr, row)) for row in rows.tolist())]).encode() + b"\n"


def log(folder: Path, suffix: str) -> bytes:
    path = folder / f"good{suffix}"
    with can.Logger(path) as logger:
        for k in range(40):
            identifier = 0x20 + k % 8
            data = bytes([k, 255 - k, 3, 4])
            is_fd = k % 3 == 0
            logger(can.Message(0.1 + k * 0.01, identifier, is_extended_id=False, data=data, is_fd=is_fd, channel=0))
    return path.read_bytes()


def read_robot(path: Path) -> None:
    check(load(path), states=1)


def read_log(path: Path) -> None:
    frames = BusLog(path)
    for frame in frames:
        assert len(frame.data) <= 64
    assert frames.damage is None or isinstance(frames.damage, InputError)


def read_configuration(path: Path) -> None:
    load_configuration(path).block()


KINDS: dict[str, tuple[Callable[[Path], bytes], Callable[[Path], object], int]] = {
    ".urdf": (urdf, read_robot, 250),
    ".xml": (lambda _: MJCF, read_robot, 150),
    ".toml": (lambda _: CELL, read_configuration, 60),
    ".map.toml": (lambda _: MAP, lambda path: column_map(N, path), 200),
    ".csv": (table, lambda path: read_recording(path, N), 250),
    ".csv.gz": (lambda folder: gzip.compress(table(folder), mtime=0), lambda path: read_recording(path, N), 100),
    ".log": (lambda folder: log(folder, ".log"), read_log, 250),
    ".asc": (lambda folder: log(folder, ".asc"), read_log, 250),
    ".blf": (lambda folder: log(folder, ".blf"), read_log, 250),
}


@pytest.mark.parametrize("suffix", KINDS)
def test_a_damaged_file_gives_a_result_or_one_line(
    tmp_path: Path, suffix: str, capfd: pytest.CaptureFixture[str]
) -> None:
    make, read, count = KINDS[suffix]
    path = tmp_path / f"x{suffix}"
    said = []
    for number, data in enumerate(changed(make(tmp_path), count)):
        path.write_bytes(data)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read(path)
        except InputError as error:
            said.append(str(error))
        except Exception as error:
            raise AssertionError(f"number {number} of {suffix}: {error!r}") from error
    print(f"{len(said)} of {count} refused")
    assert 0 < len(said) < count
    assert not any("\n" in line for line in said)
    assert capfd.readouterr().err == ""


def changed(data: bytes, count: int) -> Iterable[bytes]:
    yield data
    yield from mutations(data, count - 1, SEED)
