"""Fixtures of the bus tests. They need vcan0 and run inside tools/vcan (tests/bus_session.py)."""

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bus_guard
import bus_robot
import can
import pytest
from bus_kit import Start, run

from tauperp.config import Configuration, load_configuration
from tauperp.wire import Wire

# For tests in real time: the slowest possible configuration. A delay on a loaded machine must not cause a late tick.
CALM = {
    "wire": {"rate_hz": 20},
    "observer": {"gain_per_s": 19.0},
    "deadline": {"sync_cycles": 4, "joint_cycles": 4, "task_cycles": 8, "tick_cycles": 4, "tick_budget_us": 50_000},
    "task": {name: {"debounce_ticks": 1} for name in ("none", "payload", "contact")},
}


@pytest.fixture(scope="session")
def wire() -> Wire:
    return Wire.read()


@pytest.fixture(scope="session")
def in_uml() -> bool:
    return "User Mode Linux" in Path("/proc/cpuinfo").read_text()


@pytest.fixture(autouse=True)
def vcan0() -> Iterator[None]:
    """The bus in its initial state, whatever the last test did to it; and afterwards, for tests of other folders."""
    renew_vcan0()
    yield
    subprocess.run(["cangw", "-F"], capture_output=True)
    renew_vcan0()


def renew_vcan0() -> None:
    subprocess.run(["ip", "link", "add", "vcan0", "type", "vcan"], capture_output=True)
    subprocess.run(["tc", "qdisc", "del", "dev", "vcan0", "root"], capture_output=True)
    run("ip", "link", "set", "vcan0", "down")
    run("ip", "link", "set", "vcan0", "mtu", "72", "up")


@pytest.fixture
def vcan1() -> Iterator[str]:
    """A second bus: the robot's side of a device between robot and guard."""
    run("ip", "link", "add", "vcan1", "type", "vcan")
    run("ip", "link", "set", "vcan1", "mtu", "72", "up")
    yield "vcan1"
    run("ip", "link", "del", "vcan1")


@pytest.fixture(scope="session")
def configuration() -> Configuration:
    return load_configuration("default", robot="ku_dex")


@pytest.fixture(scope="session")
def calm() -> Configuration:
    return load_configuration("paper", robot="ku_dex", overrides=CALM)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """start(configuration, *options): a running guard that ends with the test."""
    running: list[bus_guard.GuardProcess] = []

    def start(configuration: Configuration, *options: str, **more: Any) -> bus_guard.GuardProcess:
        block = tmp_path / f"block-{len(running)}.bin"
        block.write_bytes(configuration.block() + (configuration.second_block(2) or b""))
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
