"""`tauperp run` against the guard's process: the causes of a stop, and the end of a run without a guard.

Both experiments at 500 Hz, up to their first collision. They run in lockstep, because User-Mode Linux is slow.
"""

import json
import subprocess
import sys
import time
from pathlib import Path

import bus_guard
import can
import pytest
from bus_kit import Start
from bus_robot import open_channel

from tauperp.experiment import run_scenario
from tauperp.run.scenario import Scenario, load_scenario, shipped

COMMAND = [sys.executable, "-m", "tauperp.cli", "run"]
BUS = ["--interface", "socketcan", "--channel", "vcan0"]
PATIENT = ["--start-timeout", "30", "--answer-timeout", "20"]
TIMEOUT_S = 300
SYNC = 0x020
AT_500_HZ = '[guard.wire]\nrate_hz = 500\nformat = "classic"\n'
CUT = {  # experiment: its phase, a shorter wait before the collision, and the end
    "payload": (1, ("wait_s = 0.5", "wait_s = 0.3"), 2.0),
    "contact": (2, ("after_s = 1.3", "after_s = 0.8"), 2.2),
}


@pytest.fixture
def scenario_file(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A scenario with one phase of an experiment."""
    name = getattr(request, "param", "payload")
    phase, sooner, end_s = CUT[name]
    header, *phases = shipped(name).read_text().split("[[phase]]")
    path = tmp_path / f"{name}.toml"
    path.write_text(f"time_limit_s = {end_s}\n{header}{AT_500_HZ}[[phase]]{phases[phase].replace(*sooner)}")
    return path


@pytest.fixture
def scenario(scenario_file: Path) -> Scenario:
    return load_scenario(scenario_file)


def play(path: Path, *options: str) -> "subprocess.Popen[str]":
    command = [*COMMAND, str(path), *BUS, "--json", *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_cycle(bus: can.BusABC, cycle: int) -> None:
    """Wait until the robot has begun this cycle."""
    end_s = time.monotonic() + TIMEOUT_S
    while time.monotonic() < end_s:
        frame = bus.recv(timeout=1.0)
        if frame is not None and frame.arbitration_id == SYNC and int.from_bytes(frame.data[2:4], "little") >= cycle:
            return
    raise AssertionError(f"the robot did not reach cycle {cycle}")


@pytest.mark.parametrize("scenario_file", CUT, indirect=True)
def test_the_process_stops_the_robot_in_the_cycles_in_which_the_library_does(
    start: Start, scenario_file: Path, scenario: Scenario
) -> None:
    process = start(scenario.configuration, "--lockstep", program=bus_guard.RELEASE)
    robot = play(scenario_file, *PATIENT)
    expected = run_scenario(scenario).report
    output, errors = robot.communicate(timeout=TIMEOUT_S)
    assert output, errors
    report = json.loads(output)
    assert report["ended"] is None
    assert [stop["reason"] for stop in expected["stops"]] == ["COLLISION"]
    for key in ("stops", "collisions", "cycles", "guard_counters"):
        assert report[key] == expected[key], key
    assert report["guard"]["whose"] == "bus"
    assert report["guard"]["config_crc"] == f"{scenario.configuration.crc():08x}"
    assert report["guard"]["differences"] == []
    assert process.end()["ticks"] == report["cycles"] + 1  # a last tick at the end


def test_a_killed_guard_ends_the_run_and_the_cycle_is_reported(
    start: Start, scenario_file: Path, scenario: Scenario, bus: can.BusABC
) -> None:
    process = start(scenario.configuration, "--lockstep", program=bus_guard.RELEASE)
    bus.set_filters([{"can_id": SYNC, "can_mask": 0x7FF}])
    robot = play(scenario_file, "--start-timeout", "30", "--answer-timeout", "3")
    wait_for_cycle(bus, 350)
    process.process.kill()
    output, errors = robot.communicate(timeout=TIMEOUT_S)
    report = json.loads(output)
    assert (robot.returncode, report["passed"], report["finished"]) == (1, False, False), errors
    assert report["ended"].endswith("no answer of the guard for 3 s")
    last = report["stops"][-1]
    assert (last["reason"], last["cause"]) == ("SILENCE", "guard")
    cycle = int(report["ended"].split()[1].rstrip(","))
    assert cycle >= 350
    assert last["time_s"] == pytest.approx(cycle * 0.002)
    assert "Traceback" not in errors


def test_without_a_guard_run_gives_one_line_and_exit_code_2(scenario_file: Path) -> None:
    robot = play(scenario_file, "--start-timeout", "0.5")
    output, errors = robot.communicate(timeout=TIMEOUT_S)
    assert (robot.returncode, output) == (2, "")
    assert errors.splitlines()[-1].startswith("tauperp: no guard on ")
    assert "Traceback" not in errors


def test_two_guards_never_permit_and_end_the_run(start: Start, scenario_file: Path, scenario: Scenario) -> None:
    for _ in range(2):
        start(scenario.configuration, "--lockstep", program=bus_guard.RELEASE)
    robot = play(scenario_file, *PATIENT)
    output, errors = robot.communicate(timeout=TIMEOUT_S)
    report = json.loads(output)
    assert robot.returncode == 1, errors
    assert report["ended"], report
    assert (report["passed"], report["stops"]) == (False, [])
    assert report["cycles"] < 200


def test_the_same_guard_serves_one_robot_after_the_other(start: Start, scenario_file: Path, scenario: Scenario) -> None:
    """The second robot starts at cycle 0 again, and finds the trip that the end of the first one caused."""
    start(scenario.configuration, "--lockstep", program=bus_guard.RELEASE)
    short = scenario_file.with_name("short.toml")
    short.write_text(scenario_file.read_text().replace("time_limit_s = 2.0", "time_limit_s = 0.6"))
    for _ in range(2):
        robot = play(short, *PATIENT)
        output, errors = robot.communicate(timeout=TIMEOUT_S)
        report = json.loads(output)
        assert (report["ended"], report["stops"]) == (None, []), errors
        assert report["phases"][0]["peak_tip_speed_m_s"] > 0.01, "the second robot was permitted to move"


def test_an_interface_that_goes_down_gives_one_line(start: Start, scenario_file: Path, scenario: Scenario) -> None:
    start(scenario.configuration, "--lockstep", program=bus_guard.RELEASE)
    with open_channel("vcan0") as bus:
        robot = play(scenario_file, *PATIENT)
        wait_for_cycle(bus, 200)
    subprocess.run(["ip", "link", "set", "vcan0", "down"], check=True)
    _, errors = robot.communicate(timeout=TIMEOUT_S)
    assert robot.returncode in (1, 2)
    assert errors.splitlines()[-1].startswith("tauperp: CAN bus")
    assert "Traceback" not in errors
