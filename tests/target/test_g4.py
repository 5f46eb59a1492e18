"""The shipped stm32g4 image, unmodified in an emulator. Its answers equal those of the library byte for byte, and move
the simulated robot. Faults of its hardware end in silence with the pin low."""

from pathlib import Path

import pytest
from g4_images import g4_image, slice_of
from unicorn import arm_const

from tauperp.firmware import Reason
from tauperp.image import read_image
from tauperp.run.lockstep import Lockstep
from tauperp.run.scenario import load_scenario, shipped
from tauperp.run.virtual import LockstepBus

from g4.board import RAM, Board  # isort: skip
from g4.peer import EmulatedGuard, Enough, Twin  # isort: skip

pytestmark = pytest.mark.needs("arm")


def experiment(name: str, numeric: str) -> tuple[Path, bytes]:
    block = load_scenario(shipped(name)).configuration.block("float32" if numeric == "float" else "q9.22")
    return g4_image(f"{name}-{numeric}", block, numeric=numeric), block


@pytest.fixture(scope="module")
def board() -> Board:
    return Board(experiment("contact", "float")[0])


def ready(board: Board) -> Board:
    """The board after its first tick."""
    board.run()
    return board


@pytest.mark.parametrize("numeric", ["float", "fixed"])
@pytest.mark.parametrize("name", ["payload", "contact"])
def test_an_experiment_has_the_same_bytes_as_with_the_library(name: str, numeric: str) -> None:
    scenario = load_scenario(shipped(name))
    image, block = experiment(name, numeric)
    assert read_image(image).variant == "product"
    channel = f"g4-{name}-{numeric}"
    with LockstepBus(channel) as robot, LockstepBus(channel) as bus:
        peer = EmulatedGuard(bus, Board(image), Twin(block), limit=slice_of(name, numeric))
        try:
            trace = Lockstep(scenario, robot, peer).run()
        except Enough:
            assert peer.board.lines.count("permission") == 1
            return
    strikes = len(trace.contacts)
    assert trace.finished
    assert peer.cycles == len(trace.time_s)
    assert [stop.reason for stop in trace.stops].count(Reason.COLLISION) == strikes > 0
    assert peer.board.lines.count("permission") == strikes + 1
    assert (peer.board.faults, peer.board.resets) == (0, 0)


def test_an_answer_that_differs_is_detected() -> None:
    """The comparison can fail: the library gets another tick time, which one page of GuardStatus carries."""
    image, block = experiment("contact", "float")
    with LockstepBus("g4-differs") as bus:
        peer = EmulatedGuard(bus, Board(image), Twin(block))
        assert same_answers(peer, range(1, 60))
        peer.twin.guard.note_tick_time(7)
        assert not same_answers(peer, range(60, 120))


def same_answers(peer: EmulatedGuard, cycles: range) -> bool:
    """Whether both answers are equal in these cycles, without a robot."""
    same = True
    for cycle in cycles:
        peer.board.advance(1000 * cycle)
        same = same and peer.board.run() == peer.twin.receive([], 1000 * cycle)
    return same


def test_a_stopped_clock_causes_silence_and_the_watchdog_resets_the_board() -> None:
    board = ready(Board(experiment("contact", "float")[0]))
    board.timer_stands = True
    while board.resets == 0:
        board.advance(board.now_us + 1000)
        assert board.resets or board.run() == []
        assert board.now_us < 600_000
    board.timer_stands = False
    assert board.run()
    assert not board.gpio.permission
    assert any(line.startswith("start 3 restarts 1") for line in board.lines), board.lines


def test_without_its_crystal_the_board_sends_nothing_and_keeps_the_pin_low() -> None:
    board = Board(experiment("contact", "float")[0])
    board.rcc.crystal = False
    assert board.run() == []
    assert board.halted
    assert "the clock does not start: no guard" in board.lines
    assert not board.gpio.permission
    board.advance(1_000_000)
    assert board.resets == 1


def test_an_exception_lowers_the_pin_and_is_reported_at_the_next_start() -> None:
    board = ready(Board(experiment("contact", "float")[0]))
    board.gpio.write(0x18, 1 << 8)
    board.core.reg_write(arm_const.UC_ARM_REG_PC, 0x60000001)  # no memory there
    assert board.run() == []
    assert board.halted
    assert board.faults == 1
    assert not board.gpio.permission
    board.advance(10**6)
    board.run()
    assert any("before this start: exception" in line for line in board.lines)


def test_a_snapshot_restores_the_complete_board(board: Board) -> None:
    board.run()
    board.advance(board.now_us + 1000)
    before = board.snapshot()
    runs = []
    for _ in range(2):
        board.restore(before)
        answers = []
        for step in range(1, 40):
            board.advance(before.now_us + 1000 * step)
            answers += board.run()
        runs.append((answers, bytes(board.core.mem_read(RAM, 0x10000))))
    assert runs[0] == runs[1]
