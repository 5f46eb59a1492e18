"""`tauperp monitor` on a real interface."""

import json
import subprocess
import sys

import can
from bus_kit import Start, run
from bus_robot import CALM_PERIOD_S, Robot, open_channel, run_until_permitted

from tauperp.config import Configuration
from tauperp.wire import Wire


def test_the_monitor_continues_after_its_interface_was_down(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    run_until_permitted(process, robot)
    command = [sys.executable, "-m", "tauperp.cli", "monitor", "--json", "--every", "0.3", "--rate", "5"]
    monitor = subprocess.Popen(
        [*command, "--interface", "socketcan", "--channel", "vcan0"], stdout=subprocess.PIPE, text=True
    )
    try:
        assert monitor.stdout is not None
        lines = (json.loads(line) for line in monitor.stdout)
        robot.live(2 * CALM_PERIOD_S, CALM_PERIOD_S)
        assert next(line for line in lines if line["heard"])["error_frames"] == 0
        run("ip", "link", "set", "vcan0", "down")
        assert not next(line for line in lines if line["error_frames"] == 1 and not line["heard"])["permitted"]
        run("ip", "link", "set", "vcan0", "up")
        process.wait_for_bus("takes frames again")
        with open_channel("vcan0") as again:
            Robot(calm, wire, again).live(2 * CALM_PERIOD_S, CALM_PERIOD_S)
            back = next(line for line in lines if line["heard"])
        assert not back["permitted"]
    finally:
        monitor.terminate()
        monitor.wait(20)
