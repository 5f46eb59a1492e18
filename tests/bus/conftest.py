"""What the bus tests share. They need vcan0: `make bus-test`, or tools/vcan in front of pytest."""

import subprocess
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bus_guard
import bus_robot
import can
import numpy as np
import pytest

from tauperp.config import Configuration, Numeric, load_configuration
from tauperp.config.block import CRC_END, block_dtype
from tauperp.wire import Wire

# For tests by the clock: the slowest that a configuration may be. A hiccup of a loaded machine must not be a late tick.
CALM = {
    "wire": {"rate_hz": 20},
    "observer": {"gain_per_s": 19.0},
    "deadline": {"sync_cycles": 4, "joint_cycles": 4, "task_cycles": 8, "tick_cycles": 4, "tick_budget_us": 50_000},
    "task": {name: {"debounce_ticks": 1} for name in ("none", "payload", "contact")},
}


class HurriedConfiguration(Configuration):
    """No tick is done in so short a time."""

    def block(self, numeric: Numeric = "float32") -> bytes:
        block = np.frombuffer(super().block(numeric), block_dtype(numeric)).copy()
        block["tick_budget_us"] = 1
        block["crc"] = zlib.crc32(block.tobytes()[CRC_END:])
        return block.tobytes()


def pytest_sessionstart() -> None:
    if not Path("/sys/class/net/vcan0").exists():
        pytest.exit("tests/bus: there is no vcan0 here; run them by `make bus-test`", returncode=3)


def run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=20).stdout


@pytest.fixture(scope="session")
def wire() -> Wire:
    return Wire.read()


@pytest.fixture(scope="session")
def in_uml() -> bool:
    return "User Mode Linux" in Path("/proc/cpuinfo").read_text()


@pytest.fixture(autouse=True)
def vcan0() -> Iterator[None]:
    """As every test finds it, whatever the one before did to it."""
    subprocess.run(["ip", "link", "add", "vcan0", "type", "vcan"], capture_output=True)
    subprocess.run(["tc", "qdisc", "del", "dev", "vcan0", "root"], capture_output=True)
    run("ip", "link", "set", "vcan0", "down")
    run("ip", "link", "set", "vcan0", "mtu", "72", "up")
    yield
    subprocess.run(["cangw", "-F"], capture_output=True)


@pytest.fixture
def vcan1() -> Iterator[str]:
    """A second bus: the robot's side of whatever stands between it and the guard."""
    run("ip", "link", "add", "vcan1", "type", "vcan")
    run("ip", "link", "set", "vcan1", "mtu", "72", "up")
    yield "vcan1"
    run("ip", "link", "del", "vcan1")


@pytest.fixture(scope="session")
def configuration() -> Configuration:
    return load_configuration("default", robot="ku_dex")


@pytest.fixture(scope="session")
def calm() -> Configuration:
    return load_configuration("default", robot="ku_dex", overrides=CALM)


Start = Callable[..., bus_guard.GuardProcess]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """start(configuration, *options): a running guard; ended with the test."""
    running: list[bus_guard.GuardProcess] = []

    def start(configuration: Configuration, *options: str, **more: Any) -> bus_guard.GuardProcess:
        block = tmp_path / f"block-{len(running)}.bin"
        block.write_bytes(configuration.block())
        robot = ["--robot", configuration.robot.name, "--config", str(block)]
        running.append(bus_guard.GuardProcess(tmp_path, *robot, *options, **more))
        return running[-1].__enter__()

    yield start
    for process in running:
        process.__exit__()


@pytest.fixture
def bus() -> Iterator[can.BusABC]:
    with bus_robot.open_channel("vcan0") as bus:
        yield bus
