"""What the robot does when motion is not permitted: it stops as commanded, returns along its path, and continues."""

import numpy as np
import pytest

from tauperp.robot import load
from tauperp.sim.arm import Arm
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.motion import Job, Mode, Motion, Move, Permit, Recovery, Wait, Yield
from tauperp.sim.posture import home
from tauperp.sim.trajectory import Limits, Planner, Unreachable

PERIOD_S = 2e-3
ROBOT = load("ku_dex")
DYNAMICS = Dynamics(ROBOT)
PLANNER = Planner(ROBOT, DYNAMICS, PERIOD_S)
HOME = home(ROBOT, DYNAMICS)
TIP, ROTATION = DYNAMICS.tip(HOME)
ALLOWED = Permit(True)
RECOVERY = Recovery()
COLLISION = Permit(False, 2, collision=True)


class Robot:
    """An arm with its controller, and a permission that the test gives or withdraws."""

    def __init__(self, *jobs: Job, recovery: Recovery = RECOVERY) -> None:
        self.arm = Arm(ROBOT, period_s=PERIOD_S)
        self.arm.reset(HOME)
        self.motion = Motion(PLANNER, DYNAMICS, PERIOD_S, HOME, jobs, recovery)
        self.sample = self.arm.stand()

    def run(self, permit: Permit, seconds: float) -> np.ndarray:
        """Joint velocities (N, n) during this many seconds under one permission."""
        velocities = []
        for _ in range(round(seconds / PERIOD_S)):
            torque = self.motion.step(permit, self.sample)
            self.arm.brake(self.motion.brakes)
            self.sample = self.arm.step(torque)
            velocities.append(self.sample.velocity)
        return np.array(velocities)

    @property
    def tip(self) -> np.ndarray:
        return DYNAMICS.tip(self.sample.position)[0]


def move(*offset: float) -> Move:
    return Move(tip_m=TIP + offset, rotation=ROTATION)


def moving_robot() -> Robot:
    robot = Robot(move(0.0, 0.3, 0.1))
    robot.run(ALLOWED, 0.6)
    assert np.abs(robot.sample.velocity).max() > 0.3
    return robot


def test_nothing_moves_before_the_first_permission() -> None:
    robot = Robot(move(0.0, 0.3, 0.1))
    assert np.abs(robot.run(Permit(False, 1), 0.5)).max() < 1e-2
    assert np.linalg.norm(robot.tip - TIP) < 1e-3


def test_a_permitted_move_ends_at_rest_at_its_target() -> None:
    robot = Robot(move(0.0, 0.3, 0.1))
    robot.run(ALLOWED, 3.0)
    assert robot.motion.finished
    assert np.linalg.norm(robot.tip - (TIP + np.array((0.0, 0.3, 0.1)))) < 2e-3
    assert np.abs(robot.sample.velocity).max() < 1e-2


@pytest.mark.parametrize(("category", "braked", "in_control"), [(0, True, False), (1, True, False), (2, False, True)])
def test_it_stops_by_the_requested_category(category: int, braked: bool, in_control: bool) -> None:
    robot = moving_robot()
    robot.run(Permit(False, category), 0.01)
    assert robot.motion.brakes == (category == 0)  # a controlled stop comes first in 1 and 2
    robot.run(Permit(False, category), 0.35)
    assert np.abs(robot.sample.velocity).max() < 0.05
    assert robot.motion.brakes == braked
    assert (robot.motion.mode in (Mode.PAUSING, Mode.READY)) == in_control


def test_a_stricter_category_during_a_stop_is_obeyed() -> None:
    robot = moving_robot()
    robot.run(Permit(False, 2), 0.02)
    robot.run(Permit(False, 0), 0.01)
    assert robot.motion.brakes


def test_after_a_collision_it_returns_along_its_path_and_then_requests_a_reset() -> None:
    robot = moving_robot()
    robot.run(COLLISION, 0.3)
    stopped = robot.tip
    assert not robot.motion.wants_reset
    robot.run(COLLISION, 3.0)
    assert robot.motion.wants_reset
    went_back = np.linalg.norm(robot.tip - stopped)
    assert went_back == pytest.approx(RECOVERY.retreat_m, rel=0.1)
    way = (TIP + np.array((0.0, 0.3, 0.1))) - TIP
    along = (robot.tip - stopped) @ way / np.linalg.norm(way)
    assert along == pytest.approx(-went_back, rel=0.05)


def test_a_retreat_goes_no_further_than_where_the_move_began() -> None:
    robot = Robot(move(0.0, 0.2, 0.0), move(0.0, 0.0, 0.2))
    while robot.motion.job == 0:
        robot.run(ALLOWED, PERIOD_S)
    corner = robot.tip
    robot.run(ALLOWED, 0.15)
    assert np.linalg.norm(robot.tip - corner) < RECOVERY.retreat_m / 2
    robot.run(COLLISION, 4.0)
    assert np.linalg.norm(robot.tip - corner) < 0.01


def test_with_permission_again_it_finishes_the_interrupted_move() -> None:
    robot = moving_robot()
    robot.run(COLLISION, 3.0)
    robot.run(ALLOWED, 4.0)
    assert robot.motion.finished
    assert np.linalg.norm(robot.tip - (TIP + np.array((0.0, 0.3, 0.1)))) < 2e-3


def test_after_braking_it_resumes_and_finishes() -> None:
    robot = moving_robot()
    robot.run(Permit(False, 0), 1.0)
    assert robot.motion.brakes
    assert robot.motion.wants_reset
    robot.run(ALLOWED, 4.0)
    assert not robot.motion.brakes
    assert robot.motion.finished
    assert np.linalg.norm(robot.tip - (TIP + np.array((0.0, 0.3, 0.1)))) < 2e-3


def test_when_pushed_far_off_it_brakes_instead_of_pushing_back() -> None:
    robot = Robot(Wait(5.0))
    robot.run(ALLOWED, 0.5)
    robot.arm.push_tip(np.array([0.0, 0.0, -2000.0]), np.zeros(3))  # more than the motors can hold
    for _ in range(500):
        robot.run(ALLOWED, PERIOD_S)
        if robot.motion.brakes:
            break
    assert robot.motion.brakes
    robot.arm.push_tip(np.zeros(3), np.zeros(3))
    velocity = robot.run(ALLOWED, 1.0)
    assert np.abs(velocity[-50:]).max() < 0.05
    assert not robot.motion.brakes


def test_an_interrupted_wait_resumes() -> None:
    robot = Robot(Wait(1.0))
    robot.run(ALLOWED, 0.6)
    robot.run(Permit(False, 2), 1.0)
    robot.run(ALLOWED, 0.3)
    assert not robot.motion.finished
    robot.run(ALLOWED, 0.3)
    assert robot.motion.finished


def test_while_yielding_it_gives_way_and_then_returns_to_its_pose() -> None:
    robot = Robot(Yield(6.0))
    robot.run(ALLOWED, 0.2)
    robot.arm.push_tip(np.array([0.0, 25.0, 0.0]), np.zeros(3))
    robot.run(ALLOWED, 1.5)
    assert robot.tip[1] - TIP[1] == pytest.approx(25.0 / 500.0, rel=0.1)
    robot.arm.push_tip(np.zeros(3), np.zeros(3))
    robot.run(ALLOWED, 2.0)
    assert np.linalg.norm(robot.tip - TIP) < 2e-3


def test_interrupted_while_yielding_it_returns_to_the_pose_it_held() -> None:
    robot = Robot(Yield(8.0))
    robot.run(ALLOWED, 0.2)
    robot.arm.push_tip(np.array([0.0, 25.0, 0.0]), np.zeros(3))
    robot.run(ALLOWED, 1.0)
    robot.run(COLLISION, 0.5)
    robot.arm.push_tip(np.zeros(3), np.zeros(3))
    held = robot.tip
    assert np.linalg.norm(held - TIP) > 0.02
    robot.run(COLLISION, 2.5)
    robot.run(ALLOWED, 3.0)
    assert np.linalg.norm(robot.tip - TIP) < 3e-3


def test_the_announced_acceleration_is_the_one_that_is_driven() -> None:
    robot = Robot(move(0.0, 0.3, 0.1))
    announced, driven = [], [np.zeros(3)]
    for _ in range(round(2.0 / PERIOD_S)):
        robot.run(ALLOWED, PERIOD_S)
        announced.append(robot.motion.tip_acceleration)
        driven.append(DYNAMICS.jacobian(robot.sample.position)[:3] @ robot.sample.velocity)
    measured = np.diff(np.array(driven), axis=0) / PERIOD_S
    assert np.abs(announced).max() > 1.0
    assert np.abs(np.array(announced) - measured).max() < 0.25


def test_a_straight_move_is_straight_and_keeps_its_limits() -> None:
    goal = TIP + np.array((0.05, -0.25, 0.1))
    limits = Limits(speed_m_s=0.3, acceleration_m_s2=1.0)
    path = PLANNER.straight_move(HOME, goal, ROTATION, HOME, limits)
    tips = np.array([DYNAMICS.tip(joints)[0] for joints in path.position])
    way = (goal - TIP) / np.linalg.norm(goal - TIP)
    offline = (tips - TIP) - np.outer((tips - TIP) @ way, way)
    assert np.linalg.norm(offline, axis=1).max() < 1e-3
    speed = np.linalg.norm(np.diff(tips, axis=0), axis=1) / PERIOD_S
    assert 0.2 < speed.max() < 0.305
    assert 0.5 < np.linalg.norm(path.tip_acceleration, axis=1).max() < 1.1
    turned = [np.linalg.norm(DYNAMICS.tip(joints)[1] - ROTATION) for joints in path.position]
    assert max(turned) < 2e-3


def test_a_target_out_of_reach_is_refused() -> None:
    with pytest.raises(Unreachable, match=r"mm from its goal|singular|range|speed"):
        PLANNER.straight_move(HOME, TIP + np.array((1.5, 0.0, 0.0)), ROTATION, HOME, Limits())
    with pytest.raises(Unreachable, match="joint2 would leave its range"):
        PLANNER.joint_move(HOME, HOME + np.array((0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0)), Limits())
