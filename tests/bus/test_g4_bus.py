"""The emulated stm32g4 board on a real vcan0 against the simulated robot: the bytes of the library."""

import can
import pytest
from g4_images import g4_image, slice_of

from tauperp.bus import open_bus
from tauperp.firmware import Reason
from tauperp.run.lockstep import Lockstep
from tauperp.run.scenario import load_scenario, shipped

from g4.board import Board  # isort: skip
from g4.peer import EmulatedGuard, Enough, Twin  # isort: skip

pytestmark = pytest.mark.needs("arm")
FRAME_TIMEOUT_S = 60.0


def socket() -> can.BusABC:
    return open_bus(interface="socketcan", channel="vcan0", fd=True)


@pytest.mark.parametrize("name", ["payload", "contact"])
def test_an_experiment_on_the_bus_has_the_same_bytes_as_with_the_library(name: str) -> None:
    scenario = load_scenario(shipped(name))
    block = scenario.configuration.block()
    image = g4_image(f"{name}-float", block)
    with socket() as robot, socket() as bus:
        peer = EmulatedGuard(bus, Board(image), Twin(block), FRAME_TIMEOUT_S, limit=slice_of(name, "bus"))
        try:
            trace = Lockstep(scenario, robot, peer).run()
        except Enough:
            assert peer.board.lines.count("permission") == 1
            return
    assert trace.finished
    assert [stop.reason for stop in trace.stops].count(Reason.COLLISION) == len(trace.contacts) > 0
