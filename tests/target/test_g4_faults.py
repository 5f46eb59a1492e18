"""The injector of faults into the emulated stm32g4 image (tools/faults/g4_faults.py): a small seeded part of its run,
and that its judge can fail."""

import sys
from dataclasses import dataclass
from random import Random

import pytest
from checkout import ROOT
from g4_images import g4_image
from unicorn import arm_const as arm

sys.path.insert(0, str(ROOT / "tools" / "faults"))

import g4_faults
from g4_faults import DETECTED, NONE, PLACES, WRONG, Flip, Injector, is_fault, is_ordinary_stop
from g4_time import TIME, disturbance
from record import record

from tauperp.firmware import reaction_us

from g4.board import FLASH, FLASH_BYTES, Snapshot  # isort: skip
from g4.fdcan import Frame  # isort: skip
from g4.peer import STOP_COMMAND  # isort: skip

pytestmark = [pytest.mark.needs("arm"), pytest.mark.slow]
CYCLES, SILENCE = 1000, 900  # of the recording, and the cycle from which on the robot sends nothing


@dataclass
class Rig:
    injector: Injector
    snapshots: dict[int, Snapshot]

    def inject(self, seed: int) -> tuple[str, int, int, str]:
        """Fault `seed`, 20 cycles before the silence."""
        ((start, snapshot),) = self.snapshots.items()
        return self.injector.inject(start, snapshot, Random(seed))


@pytest.fixture(scope="module")
def rig() -> Rig:
    run = record("contact", 1, CYCLES)
    cycles = run.cycles[:SILENCE] + [(now_us, []) for now_us, _ in run.cycles[SILENCE:]]
    period_us = cycles[1][0] - cycles[0][0]
    reaction = -(-reaction_us(run.blocks[0]) // period_us)
    injector = Injector(g4_image("contact-float", run.blocks[0]), 1, reaction, cycles)
    snapshots = dict(injector.run_reference([SILENCE - 20]))
    return Rig(injector, snapshots)


def test_the_reference_permits_until_the_robot_is_silent(rig: Rig) -> None:
    permits = rig.injector.reference.permits
    assert all(permits[SILENCE - 20 : SILENCE])
    assert not any(permits[SILENCE + 10 :])


def test_faults_in_every_place_are_never_wrong_and_have_the_same_outcome_again(rig: Rig, seed: int) -> None:
    found = [rig.inject(100 * seed + number) for number in range(60)]
    assert {place for place, *_ in found} == set(PLACES)
    assert {NONE, DETECTED} <= {outcome for _, outcome, *_ in found}
    assert WRONG not in {outcome for _, outcome, *_ in found}
    assert [rig.inject(100 * seed + number) for number in range(5)] == found[:5]


def test_a_permission_that_the_reference_did_not_give_is_wrong(rig: Rig) -> None:
    reference = rig.injector.reference
    permits, answers = list(reference.permits), list(reference.answers)
    reference.permits[:] = [False] * len(permits)
    reference.answers[SILENCE - 20 :] = [[]] * (CYCLES - SILENCE + 20)
    outcomes = {rig.inject(number)[1] for number in range(20)}
    reference.permits[:], reference.answers[:] = permits, answers
    assert WRONG in outcomes


def test_the_faults_of_time_have_the_ranges_of_the_library() -> None:
    drawn = [disturbance(Random(number), 5, 5000, 1000) for number in range(500)]
    assert {fault.way for fault in drawn} == {"fast", "slow", "stopped", "back", "forward", "missed", "late"}
    for fault in drawn:
        assert str(fault).startswith(TIME)
        assert fault.timer_us(5, 5000) == max(0, 5000 + fault.delay_us * (fault.factor == 1.0) + fault.step_us)
        assert fault.stands(5) == (fault.way == "missed")
        assert not fault.stands(45)
        assert fault.late_us(45, 45_000) == 45_000
        assert (fault.timer_us(45, 45_000) == 45_000) == (fault.way in ("missed", "late"))


def test_nothing_of_a_fault_remains_in_the_emulator(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """`bx r0` instead of `mov r4, r0`: the core ends in a state in which Unicorn forgets no translated code."""
    ((start, snapshot),) = rig.snapshots.items()
    code = bytes(rig.injector._board.core.mem_read(FLASH, FLASH_BYTES))
    moves = [FLASH + at for at in range(0, len(code), 4) if code[at : at + 2] == b"\x04\x46"]
    assert moves
    monkeypatch.setattr(g4_faults, "PLACES", ("code",))
    for address in moves:
        flip = Flip("code", 0x100, address)
        monkeypatch.setattr(rig.injector, "_choose", lambda *_, flip=flip: flip)
        outcomes = {rig.inject(number)[1] for number in range(2)}
        assert rig.injector.is_clean(start, snapshot), (hex(address), outcomes)


def test_an_exception_with_the_stack_in_flash_is_a_lockup_and_writes_nothing(rig: Rig) -> None:
    board = rig.injector._board
    board.restore(*rig.snapshots.values())
    flash = board.core.mem_read(FLASH, FLASH_BYTES)
    board.core.reg_write(arm.UC_ARM_REG_SP, FLASH + 0x1000)
    board.core.reg_write(arm.UC_ARM_REG_PC, 0xF0000001)
    board.run()
    assert board.halted
    assert board.core.mem_read(FLASH, FLASH_BYTES) == flash


def test_a_stop_command_that_a_fault_has_shortened_is_no_stop() -> None:
    whole = bytes([0, 0, 0xF0, 0, 1])
    stops = [Frame(STOP_COMMAND, whole[:length]) for length in range(len(whole) + 1)]
    assert [is_fault([stop]) or is_ordinary_stop([stop]) for stop in stops] == [False] * len(whole) + [True]
