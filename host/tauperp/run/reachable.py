"""The abilities of an arm, checked before an experiment runs on it: postures, moves, torques, and places to strike
it."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from tauperp.config import TASKS, Configuration
from tauperp.firmware import Core
from tauperp.robot import Robot
from tauperp.sim.arm import DRIVE_SHARE
from tauperp.sim.contact import BODY_PARTS, STANDOFF_M, Strike
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.model import build_spec, geom_name
from tauperp.sim.posture import postures
from tauperp.sim.trajectory import Limits, Planner, Unreachable

Vector = NDArray[np.float64]

PLAN_PERIOD_S = 0.02  # coarse: only the feasibility matters
TORQUE_SHARE = 0.8  # of what a drive gives: the rest is for control
SINGULAR_SHARE = 0.4  # of the start's smallest singular value: after a retreat the arm moves on another path from there
PROBE_NM = 1.0
PROBE_GAINS = 7.0  # times 1 / K, until a constant torque has settled in the index
CLEARANCE_M = 0.01
WAY = (1.0, 0.8, 0.6, 0.4, 0.2)  # of the hand's path to the link, on which it must not touch another one


@dataclass(frozen=True)
class Way:
    """Moves planned one after the other: joints (N, n) rad, PLAN_PERIOD_S apart, and the row at which each begins."""

    position: Vector
    begins: tuple[int, ...]

    def at(self, move: int, after_s: float) -> Vector:
        """Joints (n,) so long after the beginning of a move."""
        return self.position[min(self.begins[move] + round(after_s / PLAN_PERIOD_S), len(self.position) - 1)]


class Reachable:
    """Asks one arm. Nothing is remembered between calls."""

    def __init__(self, robot: Robot, configuration: Configuration) -> None:
        self.robot = robot
        self.n = robot.n
        self.dynamics = Dynamics(robot)
        self._planner = Planner(robot, self.dynamics, PLAN_PERIOD_S)
        self._strength = TORQUE_SHARE * DRIVE_SHARE * np.array([joint.torque_max for joint in robot.joints])
        self._configuration = configuration
        self._core = Core(configuration.robot, config=configuration)
        spec = build_spec(robot, timestep_s=1e-3)
        body = spec.worldbody.add_body(name="hand", mocap=True)
        body.add_geom(name="hand", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0], contype=0, conaffinity=0)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._hand = self._model.geom("hand").id
        self._links = [self._model.geom(geom_name(link)).id for link in range(self.n)]
        self._bodies = [self._model.body(joint.name).id for joint in robot.joints]

    def starts(self) -> list[Vector]:
        """Postures to begin in, the best conditioned first."""
        return postures(self.robot, self.dynamics)

    def plan(self, start: Vector, goals_m: Sequence[Vector], rotation: Vector, limits: Limits) -> Way | str:
        """Straight moves from `start` to the goals, one after the other; the obstacle if a move is impossible."""
        paths: list[Vector] = []
        begins: list[int] = []
        joints = start
        try:
            for goal in goals_m:
                begins.append(sum(len(path) for path in paths))
                move = self._planner.straight_move(joints, goal, rotation, start, limits)
                paths.append(move.position)
                joints = move.position[-1]
        except Unreachable as error:
            return str(error)
        if self._smallest(paths) < SINGULAR_SHARE * self._smallest([start[None]]):
            return "the straight lines pass near a singular posture"
        return Way(np.concatenate(paths), tuple(begins))

    def _smallest(self, paths: Sequence[Vector]) -> float:
        """Smallest singular value of the Jacobian along paths, m/rad."""
        rows = np.concatenate(paths)
        rows = rows[:: max(1, len(rows) // 60)]
        return min(float(np.linalg.svd(self.dynamics.jacobian(q), compute_uv=False)[-1]) for q in rows)

    def weakest(self, postures_rad: Vector, mass_kg: float) -> tuple[float, int]:
        """Largest share of a drive's torque needed to carry a mass at the tip, and its joint (from 1)."""
        weight = -mass_kg * self.robot.gravity
        shares = np.array([self.load(q, weight) for q in postures_rad])
        return float(shares.max()), int(shares.max(axis=0).argmax()) + 1

    def load(self, posture: Vector, pull_n: Vector) -> Vector:
        """Share (n,) of each drive's usable torque that the arm's weight and a force at the tip need."""
        bias = self.dynamics.bias(posture, np.zeros(self.n))
        return np.abs(bias + self.dynamics.jacobian(posture)[:3].T @ -pull_n) / self._strength

    def give_way(self, start: Vector, shift_m: Vector) -> Vector:
        """Joints (n,) with the tip about `shift_m` (3,) from where it is in `start`, the orientation kept."""
        joints = start.copy()
        for _ in range(10):
            twist = np.concatenate([shift_m / 10, np.zeros(3)])
            jacobian = self.dynamics.jacobian(joints)
            joints = joints + jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-3 * np.eye(6), twist)
        return joints

    def response(self, posture: Vector, task: int) -> Vector:
        """(n, n): change of the index of joint i for 1 Nm more on joint j, by the firmware itself."""
        core, n = self._core, self.n
        rows = round(PROBE_GAINS / self._configuration.settings.observer.gain_per_s / self._period_s)
        still = np.zeros(n)
        weight = core.terms(posture, still).gravity
        answers = np.empty((n, n))
        for joint in range(n):
            core.reset()
            core.step(posture, still, weight, task)
            pushed = weight + PROBE_NM * np.eye(n)[joint]
            for _ in range(rows):
                answer = core.step(posture, still, pushed, task).index
            answers[:, joint] = answer / PROBE_NM
        return answers

    def lever(self, posture: Vector, strike: Strike) -> tuple[Vector, Vector, Vector]:
        """Torque (n,) Nm per newton of a strike in its direction; point struck (3,) m, unit direction; base frame."""
        self._place(posture)
        body, capsule = self._bodies[strike.link - 1], self.robot.capsules[strike.link - 1]
        rotation = self._data.xmat[body].reshape(3, 3)
        target = (1 - strike.along) * capsule.p0 + strike.along * capsule.p1
        point = self._data.xpos[body] + rotation @ target
        direction = np.array(strike.direction)
        if strike.frame == "link":
            direction = rotation @ direction
        direction = direction / np.linalg.norm(direction)
        jacobian = np.zeros((3, self._model.nv))
        mujoco.mj_jac(self._model, self._data, jacobian, None, point, body)
        return jacobian[:, : self.n].T @ direction, point, direction

    def clear(self, posture: Vector, strike: Strike) -> bool:
        """Whether the hand starts outside every link and touches the intended one first."""
        _, point, direction = self.lever(posture, strike)
        part = BODY_PARTS[strike.part]
        reach = STANDOFF_M + part.radius_m + self.robot.capsules[strike.link - 1].radius
        self._model.geom_size[self._hand, 0] = part.radius_m
        for share in WAY:
            self._data.mocap_pos[0] = point - share * reach * direction
            mujoco.mj_kinematics(self._model, self._data)
            distance = [mujoco.mj_geomDistance(self._model, self._data, link, self._hand, 1.0, None)
                        for link in self._links]  # fmt: skip
            if min(distance) <= CLEARANCE_M and share == WAY[0]:
                return False
            if distance[strike.link - 1] <= 0.0:
                return True
            if min(distance) <= 0.0:
                return False
        return True

    def threshold(self, task: int) -> Vector:
        """(n,) Nm of the task, in the channel that has the smallest."""
        name = next(name for name, number in TASKS.items() if number == task)
        return self._configuration.threshold_nm(name)

    def tip(self, posture: Vector) -> tuple[Vector, Vector]:
        """End-effector point (3,) m and orientation (3, 3)."""
        return self.dynamics.tip(posture)

    @property
    def _period_s(self) -> float:
        return self._configuration.period_us * 1e-6

    def _place(self, posture: Vector) -> None:
        self._data.qpos[: self.n] = posture
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
