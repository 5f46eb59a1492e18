"""A robot with an external guard on the bus, in lockstep and in real time."""

import json
import os
import subprocess
import sys
import time
from argparse import ArgumentParser
from pathlib import Path

import can
import numpy as np
import pytest
from guard_thread import PERIOD_S, PERIOD_US, GuardThread, virtual

from tauperp.cli import main
from tauperp.config import load_configuration
from tauperp.errors import InputError
from tauperp.experiment import Outcome, Setup, run_scenario
from tauperp.firmware import Variant
from tauperp.playing import add_playing_arguments, setup_of
from tauperp.run.lockstep import COMING_TO_REST_S
from tauperp.run.pace import Patience
from tauperp.run.scenario import Scenario, load_scenario
from tauperp.run.trace import Trace
from tauperp.sim.moment import Moment

COMMAND = [sys.executable, "-m", "tauperp.cli"]
MULTICAST = f"239.74.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF}"  # of this process alone
PATIENCE = Patience(start_s=30.0, answer_s=20.0)  # for a loaded machine; tests without an answer use IMPATIENCE
IMPATIENCE = Patience(start_s=0.3, answer_s=0.3)
STRUCK = """
robot = "ku_dex"
config = "paper"
seed = 3
[guard.wire]
rate_hz = 500
format = "classic"
[sensors]
torque_noise_nm = 0.05
[point.A]
offset_m = [0.0, 0.2, 0.0]
[[phase]]
task = "none"
do = [{ wait_s = 0.3 }, { move = "A" }]
[[phase.strike]]
step = 2
after_s = 0.1
link = 4
direction = [0.0, -1.0, 0.0]
part = "forearm"
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Scenario:
    path = tmp_path / "struck.toml"
    path.write_text(STRUCK)
    return load_scenario(path)


def against_bus(scenario: Scenario, patience: Patience = PATIENCE, real_time: bool = False) -> Outcome:
    return run_scenario(scenario, Setup(virtual, "bus", real_time, patience))


def test_a_guard_on_the_bus_stops_the_robot_in_the_cycles_in_which_the_library_does(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration):
        outcome = against_bus(scenario)
    expected = run_scenario(scenario)
    assert expected.report["stops"], "a run without a stop would prove little"
    assert outcome.passed
    for key in ("stops", "collisions", "cycles", "guard_counters", "false_stops", "finished"):
        assert outcome.report[key] == expected.report[key], key
    assert np.array_equal(outcome.trace.permitted, expected.trace.permitted)
    assert np.array_equal(outcome.trace.tip_speed_m_s, expected.trace.tip_speed_m_s)


def test_r_and_the_index_come_from_the_bus_one_joint_per_cycle(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration):
        told = against_bus(scenario).trace
    trace = run_scenario(scenario).trace
    rows = np.arange(len(trace.time_s))[:, None]
    new = told.told == rows
    new[0] = False  # the guard had sent nothing yet
    assert new.any(axis=0).all()
    assert new.sum(axis=1).max() == 1
    for heard, known in ((told.residual_nm, trace.residual_nm), (told.index_nm, trace.index_nm)):
        late = np.abs(heard[1:] - known[:-1])[new[1:]]  # received with the next cycle's answer, or with its own
        same = np.abs(heard - known)[new]
        assert np.minimum(late, same).max() <= 0.0051


def test_a_value_sent_during_a_collision_is_not_free_until_it_is_sent_again() -> None:
    rows = 6
    told = np.array([[0, 0], [1, 0], [1, 2], [3, 2], [3, 4], [5, 4]])
    row, table, yes = np.zeros(rows), np.zeros((rows, 2)), np.ones(rows, bool)
    number = np.zeros(rows, int)
    trace = Trace(row, table, table, told, table, number, number, yes, row, row, row, (), (), True)
    under_way = np.array([False, True, True, False, False, False])
    object.__setattr__(trace, "under_way", lambda settle_s: under_way)  # another test is about the collision itself
    assert trace.free(0.1).tolist() == [
        [True, True],
        [False, False],
        [False, False],
        [True, False],
        [True, True],
        [True, True],
    ]


def test_the_report_names_the_guard(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration):
        guard = against_bus(scenario).report["guard"]
    assert guard["whose"] == "bus"
    assert guard["config_crc"] == f"{scenario.configuration.crc():08x}"
    assert (guard["joints"], guard["numeric"], guard["firmware_version"]) == (7, "float32", "0.1")
    assert len(guard["build_id"]) == 4
    assert guard["differences"] == []


def test_a_guard_with_another_configuration_is_reported(scenario: Scenario) -> None:
    other = load_configuration(
        "paper", robot="ku_dex", overrides={"wire": {"rate_hz": 500, "format": "classic"}, "reset": {"healthy_ms": 190}}
    )
    with GuardThread(other):
        outcome = against_bus(scenario)
    (line,) = outcome.report["guard"]["differences"]
    assert f"{other.crc():08x}" in line
    assert f"{scenario.configuration.crc():08x}" in line


def test_a_guard_without_status_frames_is_reported_as_unknown(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration, mute_from=2):
        guard = against_bus(scenario, IMPATIENCE).report["guard"]
    assert guard["config_crc"] is None
    assert guard["differences"] == ["it has not sent its configuration"]


def test_a_silent_guard_ends_the_run_after_the_robot_has_stopped_by_itself(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration, mute_from=400):
        outcome = against_bus(scenario, Patience(30.0, 0.5))
    report, trace = outcome.report, outcome.trace
    assert report["ended"] == "cycle 400, 0.800 s: no answer of the guard for 0.5 s"
    assert (outcome.passed, report["finished"]) == (False, False)
    assert (report["stops"][-1]["reason"], report["stops"][-1]["cause"]) == ("SILENCE", "guard")
    assert report["stops"][-1]["time_s"] == 0.8
    assert report["false_stops"] == 0
    assert trace.permitted[399]
    assert not trace.permitted[400:].any()
    assert trace.tip_speed_m_s[399] > 0.01
    assert trace.tip_speed_m_s[-1] < 5e-3
    assert trace.time_s[-1] < 0.8 + COMING_TO_REST_S


def test_a_guard_that_restarts_during_a_run_is_not_obeyed(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration, restart_at=405):
        outcome = against_bus(scenario, Patience(30.0, 0.5))
    assert outcome.report["ended"].startswith("cycle 405, 0.810 s: no answer of the guard for 0.5 s, only StopCommands")
    assert not outcome.trace.permitted[405:].any()
    assert not outcome.passed


def test_two_guards_are_not_obeyed(scenario: Scenario) -> None:
    """Each one alone would be obeyed. Between two, the robot cannot know which one is right."""
    with GuardThread(scenario.configuration, alone=True), GuardThread(scenario.configuration, alone=True):
        outcome = against_bus(scenario)
    assert outcome.report["ended"].endswith("two guards answer: StopCommands come with two counters")
    assert len(outcome.trace.time_s) < 100
    assert not outcome.trace.permitted.any()
    assert not outcome.passed


def test_two_guards_that_receive_each_other_do_not_permit(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration) as one, GuardThread(scenario.configuration) as other:
        against_bus(scenario)
    assert [guard.permits for guard in (one, other)] == [0, 0]


def test_two_nodes_of_tauperp_guard_report_each_other(tmp_path: Path) -> None:
    """On a bus that also returns to every node its own frames."""
    settings = tmp_path / "slow.toml"
    settings.write_text('robot = "ku_dex"\npreset = "paper"\n[wire]\nrate_hz = 20\n[observer]\ngain_per_s = 10\n')
    command = [*COMMAND, "guard", str(settings), "--json", "--interface", "udp_multicast", "--channel", MULTICAST]
    command += ["--bus-kwargs", "port=43114"]
    logs = [tmp_path / "first.jsonl", tmp_path / "second.jsonl"]
    guards: list[subprocess.Popen[bytes]] = []

    def told(log: Path, word: str) -> bool:
        end_s = time.monotonic() + 60
        while word not in log.read_text() and time.monotonic() < end_s:
            time.sleep(0.05)
        return word in log.read_text()

    try:
        for log in logs:
            with log.open("wb") as out:
                guards.append(subprocess.Popen(command, stdout=out))
            assert told(log, "STOPPED" if guards[1:] else "WAITING")
            if not guards[1:]:
                time.sleep(0.5)  # time to receive its own frames
                assert "STOPPED" not in log.read_text()
        assert told(logs[0], "ANOTHER_GUARD")
        assert told(logs[1], "ANOTHER_GUARD")
    finally:
        for guard in guards:
            guard.terminate()
            guard.wait(60)


def test_without_a_guard_no_run_starts(scenario: Scenario) -> None:
    for real_time in (False, True):
        with pytest.raises(InputError, match=r"no guard on .*: no StopCommand answered the robot for 0\.3 s"):
            against_bus(scenario, IMPATIENCE, real_time)


def test_without_a_guard_the_command_gives_one_line_and_exit_code_2(tmp_path: Path) -> None:
    path = tmp_path / "struck.toml"
    path.write_text(STRUCK)
    command = [*COMMAND, "run", str(path), "--guard", "bus", "--interface", "virtual", "--channel", "1", "--json"]
    run = subprocess.run([*command, "--start-timeout", "0.3"], capture_output=True, timeout=120, check=False, text=True)
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.splitlines()[-1].startswith("tauperp: no guard on ")
    assert "Traceback" not in run.stderr


# --- in real time -----------------------------------------------------------------------------------------------------


def test_in_real_time_every_missed_cycle_is_counted(scenario: Scenario) -> None:
    """Lower bounds only: the machine may add delays."""

    def delay(moment: Moment) -> None:
        if round(moment.time_s / PERIOD_S) in (100, 200):
            time.sleep(5 * PERIOD_S)

    begin_s = time.monotonic()
    outcome = run_scenario(scenario, Setup(real_time=True), watch=delay)
    took_s = time.monotonic() - begin_s
    kept = outcome.report["real_time"]
    assert kept["cycles"] == outcome.report["cycles"]
    assert kept["late_cycles"] >= 2
    assert kept["skipped_periods"] >= 8
    assert kept["largest_lateness_us"] >= 4 * PERIOD_US
    assert kept["largest_lateness_us"] >= kept["p99_lateness_us"] >= 0
    assert kept["permission_not_in_time"] == 0  # the library's guard has always answered
    assert took_s >= (kept["cycles"] - 1 + 8) * PERIOD_S
    assert kept["times_slower_than_real"] >= 1.0
    assert outcome.report["stops"] == run_scenario(scenario).report["stops"]


def test_a_guard_in_lockstep_is_refused_in_real_time_with_one_line(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration), pytest.raises(InputError, match="runs in lockstep") as error:
        against_bus(scenario, real_time=True)
    assert "\n" not in str(error.value)


def test_in_real_time_a_late_permission_stops_the_robot(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration, delays_s={300: 0.05}, variant=Variant.PRODUCT):
        outcome = against_bus(scenario, real_time=True)
    assert outcome.report["real_time"]["permission_not_in_time"] >= 1
    assert "SILENCE" in [stop["reason"] for stop in outcome.report["stops"]]
    assert not outcome.passed


def test_in_real_time_a_silent_guard_ends_the_run(scenario: Scenario) -> None:
    with GuardThread(scenario.configuration, mute_from=400, variant=Variant.PRODUCT):
        outcome = against_bus(scenario, Patience(30.0, 0.1), real_time=True)
    assert "no answer of the guard for 0.1 s" in outcome.report["ended"]
    assert not outcome.trace.permitted[400:].any()
    assert outcome.trace.tip_speed_m_s[-1] < 5e-3


def test_a_guard_of_another_process_works_over_another_kind_of_bus(tmp_path: Path) -> None:
    """`tauperp guard` and `tauperp run` in real time. A late cycle is allowed here: it depends on the machine."""
    path, settings = tmp_path / "struck.toml", tmp_path / "guard.toml"
    path.write_text("time_limit_s = 0.5\n" + STRUCK)
    settings.write_text('robot = "ku_dex"\npreset = "paper"\n[wire]\nrate_hz = 500\nformat = "classic"\n')
    bus = ["--interface", "udp_multicast", "--channel", MULTICAST]
    guard = subprocess.Popen([*COMMAND, "guard", str(settings), "--json", *bus], stdout=subprocess.PIPE, text=True)
    try:
        assert guard.stdout is not None
        start = json.loads(guard.stdout.readline())
        command = [
            *COMMAND,
            "run",
            str(path),
            "--real-time",
            "--json",
            "--start-timeout",
            "30",
            "--answer-timeout",
            "30",
            *bus,
        ]
        run = subprocess.run(command, capture_output=True, timeout=300, check=False, text=True)
    finally:
        guard.terminate()
        guard.communicate(timeout=60)
    assert run.returncode in (0, 1), run.stderr
    report = json.loads(run.stdout)
    assert report["guard"]["whose"] == "bus"
    assert report["guard"]["config_crc"] == start["config_crc"]
    assert report["guard"]["differences"] == []
    assert report["real_time"]["cycles"] == report["cycles"] == 250


def test_the_librarys_guard_recognises_its_own_answers(scenario: Scenario) -> None:
    """On a bus that returns to every node its own frames."""

    def multicast() -> can.BusABC:
        return can.Bus(interface="udp_multicast", channel=MULTICAST, port=43115, fd=True)

    outcome = run_scenario(scenario, Setup(multicast, "library"))
    assert outcome.report["stops"] == run_scenario(scenario).report["stops"]
    assert outcome.report["guard_counters"]["format_errors"] == 0


@pytest.mark.parametrize(
    ("arguments", "named", "guard"),
    [
        ([], False, "library"),
        (["--interface", "virtual"], True, "library"),
        (["--interface", "socketcan", "--channel", "can0"], True, "bus"),
        (["--channel", "can0"], True, "bus"),
        (["--interface", "socketcan", "--channel", "can0", "--guard", "library"], True, "library"),
        (["--interface", "virtual", "--guard", "bus"], True, "bus"),
    ],
)
def test_a_named_bus_has_its_own_guard(arguments: list[str], named: bool, guard: str) -> None:
    parser = ArgumentParser()
    add_playing_arguments(parser)
    setup = setup_of(parser.parse_args(arguments), fd=True)
    assert (setup.bus is not None, setup.guard) == (named, guard)


def test_a_bus_guard_without_a_named_bus_is_bad_input() -> None:
    parser = ArgumentParser()
    add_playing_arguments(parser)
    with pytest.raises(InputError, match="name the bus"):
        setup_of(parser.parse_args(["--guard", "bus"]), fd=True)


def test_a_guard_without_a_bus_gives_one_line_with_the_command_to_type(capsys: pytest.CaptureFixture[str]) -> None:
    """On a virtual bus of this process no robot could reach it, and it would stay in FAULT."""
    assert main(["guard", "default", "--robot", "panda"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "tauperp guard default --robot panda --interface socketcan --channel can0" in line
