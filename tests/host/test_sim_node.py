"""The robot as a bus node: it moves on a valid permission for this very cycle and on nothing else."""

from collections.abc import Iterator
from typing import Any

import can
import numpy as np
import pytest

from tauperp.robot import load
from tauperp.run.node import RobotNode
from tauperp.run.virtual import LockstepBus
from tauperp.sim.arm import Arm
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.motion import Mode, Motion, Move
from tauperp.sim.posture import home
from tauperp.sim.sensors import SensorFault, SensorModel, Sensors
from tauperp.sim.trajectory import Planner
from tauperp.wire import E2EStatus, Received, Receiver, Sender, Wire

PERIOD_S = 2e-3
ROBOT = load("ku_dex")
DYNAMICS = Dynamics(ROBOT)
PLANNER = Planner(ROBOT, DYNAMICS, PERIOD_S)
HOME = home(ROBOT, DYNAMICS)
TIP, ROTATION = DYNAMICS.tip(HOME)
IDEAL = SensorModel()
PERMISSION = {
    "Joint": 0,
    "Permission": 1,
    "PermissionInverted": 14,
    "StopCategory": 2,
    "Reason": 1,
    "TripNumber": 0,
    "IndexValue": 0.0,
    "Channel": 0,
    "FullSpeed": 1,
}
STOP = {**PERMISSION, "Permission": 0, "PermissionInverted": 15, "Reason": 6, "TripNumber": 3, "Joint": 4}


class Cell:
    """A robot on a bus, and a guard whose answers the test chooses."""

    def __init__(self, faults: tuple[SensorFault, ...] = (), sensors: SensorModel = IDEAL) -> None:
        self.wire = Wire.read()
        self.robot_bus, self.guard_bus = LockstepBus("test node"), LockstepBus("test node")
        arm = Arm(ROBOT, period_s=PERIOD_S)
        arm.reset(HOME)
        job = Move(tip_m=TIP + np.array((0.0, 0.3, 0.1)), rotation=ROTATION)
        self.motion = Motion(PLANNER, DYNAMICS, PERIOD_S, HOME, [job])
        readings = Sensors(sensors, ROBOT.n, np.random.default_rng(1), faults)
        self.node = RobotNode(self.robot_bus, self.wire, arm, readings, self.motion, fd=False)
        self.node.start(faults)
        self.sender, self.receiver = Sender(self.wire, fd=False), Receiver(self.wire)
        self.cycle = 0
        self.heard: list[Received] = []

    def answer(self, signals: dict[str, float], *, late: int = 0) -> can.Message:
        return self.sender.frame("StopCommand", {**signals, "Cycle": (self.cycle - late) & 0xF})

    def repeated(self, signals: dict[str, float]) -> can.Message:
        """Another guard's: with the counter of the previous frame."""
        frame = self.answer(signals)
        counter = (frame.data[1] & 0xF) - 1 & 0xF
        self.wire.message("StopCommand").seal(frame.data, counter)
        return frame

    def turn(self, *answers: can.Message) -> None:
        """One cycle in which the guard answers with these frames."""
        self.node.begin_cycle(self.cycle)
        self.heard = []
        while (frame := self.guard_bus.recv(timeout=0.0)) is not None:
            received = self.receiver.receive(frame)
            assert received is not None
            self.heard.append(received)
        for frame in answers:
            self.guard_bus.send(frame)
        self.node.end_cycle(self.cycle)
        self.cycle += 1

    def go(self, cycles: int, signals: dict[str, float] = PERMISSION) -> None:
        for _ in range(cycles):
            self.turn(self.answer(signals))

    def heard_of(self, name: str) -> list[Received]:
        return [received for received in self.heard if received.message.name == name]


@pytest.fixture
def cell() -> Iterator[Cell]:
    cell = Cell()
    yield cell
    cell.robot_bus.shutdown()
    cell.guard_bus.shutdown()


def test_a_cycle_has_sync_then_task_then_every_joint_in_order(cell: Cell) -> None:
    cell.go(2)
    names = [received.message.name for received in cell.heard]
    assert names == ["Sync", "TaskCommand", *(f"JointState{joint}" for joint in range(1, 8))]
    assert all(received.status is E2EStatus.OK for received in cell.heard)
    assert cell.heard[0].signals["Cycle"] == 1
    torque = [received.signals["Torque"] for received in cell.heard[2:]]
    assert np.allclose(torque, DYNAMICS.bias(HOME, np.zeros(7)), atol=0.02)


def test_it_moves_on_permission(cell: Cell) -> None:
    cell.go(300)
    assert cell.motion.mode is Mode.FOLLOWING
    assert np.abs(cell.node.sample.velocity).max() > 0.2


def broken(frame: can.Message) -> can.Message:
    frame.data[4] ^= 0x10
    return frame


def answers_that_permit_nothing() -> dict[str, Any]:
    return {
        "silence": lambda cell: [],
        "an answer to the previous cycle": lambda cell: [cell.answer(PERMISSION, late=1)],
        "a broken CRC": lambda cell: [broken(cell.answer(PERMISSION))],
        "permission without its inverse": lambda cell: [cell.answer({**PERMISSION, "PermissionInverted": 15})],
        "the inverse without permission": lambda cell: [cell.answer({**PERMISSION, "Permission": 0})],
        "a frame too many lost before it": lambda cell: [[cell.answer(PERMISSION) for _ in range(12)][-1]],
        "a stop": lambda cell: [cell.answer(STOP)],
        "a stop before a permission": lambda cell: [cell.answer(STOP), cell.answer(PERMISSION)],
        "a stop after a permission": lambda cell: [cell.answer(PERMISSION), cell.answer(STOP)],
        "a stop of another cycle": lambda cell: [cell.answer(STOP, late=1), cell.answer(PERMISSION)],
        "a stop whose counter was used": lambda cell: [cell.answer(PERMISSION), cell.repeated(STOP)],
    }


@pytest.mark.parametrize("case", answers_that_permit_nothing())
def test_without_a_valid_permission_it_stops_at_once(cell: Cell, case: str) -> None:
    cell.go(300)
    assert np.abs(cell.node.sample.velocity).max() > 0.2
    answers = answers_that_permit_nothing()[case]
    cell.turn(*answers(cell))
    assert not cell.node.permitted
    assert cell.motion.mode is Mode.STOPPING
    for _ in range(120):
        cell.turn()
    assert np.abs(cell.node.sample.velocity).max() < 0.02


def test_the_first_answer_does_not_permit(cell: Cell) -> None:
    """E2E: a receiver cannot know whether the first frame of a sender is fresh."""
    cell.turn(cell.answer(PERMISSION))
    assert not cell.node.permitted
    cell.turn(cell.answer(PERMISSION))
    assert cell.node.permitted


def test_silence_ends_with_brakes_and_new_permissions_release_them(cell: Cell) -> None:
    cell.go(300)
    for _ in range(150):
        cell.turn()
    assert cell.motion.brakes
    cell.go(20)
    assert not cell.motion.brakes
    cell.go(1500)
    assert cell.motion.finished


def test_at_rest_it_requests_a_reset_as_an_edge_with_the_trips_number(cell: Cell) -> None:
    cell.go(300)
    requests: list[tuple[bool, float, float]] = []
    for _ in range(1500):
        cell.go(1, STOP)
        for received in cell.heard_of("GuardReset"):
            if received.signals:
                ready = cell.motion.mode is Mode.READY
                requests.append((ready, received.signals["TripNumber"], received.signals["Request"]))
    assert requests
    assert all(ready and number == 3 for ready, number, _ in requests)
    values = [request for *_, request in requests]
    assert values[0] == 0
    assert 1 in values
    cell.go(2)
    cell.go(1)
    assert not cell.heard_of("GuardReset")


def test_before_any_trip_it_requests_the_first_permission_with_number_0(cell: Cell) -> None:
    requests = []
    for _ in range(100):
        cell.turn(cell.answer({**STOP, "Reason": 27, "TripNumber": 0}))
        requests += [frame.signals for frame in cell.heard_of("GuardReset") if frame.signals]
    assert {request["TripNumber"] for request in requests} == {0}
    assert {request["Request"] for request in requests} == {0, 1}


@pytest.mark.parametrize(("kind", "value"), [("silent", 0.0), ("crc", 0.0), ("status", 2.0), ("offset", 7.0)])
def test_a_sensor_fault_is_on_the_bus_while_it_lasts(kind: str, value: float) -> None:
    fault = SensorFault(3, kind, 0.02, 0.04, value)  # type: ignore[arg-type]
    cell = Cell((fault,))
    weight = DYNAMICS.bias(HOME, np.zeros(7))[2]
    for cycle in range(30):
        cell.go(1, {**STOP, "TripNumber": 0})  # the arm is at rest: only the sensor changes
        states = cell.heard_of("JointState3")
        active = 10 <= cycle < 20
        if kind == "silent":
            assert len(states) == (0 if active else 1)
        elif kind == "crc":
            assert (states[0].status is E2EStatus.WRONG_CRC) == active
        elif states[0].signals:
            status, torque = states[0].signals["SensorStatus"], states[0].signals["Torque"]
            assert status == (2 if active and kind == "status" else 0)
            assert torque - weight == pytest.approx(7.0 if active and kind == "offset" else 0.0, abs=0.02)
    cell.robot_bus.shutdown()
    cell.guard_bus.shutdown()


def test_a_reading_that_the_wire_cannot_carry_is_not_available_instead_of_clamped() -> None:
    cell = Cell((SensorFault(2, "offset", 0.01, value=1e4),))
    cell.go(10)
    (state,) = cell.heard_of("JointState2")
    assert (state.signals["SensorStatus"], state.signals["Torque"]) == (3, 0.0)
    cell.robot_bus.shutdown()
    cell.guard_bus.shutdown()


def test_sensor_errors_are_as_large_as_they_are_set() -> None:
    seed = 11
    print(f"seed {seed}")
    arm = Arm(ROBOT, period_s=PERIOD_S)
    arm.reset(HOME)
    truth = arm.stand()
    model = SensorModel(torque_noise_nm=0.1, torque_offset_nm=0.3, velocity_noise_rad_s=0.01)
    sensors = Sensors(model, ROBOT.n, np.random.default_rng(seed))
    readings = [sensors.read(truth, 0.0) for _ in range(4000)]
    error = np.array([one.torque for one in readings]) - truth.torque
    assert np.allclose(error.std(axis=0), 0.1, rtol=0.1)
    assert 0.05 < np.abs(error.mean(axis=0)).max() < 0.31
    assert np.allclose(np.std([one.velocity for one in readings], axis=0), 0.01, rtol=0.1)


def test_a_delayed_sensor_sends_an_earlier_reading() -> None:
    arm = Arm(ROBOT, period_s=PERIOD_S)
    arm.reset(HOME)
    sensors = Sensors(SensorModel(delay_cycles=3), ROBOT.n, np.random.default_rng(1))
    truths = [arm.step(np.zeros(7)) for _ in range(10)]
    readings = [sensors.read(truth, 0.0) for truth in truths]
    assert np.array_equal(readings[9].position, truths[6].position)
    assert np.array_equal(readings[1].position, truths[0].position)
