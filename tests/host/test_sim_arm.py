"""The simulated arm: its sensors agree with the equations of motion, with any payload, and its brakes hold."""

import mujoco
import numpy as np
import pinocchio
import pytest

from tauperp.robot import Robot, load
from tauperp.sim.arm import Arm, Payload
from tauperp.sim.control import ComputedTorque
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.posture import home

PERIOD_S = 1e-3
SEED = 20


@pytest.fixture(scope="module", params=["ku_dex", "panda"])
def robot(request: pytest.FixtureRequest) -> Robot:
    return load(request.param)


def oracle(robot: Robot, payload: Payload | None) -> pinocchio.Model:
    """The same arm in Pinocchio, without rotors, the payload merged into its last link."""
    model = pinocchio.Model()
    parent = 0
    for joint in robot.joints:
        placement = pinocchio.SE3(np.asarray(joint.origin_rotation), np.asarray(joint.origin_position))
        parent = model.addJoint(parent, pinocchio.JointModelRevoluteUnaligned(joint.axis), placement, joint.name)
        inertia = pinocchio.Inertia(joint.mass, np.asarray(joint.com), np.asarray(joint.inertia))
        model.appendBodyToJoint(parent, inertia, pinocchio.SE3.Identity())
    if payload is not None:
        ball = pinocchio.Inertia(
            payload.mass_kg, np.asarray(robot.tip) + payload.com_m, payload.inertia_kg_m2 * np.eye(3)
        )
        model.appendBodyToJoint(parent, ball, pinocchio.SE3.Identity())
    model.gravity.linear = np.asarray(robot.gravity)
    return model


@pytest.mark.parametrize("payload", [None, Payload(2.0, (0.03, -0.05, 0.08))])
def test_link_side_torque_obeys_the_equations_of_motion(robot: Robot, payload: Payload | None) -> None:
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    arm, dynamics = Arm(robot, period_s=PERIOD_S, substeps=4), Dynamics(robot)
    start = home(robot, dynamics)
    arm.reset(start)
    arm.attach(payload)
    model = oracle(robot, payload)
    data = model.createData()
    sample = arm.stand()
    weight = dynamics.bias(start, np.zeros(robot.n))
    for _ in range(150):
        before = sample
        sample = arm.step(weight + 5.0 * rng.standard_normal(robot.n))
        middle = (before.position + sample.position) / 2
        velocity = (before.velocity + sample.velocity) / 2
        acceleration = (sample.velocity - before.velocity) / PERIOD_S
        expected = pinocchio.rnea(model, data, middle, velocity, acceleration)
        assert np.allclose(sample.torque, expected, atol=0.02), sample.torque - expected


def test_a_released_payload_has_no_further_effect(robot: Robot) -> None:
    arm = Arm(robot, period_s=PERIOD_S)
    arm.reset(home(robot, Dynamics(robot)))
    empty = arm.stand().torque
    arm.attach(Payload(3.0, (0.0, 0.1, 0.0)))
    assert np.abs(arm.stand().torque - empty).max() > 5.0
    arm.attach(None)
    assert np.array_equal(arm.stand().torque, empty)


def test_brakes_hold_the_arm_with_a_payload_and_without_motors(robot: Robot) -> None:
    arm = Arm(robot, period_s=PERIOD_S)
    start = home(robot, Dynamics(robot))
    arm.reset(start)
    arm.attach(Payload(3.0))
    weight = arm.stand().torque
    arm.brake(True)
    for _ in range(1000):
        sample = arm.step(np.zeros(robot.n))
    assert np.abs(sample.position - start).max() < 1e-3
    assert np.allclose(sample.torque, weight, atol=0.1)  # the sensors carry the weight, braked or controlled
    arm.brake(False)
    for _ in range(200):
        sample = arm.step(np.zeros(robot.n))
    assert np.abs(sample.position - start).max() > 0.05


def test_motors_never_exceed_their_largest_torque(robot: Robot) -> None:
    arm = Arm(robot, period_s=PERIOD_S)
    arm.reset(home(robot, Dynamics(robot)))
    arm.step(np.full(robot.n, 1e4))
    largest = [0.97 * joint.torque_max for joint in robot.joints]  # the sensor does not saturate
    assert np.allclose(arm.data.qfrc_actuator[: robot.n], largest)


def test_position_control_carries_an_unknown_payload(robot: Robot) -> None:
    arm, dynamics = Arm(robot, period_s=PERIOD_S), Dynamics(robot)
    start = home(robot, dynamics)
    arm.reset(start)
    arm.attach(Payload(3.0, (0.0, 0.0, 0.1)))
    control, sample, still = ComputedTorque(dynamics, PERIOD_S), arm.stand(), np.zeros(robot.n)
    sag = 0.0
    for _ in range(1000):
        sample = arm.step(control.torque(sample.position, sample.velocity, (start, still, still)))
        sag = max(sag, float(np.linalg.norm(dynamics.tip(sample.position)[0] - dynamics.tip(start)[0])))
    assert sag < 0.02
    assert np.abs(sample.position - start).max() < 1e-4


def test_model_error_scales_the_links_and_not_the_nominal_model(robot: Robot) -> None:
    heavier = Arm(robot, period_s=PERIOD_S, mass_scale=np.full(robot.n, 1.1))
    exact = Arm(robot, period_s=PERIOD_S)
    start = home(robot, Dynamics(robot))
    for arm in (heavier, exact):
        arm.reset(start)
    assert np.allclose(heavier.stand().torque, 1.1 * exact.stand().torque)
    assert mujoco.mj_getTotalmass(heavier.model) == pytest.approx(1.1 * mujoco.mj_getTotalmass(exact.model))
