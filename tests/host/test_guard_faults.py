"""The compiled guard with faults of controller, clock and bus, judged from outside: several arms, rates, numeric
types."""

import dataclasses
import itertools
from collections.abc import Callable, Iterable

import can
import numpy as np
import pytest

from tauperp.config import Configuration, Numeric, load_configuration
from tauperp.firmware import Core, Guard, Reason, State, Verdict, reaction_us
from tauperp.wire import Sender

JOINT_DEADLINE = 4  # cycles, the DBC's
TASK_DEADLINE = 8
CLOCK_WINDOW = 64  # cycles over which the guard compares its clock with the cycles
LONG = 4000  # cycles in which all effects have happened
GAIN_PER_S = {1000: 50.0, 500: 50.0, 100: 40.0, 20: 15.0}

Frames = list[can.Message]


@dataclasses.dataclass(frozen=True)
class Case:
    """One installation that the tests run on."""

    robot: str
    rate_hz: int
    numeric: Numeric

    def __str__(self) -> str:
        return f"{self.robot}-{self.rate_hz}-{self.numeric}"

    def configuration(self) -> Configuration:
        overrides = {
            "wire": {"rate_hz": self.rate_hz, "format": "fd"},
            "observer": {"gain_per_s": GAIN_PER_S[self.rate_hz]},
            "reset": {"healthy_ms": max(100.0, 6e3 / GAIN_PER_S[self.rate_hz])},
        }
        return load_configuration("default", robot=self.robot, overrides=overrides)


CASES = (
    Case("ku_dex", 1000, "float32"),
    Case("panda", 500, "q9.22"),
    Case("iiwa7", 100, "float32"),
    Case("kinova3", 20, "q9.22"),
)
on_every_case = pytest.mark.parametrize("case", CASES, ids=str)


class Rig:
    """An arm at rest, its controller, and a board that ticks once a cycle. `contact`: torque from outside, (n,) Nm."""

    def __init__(self, case: Case) -> None:
        self.configuration = configuration = case.configuration()
        block = configuration.block(case.numeric)
        self.reaction_cycles = -(-reaction_us(block) // configuration.period_us)
        self.guard = Guard(block)
        self.n = self.guard.n
        joints = configuration.robot.joints
        wanted = np.array([0.3, -0.4, 0.2, -1.4, 0.4, 1.2, 0.5][: self.n])
        low, high = (np.array([getattr(joint, f"position_{end}") for joint in joints]) for end in ("min", "max"))
        self.q = np.clip(wanted, low + 0.1, high - 0.1)
        self.gravity = Core(configuration.robot, case.numeric, configuration).terms(self.q, np.zeros(self.n)).gravity
        self.push = np.array([0.25 * joint.torque_max for joint in joints]) * (np.arange(self.n) == 1)
        self.contact = np.zeros(self.n)
        self.sender = Sender(configuration.wire, fd=True)
        self.period_us = configuration.period_us
        self.clock_us = 1_000_000.0
        self.clock_rate = 1.0
        self.cycle = 1
        self.since_evaluated = LONG
        self.verdict: Verdict | None = None

    def frame(self, name: str, **signals: float) -> can.Message:
        return self.sender.frame(name, signals, cycle=None if name == "GuardReset" else self.cycle)

    def sync(self) -> can.Message:
        return self.frame("Sync", Cycle=self.cycle & 0xFFFF)

    def task(self) -> can.Message:
        return self.frame("TaskCommand", Task=1, AccelX=0.0, AccelY=0.0, AccelZ=0.0)

    def joints(self) -> Frames:
        torque = self.gravity + self.contact
        return [
            self.frame(f"JointState{i + 1}", SensorStatus=0, Position=self.q[i], Velocity=0.0, Torque=torque[i])
            for i in range(self.n)
        ]

    def advance(self, stride: int = 1) -> None:
        """To the next cycle, by the guard's clock and the controller's number."""
        self.clock_us += self.period_us * self.clock_rate
        self.cycle += stride

    def all_frames(self) -> Frames:
        return [self.sync(), self.task(), *self.joints()]

    def hear(self, frames: Iterable[can.Message]) -> None:
        for frame in frames:
            self.guard.receive(frame, int(self.clock_us))

    def tick(self) -> Verdict:
        verdict = self.verdict = self.guard.tick(int(self.clock_us))
        self.since_evaluated = 0 if verdict.fresh else self.since_evaluated + 1
        if verdict.permitted:
            assert self.since_evaluated <= JOINT_DEADLINE, "permitted, but nothing was evaluated"
            assert verdict.frames[0].data[2] == 0xE1
        else:
            assert verdict.frames[0].data[2] != 0xE1
        return verdict

    def step(self, stride: int = 1) -> Verdict:
        self.advance(stride)
        self.hear(self.all_frames())
        return self.tick()

    def resets(self) -> Callable[[], None]:
        """Each call is one frame of a square wave of Request, for the trip number that the guard reports."""
        requests = itertools.cycle((0, 0, 1))

        def ask() -> None:
            number = self.verdict.trip_number if self.verdict else 0
            self.hear([self.frame("GuardReset", Request=next(requests), TripNumber=number)])

        return ask

    def permitted_within(self, cycles: int, step: Callable[[], Verdict] | None = None) -> int | None:
        """Runs with a controller that permanently requests resets; cycles to the first permission, or None."""
        ask = self.resets()
        for k in range(cycles):
            ask()
            if (step or self.step)().permitted:
                return k
        return None

    def started(self) -> "Rig":
        assert self.permitted_within(LONG) is not None, self.verdict
        return self

    def stopped_within(self, cycles: int, step: Callable[[], Verdict] | None = None) -> int | None:
        return next((k for k in range(1, cycles + 1) if not (step or self.step)().permitted), None)


def random_of(case: Case, seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, CASES.index(case)])


# --- cycles -----------------------------------------------------------------------------------------------------------


@on_every_case
@pytest.mark.parametrize("stride", [17, 33, 0x4001, 16, 5, -1, -15, 0])
def test_cycle_numbers_that_do_not_advance_by_one_never_permit(case: Case, stride: int) -> None:
    rig = Rig(case)
    assert rig.permitted_within(600, lambda: rig.step(stride)) is None


@on_every_case
@pytest.mark.parametrize("stride", [17, 0x2001, -47])
def test_a_jump_ends_the_permission_at_once_and_a_contact_never_hides_behind_it(case: Case, stride: int) -> None:
    rig = Rig(case).started()
    rig.contact = rig.push
    assert not rig.step(stride).permitted
    assert rig.verdict is not None
    assert rig.verdict.reason == Reason.CYCLE_JUMP
    assert rig.permitted_within(600) is None


@on_every_case
@pytest.mark.parametrize("seed", range(3))
def test_a_contact_is_found_under_any_sequence_of_cycle_numbers(case: Case, seed: int) -> None:
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
    rig.hear(rig.all_frames())

    def step() -> Verdict:
        rig.advance()
        rig.hear([rig.sync(), rig.task()])
        verdict = rig.tick()
        rig.hear(rig.joints())
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
        rig.hear(frame for frame in now if random.random() > 0.002)
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
def test_a_clock_within_a_quarter_is_good_enough(case: Case, rate: float) -> None:
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
def test_silence_is_found_by_cycles_whatever_the_clock_says(case: Case, rate: float, silent: str) -> None:
    rig = Rig(case).started()
    rig.clock_rate = rate

    def step() -> Verdict:
        rig.advance()
        rig.hear([rig.sync(), *rig.joints()] if silent == "task" else rig.all_frames()[:-1])
        return rig.tick()

    stopped = rig.stopped_within(LONG, step)
    assert stopped is not None
    assert stopped <= (TASK_DEADLINE if silent == "task" else JOINT_DEADLINE) + 1


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
        rig.hear(broken(frame) if random.random() < share else frame for frame in rig.all_frames())
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
        rig.hear(frames)
        return rig.tick()

    assert rig.stopped_within(300, step) is not None


@on_every_case
def test_now_and_then_a_wrong_crc_has_no_consequence(case: Case) -> None:
    rig, random = Rig(case).started(), random_of(case, 0)

    def step() -> Verdict:
        rig.advance()
        rig.hear(broken(frame) if random.random() < 0.01 else frame for frame in rig.all_frames())
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
        rig.hear([rig.sync(), rig.task(), *(forged + genuine if before else genuine + forged)])
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
        rig.hear([rig.sync(), rig.task(), *(queue.pop(0) if len(queue) > late else [])])
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
            rig.hear(act(rig))
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
def test_a_contact_that_goes_on_is_one_contact(case: Case, seed: int) -> None:
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
