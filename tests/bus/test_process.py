"""The process as its operator and the kernel treat it: start, end, and everything that can happen to its bus."""

import re
import signal
import subprocess
import time
from pathlib import Path

import bus_guard
import can
import pytest
from bus_guard import run_guard
from bus_robot import STOP_COMMAND, Robot, open_channel
from conftest import HurriedConfiguration, Start, run

from tauperp.config import Configuration, load_configuration
from tauperp.firmware import Reason
from tauperp.wire import Wire

PERIOD_S = 0.2  # of `calm`
BUS_OFF = "20000040#0000000000000000"  # CAN_ERR_FLAG | CAN_ERR_BUSOFF, as can-utils write it
RESTARTED = "20000100#0000000000000000"


def permitted(process: bus_guard.GuardProcess, robot: Robot) -> int:
    """Run until motion is permitted; returns how many lines the process has written."""
    end = time.monotonic() + 20
    while not robot.permitted:
        assert time.monotonic() < end, process.events()
        robot.live(PERIOD_S, PERIOD_S)
    return len(process.events())


# --- start and end ----------------------------------------------------------------------------------------------------


@pytest.fixture
def block(tmp_path: Path, configuration: Configuration) -> Path:
    path = tmp_path / "block.bin"
    path.write_bytes(configuration.block())
    return path


def test_help_names_every_option() -> None:
    result = run_guard("--help")
    assert result.returncode == 0
    for option in ("channel", "robot", "config", "lockstep", "priority", "verbose", "json", "version"):
        assert f"--{option}" in result.stdout
    assert [line for line in result.stdout.splitlines() if len(line) > 80] == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "--channel is missing"),
        (["--channel", "vcan0", "--robot", "ku_dex"], "--config is missing"),
        (["--chan", "vcan0"], "missing|unknown"),
        (["--nonsense"], "unknown option --nonsense"),
        (["--priority", "high"], "'high' is not a number from 0 to 99"),
        (["vcan0"], "'vcan0' is not an option"),
        (["--channel"], "--channel needs a value"),
        (["--channel", "can7", "--robot", "ku_dex", "--config", "{block}"], "can7: no such network interface"),
        (["--channel", "x" * 99, "--robot", "ku_dex", "--config", "{block}"], "no such network interface"),
        (["--channel", "lo", "--robot", "ku_dex", "--config", "{block}"], "lo: not a CAN interface"),
        (["--channel", "vcan0", "--robot", "panda", "--config", "{block}"], "for the robot 'ku_dex', not for 'panda'"),
        (["--channel", "vcan0", "--robot", "ku_dex", "--config", "no-such"], "no-such: No such file"),
        (["--channel", "vcan0", "--robot", "ku_dex", "--config", "/etc/passwd"], "not a configuration block"),
        (["--channel", "vcan0", "--robot", "ku_dex", "--config", "/"], "/: "),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(block: Path, arguments: list[str], message: str) -> None:
    result = run_guard(*(argument.format(block=block) for argument in arguments))
    assert (result.returncode, result.stdout) == (2, "")
    assert re.search(message, result.stderr)
    assert result.stderr.startswith("tauperp-guard: ")
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda block: block[:-1], "915 bytes, a configuration block of this firmware has 916"),
        (lambda block: block + b"\0\0", "more than 916 bytes"),
        (lambda block: b"", "0 bytes"),
        (lambda block: b"XXXX" + block[4:], "not a configuration block"),
        (lambda block: block[:4] + b"\xff" + block[5:], "another version of the firmware"),
        (lambda block: block[:100] + bytes([block[100] ^ 1]) + block[101:], "its CRC is wrong"),
    ],
)
def test_a_damaged_block_is_refused_with_its_reason(block: Path, damage, message: str) -> None:
    block.write_bytes(damage(block.read_bytes()))
    result = run_guard("--channel", "vcan0", "--robot", "ku_dex", "--config", str(block))
    assert result.returncode == 2
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_block_of_the_other_number_type_is_refused(tmp_path: Path, configuration: Configuration) -> None:
    path = tmp_path / "fixed.bin"
    path.write_bytes(configuration.block("q9.22"))
    result = run_guard("--channel", "vcan0", "--robot", "ku_dex", "--config", str(path))
    assert result.returncode == 2
    assert "other number type" in result.stderr


def test_can_fd_on_an_interface_without_it_is_refused(block: Path) -> None:
    run("ip", "link", "set", "vcan0", "down")
    run("ip", "link", "set", "vcan0", "mtu", "16", "up")
    result = run_guard("--channel", "vcan0", "--robot", "ku_dex", "--config", str(block))
    assert result.returncode == 2
    assert "CAN FD" in result.stderr


def test_it_says_what_it_runs_on(start: Start, configuration: Configuration, wire: Wire) -> None:
    event = start(configuration, "--lockstep").events()[0]
    assert event["config_crc"] == f"{configuration.crc('float32'):08x}"
    assert event["wire_crc"] == wire.hash
    assert (event["robot"], event["joints"], event["format"]) == ("ku_dex", 7, "fd")


def test_it_asks_for_real_time_and_says_what_it_got(start: Start, calm: Configuration) -> None:
    event = start(calm).events()[0]
    assert event["realtime"] is True  # the tests run as root of their kernel
    assert event["locked"] is True
    event = start(calm, "--priority", "0").events()[0]
    assert event["realtime"] is False


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_with_a_last_stop(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC, number: signal.Signals
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    permitted(process, robot)
    with open_channel("vcan0") as listener:
        process.end(number)
        frames = [frame for frame in iter(lambda: listener.recv(0.1), None) if frame.arbitration_id == STOP_COMMAND]
    last = wire.message("StopCommand").decode(frames[-1].data)
    assert (last["Permission"], last["PermissionInverted"]) == (0, 15)
    assert wire.message("StopCommand").definition.get_signal_by_name("Reason").choices[last["Reason"]] == "Shutdown"


def test_nothing_that_it_imports_allocates() -> None:
    """No heap of its own from the first line on; what libc does inside the calls below needs none either."""
    symbols = run("nm", "--dynamic", "--undefined-only", str(bus_guard.RELEASE)).split()
    names = {symbol.partition("@")[0] for symbol in symbols}
    assert "epoll_wait" in names
    assert (
        names & {"malloc", "calloc", "realloc", "free", "strdup", "asprintf", "fopen", "getline", "aligned_alloc"}
        == set()
    )


def test_its_words_are_those_of_the_dbc(wire: Wire) -> None:
    source = (bus_guard.ROOT / "firmware" / "boards" / "linux" / "names.c").read_text()
    for table, message, signal_name in (
        ("STATES", "GuardStatus", "State"),
        ("REASONS", "StopCommand", "Reason"),
        ("TASKS", "TaskCommand", "Task"),
    ):
        words = re.findall(r'"(\w+)"', source.partition(f"{table}[] = {{")[2].partition("};")[0])
        choices = wire.message(message).definition.get_signal_by_name(signal_name).choices
        assert words == [str(choices[number]) for number in range(len(choices))]


# --- by the clock -----------------------------------------------------------------------------------------------------


def test_deadlines_are_looked_at_in_silence_too(start: Start, calm: Configuration, wire: Wire, bus: can.BusABC) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    event = process.wait_for_state("Stopped", "SyncTimeout", after=lines)  # the robot falls silent
    assert event["permitted"] is False
    frames = [bus.recv(1.0) for _ in range(12)]
    stops = [bytes(frame.data) for frame in frames if frame is not None and frame.arbitration_id == STOP_COMMAND]
    assert len(stops) == 6, "it goes on to say so"
    assert {data[2] for data in stops[-2:]} == {0xF0}
    assert process.end()["timer_ticks"] > 5


def test_a_tick_over_its_budget_by_the_clock_is_a_fault(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    hurried = HurriedConfiguration(calm.settings, calm.robot, calm.wire, calm.source)
    start(hurried)
    robot = Robot(hurried, wire, bus)
    robot.live(10 * PERIOD_S, PERIOD_S)
    assert robot.answer is not None
    assert robot.answer["Reason"] == Reason.TICK_OVER_BUDGET
    assert not any(robot.log)


def test_it_does_not_hear_itself(start: Start, calm: Configuration) -> None:
    process = start(calm)
    time.sleep(2.0)
    end = process.end()
    assert end["sent"] > 10
    assert (end["frames"], end["format_errors"]) == (0, 0)


def test_foreign_ids_stay_in_the_kernel(start: Start, calm: Configuration, bus: can.BusABC) -> None:
    process = start(calm)
    for id in range(0x300, 0x340):
        bus.send(can.Message(arbitration_id=id, is_extended_id=False, data=[1], is_fd=True))
    bus.send(can.Message(arbitration_id=0x101, is_extended_id=True, data=[1], is_fd=True))
    bus.send(can.Message(arbitration_id=0x101, is_extended_id=False, is_remote_frame=True, dlc=8))
    bus.send(can.Message(arbitration_id=0x101, is_extended_id=False, data=bytes(8)))  # classic, where FD is expected
    bus.send(can.Message(arbitration_id=0x101, is_extended_id=False, data=bytes(12), is_fd=True))
    time.sleep(0.3)
    end = process.end()
    assert (end["frames"], end["format_errors"]) == (3, 3)


def test_a_step_of_the_real_time_clock_does_not_turn_time_back(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC, in_uml: bool
) -> None:
    if not in_uml:
        pytest.skip("the clock of this machine is not ours to set; User-Mode Linux has its own (VCAN_UML=1)")
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    for step_s in (-3600, 7200, -86400):
        now = time.clock_gettime(time.CLOCK_REALTIME)
        time.clock_settime(time.CLOCK_REALTIME, now + step_s)
        robot.live(3 * PERIOD_S, PERIOD_S)
        assert robot.permitted
    assert process.events()[lines:] == []


# --- what happens to the bus ------------------------------------------------------------------------------------------


def test_an_interface_that_goes_down_and_up_is_a_latched_trip_and_then_the_bus_again(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    run("ip", "link", "set", "vcan0", "down")
    event = process.wait_for_state("Stopped", "BusDown", after=lines)
    assert event["permitted"] is False
    cpu = _cpu_ticks(process)
    time.sleep(1.0)
    assert _cpu_ticks(process) - cpu < 30, "it spins"
    run("ip", "link", "set", "vcan0", "up")
    process.wait_for_bus("takes frames again")
    with open_channel("vcan0") as again:
        back = Robot(calm, wire, again)
        back.cycle = robot.cycle
        back.live(1.0, PERIOD_S)
        assert not any(back.log), "the trip is latched"
        assert back.answer is not None
        assert back.answer["Reason"] == 20
        _reset(back)
        assert back.permitted
    end = process.end()
    assert end["unsent"] > 0


def test_an_interface_that_is_removed_and_made_again_is_opened_anew(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    run("ip", "link", "del", "vcan0")
    process.wait_for_state("Stopped", "BusDown", after=lines)
    run("ip", "link", "add", "vcan0", "type", "vcan")
    run("ip", "link", "set", "vcan0", "mtu", "72", "up")
    process.wait_for_bus("opened anew")
    with open_channel("vcan0") as again:
        back = Robot(calm, wire, again)
        back.live(1.0, PERIOD_S)
        assert back.answer is not None
        assert back.answer["Reason"] == 20
        assert not any(back.log)
        _reset(back)
        assert back.permitted
    process.end()


def test_it_may_start_before_its_interface_is_up(start: Start, calm: Configuration, wire: Wire) -> None:
    run("ip", "link", "set", "vcan0", "down")
    process = start(calm)
    process.wait_for_bus("does not take frames")
    run("ip", "link", "set", "vcan0", "up")
    process.wait_for_bus("takes frames again")
    with open_channel("vcan0") as bus:
        permitted(process, Robot(calm, wire, bus))  # nothing was permitted, so nothing is latched
    process.end()


def test_bus_off_ends_the_permission(start: Start, calm: Configuration, wire: Wire, bus: can.BusABC) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    run("cansend", "vcan0", BUS_OFF)
    event = process.wait_for_state("Stopped", "BusOff", after=lines)
    assert event["trip"] == 1
    run("cansend", "vcan0", RESTARTED)
    process.wait_for_bus("restarted after bus-off")
    robot.live(1.0, PERIOD_S)
    assert not robot.permitted, "the trip is latched"
    _reset(robot)
    assert robot.permitted
    assert process.end()["error_frames"] == 2


@pytest.mark.parametrize(
    ("frame", "reason"),
    [("20000001#0000000000000000", "BusDown"), ("20000004#0001000000000000", "RxOverflow")],
    ids=["transmission timeout", "controller overflow"],
)
def test_what_the_controller_reports_ends_the_permission(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC, frame: str, reason: str
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    run("cansend", "vcan0", frame)
    process.wait_for_state("Stopped", reason, after=lines)


def test_a_storm_of_error_frames_is_one_line_and_no_trip(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    for _ in range(40):
        run("cansend", "vcan0", "20000088#0000000000000000")  # protocol violation, bus error
        robot.live(PERIOD_S, PERIOD_S)  # so that silence is not what stops it
    robot.live(3 * PERIOD_S, PERIOD_S)
    assert robot.permitted
    assert len([event for event in process.events()[lines:] if event["event"] == "bus"]) == 1
    assert process.end()["error_frames"] == 40


def test_a_full_transmit_queue_ends_the_permission(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    try:
        run("tc", "qdisc", "add", "dev", "vcan0", "root", "pfifo", "limit", "0")  # every frame: ENOBUFS
        event = process.wait_for_state("Stopped", "BusDown", after=lines)
    finally:
        run("tc", "qdisc", "del", "dev", "vcan0", "root")
    assert event["permitted"] is False
    process.wait_for_bus("takes frames again")
    assert "No buffer space" in process.wait_for_bus("does not take frames")["detail"]


def test_frames_lost_in_the_receive_buffer_end_the_permission(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = permitted(process, robot)
    process.process.send_signal(signal.SIGSTOP)
    flood = 5000
    subprocess.run([bus_guard.PEER, "flood", "vcan0", str(flood), "0", "00" * 8], check=True, capture_output=True)
    process.process.send_signal(signal.SIGCONT)
    time.sleep(0.1)
    robot.step(wait=False)  # the kernel tells of the loss with the next frame
    process.wait_for_bus("the receive buffer lost frames")
    event = process.wait_for_state("Stopped", after=lines)
    assert event["reason"] in ("RxOverflow", "SyncTimeout", "JointTimeout")  # the first that it came to know
    robot.live(3 * PERIOD_S, PERIOD_S)
    assert not robot.permitted
    end = process.end()
    assert end["overflows"] > 0
    assert end["frames"] + end["overflows"] == flood + 9 * robot.cycle, "every frame is in exactly one counter"


def test_a_reader_that_does_not_read_does_not_stop_it(
    tmp_path: Path, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    path = tmp_path / "block.bin"
    path.write_bytes(calm.block())
    command = [bus_guard.RELEASE, "--channel", "vcan0", "--robot", "ku_dex", "--config", path, "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE)
    assert process.stdout is not None
    try:
        process.stdout.readline()
        robot = Robot(calm, wire, bus)
        for number in range(2000):  # so many lines of 70 bytes do not fit into a pipe
            error = can.Message(arbitration_id=0x40 if number % 2 else 0x100, is_error_frame=True, data=bytes(8))
            bus.send(error)
            if number % 200 == 0:
                robot.live(PERIOD_S, PERIOD_S)
        robot.live(5 * PERIOD_S, PERIOD_S)
        assert robot.answer is not None
        assert robot.answer["Cycle"] in {(robot.cycle - back) & 0xF for back in range(4)}, "it still answers"
    finally:
        process.terminate()
        process.stdout.close()
        assert process.wait(20) == 0


def _cpu_ticks(process: bus_guard.GuardProcess) -> int:
    fields = Path(f"/proc/{process.process.pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def _reset(robot: Robot) -> None:
    assert robot.answer is not None
    trip = int(robot.answer["TripNumber"])
    for request in (0, 0, 1):
        robot.ask_for_reset(request, trip)
        robot.live(PERIOD_S, PERIOD_S)
    robot.live(3 * PERIOD_S, PERIOD_S)


def test_classic_can_works_as_well(start: Start, wire: Wire) -> None:
    overrides = {"wire": {"rate_hz": 500, "format": "classic"}, "deadline": {"tick_budget_us": 1000}}
    configuration = load_configuration("default", robot="ku_dex", overrides=overrides)
    run("ip", "link", "set", "vcan0", "down")
    run("ip", "link", "set", "vcan0", "mtu", "16", "up")
    start(configuration, "--lockstep")
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        robot = Robot(configuration, wire, bus)
        robot.steps(80)
        assert robot.permitted
