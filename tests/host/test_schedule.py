"""firmware/schedule as the host's guard node uses it: the same ticks as a guard that is driven cycle by cycle."""

import can
import numpy as np
import pytest

from tauperp.config import Configuration, load_configuration
from tauperp.firmware import Core, Guard, Reason, Schedule, State
from tauperp.wire import Sender

SILENCE_US = 250_000  # LOCKSTEP_SILENCE_US


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    return load_configuration("default", robot="ku_dex")


class Still:
    """The frames of an arm at rest."""

    def __init__(self, configuration: Configuration) -> None:
        self.n = configuration.robot.n
        self.q = np.array([0.3, 0.6, -0.2, 0.9, 0.1, -0.5, 0.2])[: self.n]
        self.torque = Core(configuration.robot, config=configuration).terms(self.q, 0 * self.q).gravity
        self.sender = Sender(configuration.wire, fd=configuration.settings.wire.format == "fd")

    def cycle(self, number: int) -> list[can.Message]:
        task = {"Task": 1, "AccelX": 0.0, "AccelY": 0.0, "AccelZ": 0.0}
        frames = [
            self.sender.frame("Sync", {"Cycle": number & 0xFFFF}, cycle=number),
            self.sender.frame("TaskCommand", task, cycle=number),
        ]
        for joint in range(self.n):
            signals = {"SensorStatus": 0, "Position": self.q[joint], "Velocity": 0.0, "Torque": self.torque[joint]}
            frames.append(self.sender.frame(f"JointState{joint + 1}", signals, cycle=number))
        return frames


def test_in_lockstep_every_answer_is_that_of_a_guard_driven_cycle_by_cycle(configuration: Configuration) -> None:
    scheduled, driven, arm = Guard(configuration.block()), Guard(configuration.block()), Still(configuration)
    schedule = Schedule(scheduled, in_lockstep=True, now_us=0)
    rng = np.random.default_rng(8)
    clock_us = 0
    answers: list[bytes] = []
    wanted: list[bytes] = []
    for number in range(200):
        now_us = number * configuration.period_us
        for frame in arm.cycle(number):
            clock_us += int(rng.integers(1, 40_000))  # any delay of the bus
            answers += [bytes(sent.data) for verdict in schedule.receive(frame, clock_us) for sent in verdict.frames]
            driven.receive(frame, now_us)
        wanted += [bytes(sent.data) for sent in driven.tick(now_us).frames]
    assert answers == wanted  # no frame of the first cycle can be accepted: its answer comes with the second Sync


def test_in_lockstep_a_silent_bus_ends_an_open_cycle_once(configuration: Configuration) -> None:
    schedule, arm = Schedule(Guard(configuration.block()), in_lockstep=True, now_us=0), Still(configuration)
    for frame in arm.cycle(0)[:-1]:
        assert schedule.receive(frame, 10) == []
    assert schedule.look(10 + SILENCE_US - 1) == []
    assert len(schedule.look(10 + SILENCE_US)) == 1
    assert schedule.look(10 + 9 * SILENCE_US) == []


def test_in_real_time_the_clock_causes_ticks_on_a_silent_bus(configuration: Configuration) -> None:
    schedule = Schedule(Guard(configuration.block()), in_lockstep=False, now_us=1000)
    assert len(schedule.look(1000)) == 1
    assert schedule.look(1000 + configuration.period_us - 1) == []
    assert len(schedule.look(1000 + configuration.period_us)) == 1


def test_a_guard_in_fault_ticks_once_per_cycle_without_a_snapshot(configuration: Configuration) -> None:
    guard, arm = Guard(configuration.block()), Still(configuration)
    schedule = Schedule(guard, in_lockstep=False, now_us=0)
    guard.trip(Reason.STATE_CORRUPT)
    ticks = []
    for number in range(20):
        frames = [*arm.cycle(number), arm.sender.frame("GuardReset", {"Request": 0, "TripNumber": 0})]
        ticks.append([len(schedule.receive(frame, number * configuration.period_us)) for frame in frames])
    assert [sum(cycle) for cycle in ticks] == [0] + [1] * 19  # no frame of the first cycle can be accepted
    assert all(cycle[-1] == 0 for cycle in ticks), "a GuardReset after the answer causes no second answer"
    assert schedule.tick(20 * configuration.period_us).state == State.FAULT
