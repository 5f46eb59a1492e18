"""The compiled guard under faults of cycles, evaluation and time, on several arms, rates and numeric types."""

import pytest
from guard_rig import CLOCK_WINDOW, JOINT_DEADLINE, LONG, TASK_DEADLINE, Case, Frames, Rig, on_every_case, random_of

from tauperp.firmware import Reason, Verdict

# --- cycles -----------------------------------------------------------------------------------------------------------


@on_every_case
@pytest.mark.parametrize("stride", [17, 33, 0x4001, 16, 5, -1, -15, 0])
def test_cycle_numbers_that_do_not_advance_by_one_never_permit(case: Case, stride: int) -> None:
    rig = Rig(case)
    assert rig.permitted_within(600, lambda: rig.step(stride)) is None


@on_every_case
@pytest.mark.parametrize("stride", [17, 0x2001, -47])
def test_a_jump_ends_the_permission_at_once_and_never_hides_a_contact(case: Case, stride: int) -> None:
    rig = Rig(case).started()
    rig.contact = rig.push
    assert not rig.step(stride).permitted
    assert rig.verdict is not None
    assert rig.verdict.reason == Reason.CYCLE_JUMP
    assert rig.permitted_within(600) is None


@on_every_case
@pytest.mark.parametrize("seed", range(3))
def test_a_contact_is_detected_under_any_sequence_of_cycle_numbers(case: Case, seed: int) -> None:
    """Cycle steps of a lossy bus, and sometimes a jump. The contact starts at a random cycle."""
    rig, random = Rig(case), random_of(case, seed)
    ask, begin, permitted = rig.resets(), int(random.integers(300, 900)), 0
    for k in range(1500):
        if k == begin:
            rig.contact = rig.push
        any_stride = int(random.integers(1, 65536))
        stride = int(random.choice([1, 2, 3, 17, -3, any_stride], p=[0.97, 0.01, 0.01, 0.004, 0.003, 0.003]))
        ask()
        permitted += rig.step(stride).permitted and k > begin
    assert permitted <= rig.reaction_cycles


@on_every_case
def test_from_power_on_in_contact_there_is_no_permission(case: Case) -> None:
    rig = Rig(case)
    rig.contact = rig.push
    assert rig.permitted_within(1200) is None


# --- evaluation -------------------------------------------------------------------------------------------------------


@on_every_case
def test_cycles_that_no_tick_evaluates_end_the_permission_at_the_joint_deadline(case: Case) -> None:
    """The next Sync is received before the tick every time, so each complete snapshot is dropped."""
    rig = Rig(case).started()
    rig.advance()
    rig.receive(rig.all_frames())

    def step() -> Verdict:
        rig.advance()
        rig.receive([rig.sync(), rig.task()])
        verdict = rig.tick()
        rig.receive(rig.joints())
        return verdict

    stopped = rig.stopped_within(LONG, step)
    assert stopped is not None
    assert stopped <= JOINT_DEADLINE + 1
    assert rig.permitted_within(600, step) is None


@on_every_case
@pytest.mark.parametrize("seed", range(3))
def test_a_permission_follows_an_evaluation_in_any_order_of_frames_and_ticks(case: Case, seed: int) -> None:
    """Rig.tick asserts the rule. Here frames are late, lost, repeated and in any order, with ticks in between."""
    rig, random = Rig(case).started(), random_of(case, seed)
    ask = rig.resets()
    waiting: Frames = []
    permitted = evaluated = 0
    for _ in range(1500):
        rig.advance()
        waiting += rig.all_frames()
        if random.random() < 0.1:
            random.shuffle(waiting)
        keep = int(random.integers(0, 4)) if random.random() < 0.05 else 0
        now, waiting = waiting[: len(waiting) - keep], waiting[len(waiting) - keep :]
        rig.receive(frame for frame in now if random.random() > 0.002)
        ask()
        verdict = rig.tick()
        permitted += verdict.permitted
        evaluated += verdict.fresh
    assert evaluated > 0
    assert permitted <= evaluated + JOINT_DEADLINE * (1500 - evaluated)


# --- time -------------------------------------------------------------------------------------------------------------


@on_every_case
@pytest.mark.parametrize("rate", [0.01, 0.05, 0.3, 0.5, 0.72])
def test_a_slow_clock_never_permits(case: Case, rate: float) -> None:
    rig = Rig(case)
    rig.clock_rate = rate
    assert rig.permitted_within(1200) is None


@on_every_case
@pytest.mark.parametrize("rate", [1.28, 1.5, 1.9])
def test_a_fast_clock_never_permits(case: Case, rate: float) -> None:
    rig = Rig(case)
    rig.clock_rate = rate
    assert rig.permitted_within(1200) is None


@on_every_case
@pytest.mark.parametrize("rate", [0.8, 1.0, 1.2])
def test_a_clock_error_within_a_quarter_is_accepted(case: Case, rate: float) -> None:
    rig = Rig(case)
    rig.clock_rate = rate
    assert rig.permitted_within(LONG) is not None
    assert rig.stopped_within(500) is None


@on_every_case
@pytest.mark.parametrize("rate", [0.0, 0.02, 0.2, 0.5, 1.5])
def test_a_clock_that_changes_its_rate_ends_the_permission_within_two_windows(case: Case, rate: float) -> None:
    rig = Rig(case).started()
    rig.clock_rate = rate
    stopped = rig.stopped_within(LONG)
    assert stopped is not None
    assert stopped <= 2 * CLOCK_WINDOW


@on_every_case
@pytest.mark.parametrize("rate", [0.0, 0.02, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("silent", ["task", "joint"])
def test_silence_is_detected_by_cycles_whatever_the_clock_shows(case: Case, rate: float, silent: str) -> None:
    rig = Rig(case).started()
    rig.clock_rate = rate

    def step() -> Verdict:
        rig.advance()
        rig.receive([rig.sync(), *rig.joints()] if silent == "task" else rig.all_frames()[:-1])
        return rig.tick()

    stopped = rig.stopped_within(LONG, step)
    assert stopped is not None
    assert stopped <= (TASK_DEADLINE if silent == "task" else JOINT_DEADLINE) + 1
