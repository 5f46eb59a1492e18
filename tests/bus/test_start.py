"""The start and the end of the process: its output before it starts, and its last frame."""

import re
import shutil
import signal
import subprocess
from pathlib import Path

import bus_guard
import can
import pytest
from bus_guard import run_guard
from bus_kit import Start, run
from bus_robot import LONGEST_START, STOP_COMMAND, Robot, open_channel, run_until_permitted

from tauperp.config import Configuration
from tauperp.firmware import Reason
from tauperp.wire import Wire


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
def test_bad_input_gives_one_line_and_exit_code_2(block: Path, arguments: list[str], message: str) -> None:
    result = run_guard(*(argument.format(block=block) for argument in arguments))
    assert (result.returncode, result.stdout) == (2, "")
    assert re.search(message, result.stderr)
    assert result.stderr.startswith("tauperp-guard: ")
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda block: block[:-1], "{less} bytes, a configuration block of this firmware has {size}"),
        (lambda block: 2 * block + b"\0", "more than {twice} bytes"),
        (lambda block: b"", "0 bytes"),
        (lambda block: b"XXXX" + block[4:], "not a configuration block"),
        (lambda block: block[:4] + b"\xff" + block[5:], "another version of the firmware"),
        (lambda block: block[:100] + bytes([block[100] ^ 1]) + block[101:], "its CRC is wrong"),
    ],
)
def test_a_damaged_block_is_refused_with_its_reason(block: Path, damage, message: str) -> None:
    size = len(block.read_bytes())
    block.write_bytes(damage(block.read_bytes()))
    result = run_guard("--channel", "vcan0", "--robot", "ku_dex", "--config", str(block))
    assert result.returncode == 2
    assert message.format(size=size, less=size - 1, twice=2 * size) in result.stderr
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


def test_the_start_line_names_configuration_wire_and_robot(
    start: Start, configuration: Configuration, wire: Wire
) -> None:
    event = start(configuration, "--lockstep").events()[0]
    assert event["config_crc"] == f"{configuration.crc('float32'):08x}"
    assert event["wire_crc"] == wire.hash
    assert (event["robot"], event["joints"], event["format"]) == ("ku_dex", 7, "fd")


def test_the_process_requests_real_time_and_reports_the_result(start: Start, calm: Configuration) -> None:
    event = start(calm).events()[0]
    assert event["realtime"] is True  # the tests run as root of their kernel
    assert event["locked"] is True
    event = start(calm, "--priority", "0").events()[0]
    assert event["realtime"] is False


def test_without_capabilities_the_process_runs_and_reports_what_is_missing(block: Path) -> None:
    """Root without the two capabilities and without resource limits that would allow the same."""
    unprivileged = ["setpriv", "--bounding-set=-sys_nice,-ipc_lock", "prlimit", "--memlock=0", "--rtprio=0"]
    command = [str(bus_guard.RELEASE), "--channel", "vcan0", "--robot", "ku_dex", "--config", str(block)]
    process = subprocess.Popen([*unprivileged, *command], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    line = process.stdout.readline()
    process.terminate()  # even directly after its first line it sends its last frame
    output, _ = process.communicate(timeout=20)
    assert "without real-time priority (Operation not permitted)" in line
    assert re.search(r"memory not locked \((Operation not permitted|Cannot allocate memory)\)", line)
    assert process.returncode == 0
    assert re.search(r" state Stopped: Shutdown| state (Waiting|SelfTest)", output), output
    assert " end " in output


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="optional: no systemd here to read the unit")
def test_systemd_accepts_the_unit_and_the_process_its_options(tmp_path: Path) -> None:
    text = (bus_guard.ROOT / "firmware" / "hosts" / "linux" / "tauperp-guard.service").read_text()
    unit = tmp_path / "tauperp-guard@.service"
    unit.write_text(text.replace("/usr/local/bin/tauperp-guard", str(bus_guard.RELEASE)))
    verify = ["systemd-analyze", "verify", str(tmp_path / "tauperp-guard@can7.service")]
    result = subprocess.run(verify, capture_output=True, text=True, timeout=60)
    assert [line for line in result.stderr.splitlines() if "tauperp" in line] == []
    assert result.returncode == 0, result.stderr
    (line,) = re.findall(r"^ExecStart=\S+ (.*)$", text, re.MULTILINE)
    options = line.replace("%i", "can7").replace("${ROBOT}", "panda").replace("/etc/tauperp/guard.bin", "no-such")
    assert run_guard(*options.split()).stderr == "tauperp-guard: no-such: No such file or directory\n"


def test_a_restart_by_the_service_manager_is_counted_and_limited(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC, tmp_path: Path
) -> None:
    """The runtime directory remains after a process was killed, as systemd keeps it over a restart."""
    directory = tmp_path / "runtime"
    directory.mkdir()
    environment = {"RUNTIME_DIRECTORY": str(directory)}
    reasons = []
    for _ in range(5):
        process = start(configuration, "--lockstep", environment=environment)
        robot = Robot(configuration, wire, bus)
        robot.steps(LONGEST_START)
        assert robot.answer is not None
        reasons.append(Reason(int(robot.answer["Reason"])).name)
        process.process.kill()
        process.process.wait(20)
    assert reasons == ["AWAITING_RESET", "RESTARTED", "RESTARTED", "RESTARTED", "RESTART_LIMIT"]
    process = start(configuration, "--lockstep", environment=environment)
    process.end()
    assert not list(directory.iterdir()), "a process that ended on request leaves no count"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_process_with_a_last_stop(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC, number: signal.Signals
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    run_until_permitted(process, robot)
    with open_channel("vcan0") as listener:
        process.end(number)
        frames = [frame for frame in iter(lambda: listener.recv(0.1), None) if frame.arbitration_id == STOP_COMMAND]
    last = wire.message("StopCommand").decode(frames[-1].data)
    assert (last["Permission"], last["PermissionInverted"]) == (0, 15)
    assert wire.message("StopCommand").definition.get_signal_by_name("Reason").choices[last["Reason"]] == "Shutdown"
