"""The output of the process: a reader that does not read cannot block it, and the process never allocates."""

import os
import subprocess
import time
from pathlib import Path

import bus_guard
import can
from bus_kit import Start, run
from bus_robot import CALM_PERIOD_S, Robot, reset, run_until_permitted

from tauperp.config import Configuration
from tauperp.wire import Wire


def test_in_lockstep_every_line_has_bus_time(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(configuration, "--lockstep")
    Robot(configuration, wire, bus).steps(120)
    run("cansend", "vcan0", "20000088#0000000000000000")
    process.wait_for_bus("errors")
    run("ip", "link", "set", "vcan0", "down")
    process.wait_for_bus("does not take frames")
    process.end()
    times = [event["time_s"] for event in process.events()]
    assert times == sorted(times)
    assert times[-1] == 0.119, "the time of the newest cycle"


def test_a_reader_that_does_not_read_does_not_block_the_process(
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
        for number in range(2000):  # this many lines of 70 bytes exceed a pipe's buffer
            error = can.Message(arbitration_id=0x40 if number % 2 else 0x100, is_error_frame=True, data=bytes(8))
            bus.send(error)
            if number % 200 == 0:
                robot.live(CALM_PERIOD_S, CALM_PERIOD_S)
        robot.live(5 * CALM_PERIOD_S, CALM_PERIOD_S)
        assert robot.answer is not None
        assert robot.answer["Cycle"] in {(robot.cycle - back) & 0xF for back in range(4)}, "it still answers"
    finally:
        process.terminate()
        process.stdout.close()
        assert process.wait(20) == 0


def test_a_stopped_terminal_does_not_block_the_process(
    tmp_path: Path, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    """Ctrl-S, a pager, a stalled connection: a write to a terminal blocks although poll reported space."""
    path = tmp_path / "block.bin"
    path.write_bytes(calm.block())
    master, terminal = os.openpty()
    command = [bus_guard.RELEASE, "--channel", "vcan0", "--robot", "ku_dex", "--config", path]
    process = subprocess.Popen(command, stdout=terminal)
    try:
        assert b"start tauperp-guard" in os.read(master, 1000)
        for number in range(4000):
            error = can.Message(arbitration_id=0x40 if number % 2 else 0x100, is_error_frame=True, data=bytes(8))
            bus.send(error)
            if number % 200 == 0:
                time.sleep(0.02)
        robot = Robot(calm, wire, bus)
        robot.live(5 * CALM_PERIOD_S, CALM_PERIOD_S)
        assert robot.answer is not None, "it still answers"
    finally:
        process.terminate()
        try:
            assert process.wait(20) == 0
        finally:
            process.kill()
            os.close(master)
            os.close(terminal)


def test_lines_for_a_closed_stdout_are_not_sent_to_the_bus(
    tmp_path: Path, calm: Configuration, bus: can.BusABC, wire: Wire
) -> None:
    """Otherwise a socket would get the descriptor of stdout, and a line of 72 bytes would be a CAN FD frame."""
    path = tmp_path / "block.bin"
    path.write_bytes(calm.block())
    guard = f"exec {bus_guard.RELEASE} --channel vcan0 --robot ku_dex --config {path} <&- >&- 2>&-"
    process = subprocess.Popen(["bash", "-c", guard])
    try:
        robot = Robot(calm, wire, bus)
        robot.live(5 * CALM_PERIOD_S, CALM_PERIOD_S)
        assert robot.answer is not None
        files = {path.name: os.readlink(path) for path in Path(f"/proc/{process.pid}/fd").iterdir()}
        assert [files[name] for name in "012"] == ["/dev/null"] * 3
    finally:
        process.terminate()
        assert process.wait(20) == 0


def test_the_memory_map_stays_the_same_after_the_first_line(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    """A process that allocates, including libc, has a heap or maps pages."""
    process = start(calm, program=bus_guard.RELEASE)
    before = _maps(process)
    robot = Robot(calm, wire, bus)
    run_until_permitted(process, robot)
    for error in ("20000004#0001000000000000", "20000040#0000000000000000", "20000100#0000000000000000"):
        run("cansend", "vcan0", error)
    robot.live(3 * CALM_PERIOD_S, CALM_PERIOD_S)
    reset(robot)
    run("ip", "link", "set", "vcan0", "down")
    process.wait_for_bus("does not take frames")
    run("ip", "link", "del", "vcan0")
    run("ip", "link", "add", "vcan0", "type", "vcan")
    run("ip", "link", "set", "vcan0", "mtu", "72", "up")
    process.wait_for_bus("reopened")
    after = _maps(process)
    assert [line for line in after if "[stack]" in line]
    assert [line for line in after if "[heap]" in line] == []
    assert after == before


def _maps(process: bus_guard.GuardProcess) -> list[str]:
    return Path(f"/proc/{process.process.pid}/maps").read_text().splitlines()


def test_no_imported_function_allocates() -> None:
    """The process has no heap from its first line on. The libc calls below need none either."""
    symbols = run("nm", "--dynamic", "--undefined-only", str(bus_guard.RELEASE)).split()
    names = {symbol.partition("@")[0] for symbol in symbols}
    assert "epoll_wait" in names
    assert (
        names & {"malloc", "calloc", "realloc", "free", "strdup", "asprintf", "fopen", "getline", "aligned_alloc"}
        == set()
    )
