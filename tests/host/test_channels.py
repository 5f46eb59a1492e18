"""Two channels on the same frames: they agree on any arm, and a fault in one of them stops the robot with its reason.

`Arm` makes the frames of a cycle; `Rig` feeds a guard. `Replayed` keeps frames in C, for many bit flips.
"""

import dataclasses
from collections import Counter
from collections.abc import Iterable, Iterator

import can
import numpy as np
import pytest
from robot_makers import random_robot

from tauperp.config import Configuration, load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Core, Guard, Reason, State, Verdict
from tauperp.robot import Robot
from tauperp.wire import E2EStatus, Receiver, Sender

SEED = 20261129
PERMISSION, PERMISSION_WITHOUT_COPY = 0xE1, 0xF1  # both copies of StopCommand's third byte
POINTER_BYTES = 8  # at the start of a state: a wrong pointer is a memory fault, which the board's MPU detects
SETTLED = 600  # cycles in which a guard becomes ready, and a trip may be reset


def configuration_of(robot: str | Robot, preset: str = "default") -> Configuration:
    return load_configuration(preset, robot=robot)


def pair_of(configuration: Configuration, second: Configuration | None = None) -> Guard:
    return Guard(configuration.block(), second=(second or configuration).block("q9.22"))


class Rig:
    """An arm, its controller and a board that ticks once a cycle. `contact`: torque from outside, (n,) Nm."""

    def __init__(self, configuration: Configuration, guard: Guard, seed: int = SEED) -> None:
        self.guard, self.n = guard, configuration.robot.n
        self._core = Core(configuration.robot, "float32", configuration)
        self._random = np.random.default_rng(seed)
        joints = configuration.robot.joints
        low, high = (np.array([getattr(joint, f"position_{end}") for joint in joints]) for end in ("min", "max"))
        self._middle, self._reach = (low + high) / 2, 0.45 * np.minimum((high - low) / 2, 3.0)
        self._speed = np.array([0.8 * joint.velocity_max for joint in joints])
        self._limit = np.array([0.9 * joint.torque_max for joint in joints])
        self._phase = self._random.uniform(0, 6, self.n)
        self.contact = np.zeros(self.n)
        self.task = 1
        self.moving = False
        self._time_s = 0.0
        self._fd = configuration.settings.wire.format == "fd"
        self._sender = Sender(configuration.wire, fd=self._fd)
        self._receiver = Receiver(configuration.wire)
        self.period_us = configuration.period_us
        self.now_us, self.cycle = 1_000_000, 1

    def _frame(self, name: str, **signals: float) -> can.Message:
        return self._sender.frame(name, signals, cycle=None if name == "GuardReset" else self.cycle)

    def frames(self) -> Iterator[can.Message]:
        rate = self._speed / np.maximum(self._reach, 0.1)
        angle = rate * self._time_s + self._phase
        q = self._middle + self._reach * np.sin(angle)
        qd = self._reach * rate * np.cos(angle) * self.moving
        gravity = self._core.terms(q, qd).gravity
        noise = self._random.uniform(-0.5, 0.5, self.n) * self.moving
        torque = np.clip(gravity + self.contact + noise, -self._limit, self._limit)
        wanted = self._random.uniform(-3, 3, 3) * self.moving
        yield self._frame("Sync", Cycle=self.cycle & 0xFFFF)
        yield self._frame("TaskCommand", Task=self.task, AccelX=wanted[0], AccelY=wanted[1], AccelZ=wanted[2])
        for i in range(self.n):
            yield self._frame(f"JointState{i + 1}", SensorStatus=0, Position=q[i], Velocity=qd[i], Torque=torque[i])

    def step(self, extra: Iterable[can.Message] = ()) -> Verdict:
        self.now_us += self.period_us
        self.cycle += 1
        self._time_s += self.period_us * 1e-6 * self.moving
        for frame in [*self.frames(), *extra]:
            self.guard.receive(frame, self.now_us)
        return self.guard.tick(self.now_us)

    def run(self, cycles: int) -> Verdict:
        for _ in range(cycles):
            verdict = self.step()
        return verdict

    def reset(self) -> Verdict:
        """As a person does: Request 0, then 1, naming the trip."""
        trip = self.step().trip_number
        for request in (0, 0, 1):
            verdict = self.step([self._frame("GuardReset", Request=request, TripNumber=trip)])
        return verdict

    def permit(self) -> Verdict:
        self.run(SETTLED)
        verdict = self.reset()
        assert verdict.permitted, verdict.reason
        return verdict


# --- agreement --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", ["default", "paper"])
@pytest.mark.parametrize("seed", range(3))
def test_the_channels_agree_on_a_random_arm_that_moves_at_its_limits(seed: int, preset: str) -> None:
    configuration = configuration_of(random_robot(SEED + seed, 7), preset)
    rig = Rig(configuration, pair_of(configuration), seed)
    verdict = rig.run(300)
    rig.moving = True
    for task in (1, 2, 3, 2, 1):
        rig.task = task
        rig.contact = rig._random.uniform(-20, 20, rig.n)
        verdict = rig.run(150)
        assert verdict.state is not State.FAULT, verdict.reason
    assert np.abs(verdict.residual).max() > 1.0  # the residual was not merely zero


def test_both_channels_permit_stop_and_take_a_reset_together() -> None:
    configuration = configuration_of("ku_dex")
    rig = Rig(configuration, pair_of(configuration))
    verdict = rig.permit()
    assert (verdict.permitted, rig.guard.channels) == (True, 2)
    rig.contact[1] = 40.0
    verdict = rig.run(60)
    assert (verdict.state, verdict.reason, verdict.trip_number) == (State.STOPPED, Reason.COLLISION, 1)
    rig.contact[:] = 0.0
    rig.run(SETTLED)
    assert rig.reset().permitted
    assert rig.run(200).permitted


# --- a fault in one channel -------------------------------------------------------------------------------------------


def heavier(configuration: Configuration, share: float) -> Configuration:
    """The same installation with another mass of the third link: a valid block, but another one."""
    joints = list(configuration.robot.joints)
    joints[2] = dataclasses.replace(joints[2], mass=joints[2].mass * (1 + share))
    robot = dataclasses.replace(configuration.robot, joints=tuple(joints))
    return Configuration(configuration.settings, robot, configuration.wire, configuration.source)


@pytest.mark.parametrize("first_is_wrong", [True, False])
def test_a_wrong_table_in_one_channel_is_a_fault_with_its_reason(first_is_wrong: bool) -> None:
    right = configuration_of("ku_dex")
    wrong = heavier(right, 0.01)
    guard = pair_of(wrong, right) if first_is_wrong else pair_of(right, wrong)
    verdict = Rig(right, guard).run(SETTLED)
    assert (verdict.state, verdict.reason) == (State.FAULT, Reason.CHANNELS_DISAGREE)
    assert verdict.stop_category == right.settings.stop.fault


@pytest.mark.parametrize("first_is_sensitive", [True, False])
def test_a_trip_of_one_channel_alone_stops_both_and_can_be_reset(first_is_sensitive: bool) -> None:
    keen, dull = (
        load_configuration("default", robot="ku_dex", overrides={"task": {"none": {"threshold_nm": threshold}}})
        for threshold in (0.4, 4.0)
    )
    rig = Rig(dull, pair_of(keen, dull) if first_is_sensitive else pair_of(dull, keen))
    rig.permit()
    rig.contact[1] = 2.0
    verdict = rig.run(100)
    assert (verdict.state, verdict.reason, verdict.joint) == (State.STOPPED, Reason.COLLISION, 2)
    assert 0.4 < abs(verdict.value_nm) < 2.1
    rig.contact[:] = 0.0
    rig.run(SETTLED)
    assert rig.reset().permitted


def test_different_states_of_the_channels_are_a_fault_at_once() -> None:
    configuration = configuration_of("ku_dex")
    rig = Rig(configuration, pair_of(configuration))
    rig.run(SETTLED)  # both wait for the reset
    guard = rig.guard._guard
    guard.state, guard.state_inverted = 3, ~3 & 0xFFFFFFFF
    guard.acknowledged = rig.guard.library.lib.GUARD_SET
    verdict = rig.step()
    assert not verdict.permitted
    assert verdict.frames[0].data[2] != PERMISSION
    assert (verdict.state, verdict.reason) == (State.FAULT, Reason.CHANNELS_DISAGREE)


def test_the_second_channel_does_not_confirm_a_permission_that_only_the_first_one_gives() -> None:
    configuration = configuration_of("ku_dex")
    alone, rig = Rig(configuration, Guard(configuration.block())), Rig(configuration, pair_of(configuration))
    permission = alone.permit().frames[0]
    assert permission.data[2] == PERMISSION
    rig.run(alone.cycle - rig.cycle)  # waits for a reset
    library, frame = rig.guard.library, rig.guard.frame_of(permission)
    library.lib.tauperp_second_confirm(library.ffi.addressof(rig.guard._state, "second"), frame)
    assert frame.data[2] == PERMISSION_WITHOUT_COPY
    received = Receiver(configuration.wire).receive(rig.guard._message(frame, 0))
    assert received is not None
    assert received.status is E2EStatus.INITIAL  # its CRC is right


class Replayed:
    """A pair that permits, and the frames of what follows: 30 cycles of rest, then a push."""

    def __init__(self) -> None:
        self.configuration = configuration = configuration_of("ku_dex")
        rig = Rig(configuration, pair_of(configuration))
        rig.permit()
        self.guard = rig.guard
        self._lib, self._ffi = rig.guard.library.lib, rig.guard.library.ffi
        self.state = self._ffi.buffer(rig.guard._state)
        self.start = bytes(self.state)
        self.cycles = []
        for cycle in range(90):
            if cycle == 30:
                rig.contact[1] = 40.0
            rig.now_us += rig.period_us
            rig.cycle += 1
            self.cycles.append((rig.now_us, [self._copy(frame) for frame in rig.frames()]))
        self._out = self._ffi.new("guard_output_t *")

    def _copy(self, frame: can.Message) -> object:
        copy = self._ffi.new("can_frame_t *")
        copy[0] = self.guard.frame_of(frame)[0]
        return copy

    def run(self, byte: int, bit: int) -> str:
        """The outcome of one flipped bit."""
        self.state[:] = self.start
        self.state[byte] = bytes([self.state[byte][0] ^ (1 << bit)])
        permitted = []
        for now_us, frames in self.cycles:
            for frame in frames:
                self._lib.pair_receive(self.guard._state, frame, now_us)
            self._lib.pair_tick(self.guard._state, now_us, self._out)
            permission = self._out.frame[0].data[2]
            permitted.append(permission == PERMISSION)
        if permitted[-1]:
            return "undetected and wrong"
        if all(permitted[:30]):
            return "no effect"
        return "detected and stopped" if self._out.state == State.FAULT else "stopped without need"


def test_no_flipped_bit_in_the_state_of_either_channel_keeps_a_permission_through_a_push() -> None:
    """400 bits, seeded; the state of the first channel, then that of the second one."""
    replayed, random = Replayed(), np.random.default_rng(SEED)
    outcomes: Counter[str] = Counter()
    second = replayed.guard.library.ffi.offsetof("pair_t", "second")
    pointers = {*range(POINTER_BYTES), *range(second, second + POINTER_BYTES)}
    for byte in random.integers(len(replayed.start), size=400).tolist():
        if byte in pointers:
            continue
        outcomes[replayed.run(byte, int(random.integers(8)))] += 1
    print(outcomes)
    assert outcomes["undetected and wrong"] == 0
    assert outcomes["detected and stopped"] > 0


def test_a_flipped_bit_of_the_second_block_is_detected() -> None:
    configuration = configuration_of("ku_dex")
    rig = Rig(configuration, pair_of(configuration))
    rig.permit()
    rig.guard._second_block[200] ^= 1 << 17
    verdict = rig.run(400)
    assert verdict.state is State.FAULT
    assert verdict.reason in (Reason.CONFIG_CORRUPT, Reason.CHANNELS_DISAGREE)


# --- one channel, and what is refused ---------------------------------------------------------------------------------


@pytest.mark.parametrize("channels", [1, 2])
def test_guard_status_reports_the_number_of_channels(channels: int) -> None:
    configuration = configuration_of("ku_dex")
    guard = pair_of(configuration) if channels == 2 else Guard(configuration.block())
    rig = Rig(configuration, guard)
    frames = [frame for _ in range(40) for frame in rig.step().frames[1:]]
    receiver = Receiver(configuration.wire)
    received = [one for frame in frames if (one := receiver.receive(frame)) is not None]
    assert {one.signals["Channels"] for one in received if "Channels" in one.signals} == {channels}


def test_blocks_of_two_installations_are_refused() -> None:
    first, other = configuration_of("ku_dex"), configuration_of("panda")
    with pytest.raises(InputError, match="different installations"):
        pair_of(first, other)


def test_the_first_channel_is_float32() -> None:
    block = configuration_of("ku_dex").block("q9.22")
    with pytest.raises(InputError, match="first of two channels is in float32"):
        Guard(block, second=block)
