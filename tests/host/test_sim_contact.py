"""People in the simulation: a strike has the force and stiffness of ISO/TS 15066 and is recorded as simulated."""

import numpy as np
import pytest

from tauperp.robot import load
from tauperp.sim.arm import Arm
from tauperp.sim.contact import BODY_PARTS, Hand, Obstructed, Strike
from tauperp.sim.control import ComputedTorque
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.guiding import Guidance, GuidingForce
from tauperp.sim.posture import home

PERIOD_S = 1e-3
ROBOT = load("ku_dex")
DYNAMICS = Dynamics(ROBOT)
HOME = home(ROBOT, DYNAMICS)
STILL = np.zeros(ROBOT.n)


def strike_standing_arm(strike: Strike, seconds: float = 1.5) -> tuple[Hand, np.ndarray, np.ndarray]:
    """The hand, its contact force each cycle, and how deep it was in the link at the largest force."""
    hand = Hand(strike, 1)
    arm = Arm(ROBOT, period_s=PERIOD_S, touching=[hand])
    arm.reset(HOME)
    control, sample = ComputedTorque(DYNAMICS, PERIOD_S), arm.stand()
    hand.start(arm, 0.0)
    force, depth = [], []
    for _ in range(round(seconds / PERIOD_S)):
        sample = arm.step(control.torque(sample.position, sample.velocity, (HOME, STILL, STILL)))
        force.append(hand.force_n)
        depth.append(-min(arm.data.contact.dist, default=0.0))
    return hand, np.array(force), np.array(depth)


@pytest.mark.parametrize("part", sorted(BODY_PARTS))
def test_a_slow_push_meets_the_stiffness_of_the_tissue(part: str) -> None:
    strike = Strike(4, (0.0, 1.0, 0.0), part=part, speed_m_s=0.05, push_n=100.0, duration_s=0.8)  # type: ignore[arg-type]
    _, force, depth = strike_standing_arm(strike, 3.5)
    deepest = int(np.argmax(depth))
    assert force[deepest] / depth[deepest] == pytest.approx(BODY_PARTS[part].stiffness_n_m, rel=0.05)


def test_the_record_agrees_with_the_simulated_force() -> None:
    hand, force, _ = strike_standing_arm(Strike(4, (0.0, 1.0, 0.0), push_n=120.0, duration_s=0.2))
    touched = np.flatnonzero(force)
    record = hand.record
    assert record.link == 4
    assert record.contact_s is not None
    assert record.release_s is not None
    assert record.contact_s == pytest.approx(touched[0] * PERIOD_S, abs=1.5 * PERIOD_S)
    assert record.release_s == pytest.approx(touched[-1] * PERIOD_S, abs=1.5 * PERIOD_S)
    assert record.peak_force_n == pytest.approx(force.max(), rel=0.05)
    assert 110.0 < record.peak_force_n < 140.0
    assert record.release_s - record.contact_s == pytest.approx(0.2, abs=0.02)


def test_a_faster_hand_hits_harder() -> None:
    """The peak force of the impact is about v sqrt(k m), for any push after it."""
    slow, fast = (
        strike_standing_arm(Strike(4, (0.0, 1.0, 0.0), speed_m_s=speed, push_n=20.0))[0].record.peak_force_n
        for speed in (0.2, 0.6)
    )
    assert fast == pytest.approx(3 * slow, rel=0.3)


def test_a_hand_that_was_not_started_touches_nothing() -> None:
    hand = Hand(Strike(4, (0.0, 1.0, 0.0)), 1)
    arm = Arm(ROBOT, period_s=PERIOD_S, touching=[hand])
    arm.reset(HOME)
    alone = Arm(ROBOT, period_s=PERIOD_S)
    alone.reset(HOME)
    weight = DYNAMICS.bias(HOME, STILL)
    for _ in range(300):
        with_hand, without = arm.step(weight), alone.step(weight)
    assert hand.record.contact_s is None
    assert np.allclose(with_hand.position, without.position, atol=1e-12)


def test_a_hand_withdrawn_before_contact_touches_nothing() -> None:
    hand = Hand(Strike(4, (0.0, 1.0, 0.0)), 1)
    arm = Arm(ROBOT, period_s=PERIOD_S, touching=[hand])
    arm.reset(HOME)
    hand.start(arm, 0.0)
    weight = DYNAMICS.bias(HOME, STILL)
    for cycle in range(600):
        if cycle == 50:
            hand.withdraw(arm.time_s)
        arm.step(weight)
    assert hand.record.contact_s is None


def test_a_strike_from_inside_the_arm_is_refused() -> None:
    hand = Hand(Strike(4, (-1.0, 0.0, 0.0)), 1)
    arm = Arm(ROBOT, period_s=PERIOD_S, touching=[hand])
    arm.reset(HOME)
    with pytest.raises(Obstructed, match="inside link 5"):
        hand.start(arm, 0.0)


def test_a_guiding_force_is_a_wrench_at_the_end_effector() -> None:
    guidance = Guidance()
    arm = Arm(ROBOT, period_s=PERIOD_S, touching=[guidance])
    arm.reset(HOME)
    force, moment = np.array([10.0, -5.0, 20.0]), np.array([0.5, 1.0, -1.0])
    guidance.start((GuidingForce(tuple(force), tuple(moment), rise_s=0.01, hold_s=1.0),), 0.0)
    control, sample = ComputedTorque(DYNAMICS, PERIOD_S), arm.stand()
    for _ in range(900):
        sample = arm.step(control.torque(sample.position, sample.velocity, (HOME, STILL, STILL)))
    expected = -DYNAMICS.jacobian(sample.position).T @ np.concatenate([force, moment])
    external = sample.torque - DYNAMICS.bias(sample.position, STILL)
    assert np.allclose(external, expected, atol=0.01)


def test_a_guiding_force_rises_and_falls_without_a_step() -> None:
    force = GuidingForce((30.0, 0.0, 0.0), start_s=0.2, rise_s=0.5, hold_s=1.0)
    time = np.arange(0.0, 3.0, PERIOD_S)
    share = np.array([force.share(float(t)) for t in time])
    assert share[0] == share[-1] == 0.0
    assert share.max() == 1.0
    assert np.abs(np.diff(share)).max() < 2 * np.pi / 2 / 0.5 * PERIOD_S / 2 * 1.01
    assert force.over(2.2)
    assert not force.over(2.1)
