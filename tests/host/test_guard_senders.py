"""The compiled guard under faults of senders, stops and starts, on several arms, rates and numeric types."""

from collections.abc import Callable

import can
import numpy as np
import pytest
from guard_rig import JOINT_DEADLINE, Case, Frames, Rig, on_every_case, random_of

from tauperp.firmware import Reason, State, Verdict

# --- senders ----------------------------------------------------------------------------------------------------------


def broken(frame: can.Message) -> can.Message:
    frame.data[0] ^= 0x5A
    return frame


@on_every_case
@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_many_wrong_crcs_of_every_sender_end_the_permission(case: Case, share: float) -> None:
    rig, random = Rig(case).started(), random_of(case, 0)

    def step() -> Verdict:
        rig.advance()
        rig.receive(broken(frame) if random.random() < share else frame for frame in rig.all_frames())
        return rig.tick()

    assert rig.stopped_within(300, step) is not None
    assert rig.permitted_within(600, step) is None


@on_every_case
@pytest.mark.parametrize("sender", [0, 1, 2, 5])
def test_many_wrong_crcs_of_one_sender_end_the_permission(case: Case, sender: int) -> None:
    rig = Rig(case).started()

    def step() -> Verdict:
        rig.advance()
        frames = rig.all_frames()
        if rig.cycle % 4:
            frames[sender] = broken(frames[sender])
        rig.receive(frames)
        return rig.tick()

    assert rig.stopped_within(300, step) is not None


@on_every_case
def test_an_occasional_wrong_crc_has_no_consequence(case: Case) -> None:
    rig, random = Rig(case).started(), random_of(case, 0)

    def step() -> Verdict:
        rig.advance()
        rig.receive(broken(frame) if random.random() < 0.01 else frame for frame in rig.all_frames())
        return rig.tick()

    assert rig.stopped_within(2000, step) is None


@on_every_case
@pytest.mark.parametrize("every", [1, 2, 3])
@pytest.mark.parametrize("before", [True, False])
def test_a_second_sender_of_joint_frames_ends_the_permission(case: Case, every: int, before: bool) -> None:
    rig = Rig(case).started()

    def step() -> Verdict:
        rig.advance()
        genuine = rig.joints()
        forged = rig.joints() if rig.cycle % every == 0 else []
        rig.receive([rig.sync(), rig.task(), *(forged + genuine if before else genuine + forged)])
        return rig.tick()

    assert rig.stopped_within(100, step) is not None
    assert rig.permitted_within(600, step) is None


@on_every_case
@pytest.mark.parametrize("late", [1, 5, 15, 16, 32, 48])
def test_joints_that_are_late_by_any_number_of_cycles_permit_nothing(case: Case, late: int) -> None:
    rig = Rig(case)
    queue: list[Frames] = []

    def step() -> Verdict:
        rig.advance()
        queue.append(rig.joints())
        rig.receive([rig.sync(), rig.task(), *(queue.pop(0) if len(queue) > late else [])])
        return rig.tick()

    assert rig.permitted_within(600, step) is None


# --- stops and starts -------------------------------------------------------------------------------------------------


@on_every_case
def test_without_a_reset_nothing_is_permitted_after_any_start(case: Case) -> None:
    rig = Rig(case)
    assert all(not rig.step().permitted for _ in range(1200))
    assert rig.verdict is not None
    assert rig.verdict.reason == Reason.AWAITING_RESET


@on_every_case
def test_a_worse_event_after_a_collision_raises_the_category(case: Case) -> None:
    def silent(rig: Rig) -> Frames:
        return [rig.sync(), rig.task()]

    def board(reason: Reason) -> Callable[[Rig], Frames]:
        def act(rig: Rig) -> Frames:
            rig.guard.trip(reason)
            return rig.all_frames()

        return act

    for act in (silent, board(Reason.BUS_OFF), board(Reason.SHUTDOWN)):
        rig = Rig(case).started()
        rig.contact = rig.push
        assert rig.stopped_within(100) is not None
        first = rig.verdict
        assert first is not None
        assert (first.reason, first.stop_category) == (Reason.COLLISION, 2)
        for _ in range(JOINT_DEADLINE + 2):
            rig.advance()
            rig.receive(act(rig))
            verdict = rig.tick()
        assert verdict.state == State.STOPPED
        assert verdict.stop_category == 1
        assert verdict.trip_number == first.trip_number + 1


@on_every_case
@pytest.mark.parametrize("gone", [True, False])
def test_a_second_contact_after_a_collision_raises_the_category(case: Case, gone: bool) -> None:
    """On another joint, whether or not the first contact has ended."""
    rig = Rig(case).started()
    rig.contact = rig.push
    assert rig.stopped_within(100) is not None
    first = rig.verdict
    assert first is not None
    if gone:
        rig.contact = np.zeros(rig.n)
    for _ in range(1200):
        verdict = rig.step()
    assert (verdict.trip_number, verdict.stop_category) == (first.trip_number, 2)
    rig.contact = rig.contact + np.roll(rig.push, 2)
    for _ in range(100):
        verdict = rig.step()
    assert verdict.stop_category == 1
    assert verdict.trip_number == first.trip_number + 1


@on_every_case
@pytest.mark.parametrize("seed", range(3))
def test_a_lasting_contact_is_one_contact(case: Case, seed: int) -> None:
    """It varies by a fifth, and grows while the robot stops."""
    rig, random = Rig(case).started(), random_of(case, seed)
    rig.contact = rig.push
    assert rig.stopped_within(100) is not None
    first = rig.verdict
    assert first is not None
    stopping = 300_000 // rig.period_us
    for k in range(1500):
        rig.contact = rig.push * min(2.0, 1.0 + k / max(1, stopping)) * random.uniform(0.8, 1.0)
        verdict = rig.step()
    assert (verdict.trip_number, verdict.stop_category) == (first.trip_number, 2)
