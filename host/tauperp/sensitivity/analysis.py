"""Smallest forces over links, points, directions and postures, and the body regions that they protect."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from tauperp.config import Configuration, TaskName
from tauperp.robot import Robot
from tauperp.sensitivity.regions import REGIONS, TRANSIENT
from tauperp.sensitivity.response import Prober, smallest_pulse, smallest_static
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.model import build_spec

FloatArray = npt.NDArray[np.float64]

DIRECTIONS = 96
PLACES = (0.1, 0.5, 0.9)  # along a link
BLIND_N = 500.0  # N; a larger force counts as not detectable
COVERED = 0.95  # share of directions, points and postures from which a region counts as covered


@dataclass(frozen=True, eq=False)
class LinkForces:
    """Smallest forces on one link, N, over postures, places and directions: (p, places, directions)."""

    link: int  # from 1
    static_n: FloatArray
    pulse_n: FloatArray

    def report(self) -> dict[str, Any]:
        """For JSON: quantiles over everything, blind shares and regions."""
        return {
            "link": self.link,
            "static_n": _spread(self.static_n),
            "pulse_50ms_n": _spread(self.pulse_n),
            "blind_share": round(float((self.static_n > BLIND_N).mean()), 4),
            "blind_pulse_share": round(float((self.pulse_n > BLIND_N).mean()), 4),
            "regions": {
                region.name: {
                    "quasi_static": round(float((self.static_n <= region.limit_n).mean()), 4),
                    "transient": round(float((self.pulse_n <= TRANSIENT * region.limit_n).mean()), 4),
                }
                for region in REGIONS
            },
        }


@dataclass(frozen=True, eq=False)
class TaskForces:
    """One task: its links, and the direction that is hardest to detect on each at the first posture, base frame."""

    task: TaskName
    index: str
    links: tuple[LinkForces, ...]
    blindest: FloatArray  # (n, 3)


def directions(count: int = DIRECTIONS) -> FloatArray:
    """Unit vectors (count, 3), evenly spread: Fibonacci's lattice on the sphere."""
    place = np.arange(count) + 0.5
    z = 1 - 2 * place / count
    turn = np.pi * (1 + np.sqrt(5)) * place
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)


class Levers:
    """Torques per newton of forces at points of a robot's links."""

    def __init__(self, robot: Robot) -> None:
        self._model = build_spec(robot, timestep_s=1e-3).compile()
        self._data = mujoco.MjData(self._model)
        self._robot = robot
        self._bodies = [self._model.body(joint.name).id for joint in robot.joints]

    def place(self, posture: FloatArray) -> None:
        """The posture (n,) of what follows."""
        self._data.qpos[: self._robot.n] = posture
        mujoco.mj_fwdPosition(self._model, self._data)

    def at(self, link: int, point: FloatArray) -> FloatArray:
        """Linear Jacobian (3, n) of a point (3,) m in the frame of link `link` (from 0); torque = J^T force."""
        body = self._bodies[link]
        where = self._data.xpos[body] + self._data.xmat[body].reshape(3, 3) @ point
        jacobian = np.zeros((3, self._model.nv))
        mujoco.mj_jac(self._model, self._data, jacobian, None, where, body)
        return jacobian[:, : self._robot.n]

    def capsule(self, link: int) -> tuple[FloatArray, FloatArray, float]:
        """Ends (3,) of a link's axis in the base frame, and its radius, m."""
        body, shape = self._bodies[link], self._robot.capsules[link]
        rotation, origin = self._data.xmat[body].reshape(3, 3), self._data.xpos[body]
        return origin + rotation @ shape.p0, origin + rotation @ shape.p1, shape.radius


def analyse(
    configuration: Configuration,
    postures: FloatArray,
    tasks: Sequence[TaskName],
    progress: Callable[[float, str], None] = lambda share, phase: None,
) -> list[TaskForces]:
    """Every task over every posture (p, n). Raises InputError for a posture that the wire cannot carry."""
    robot = configuration.robot
    prober, levers, towards = Prober(configuration), Levers(robot), directions()
    shape = (robot.n, len(postures), len(PLACES), len(towards))
    results = []
    for number, task in enumerate(tasks):
        threshold = configuration.thresholds_nm(task)
        debounce = configuration.settings.task[task].debounce_ticks
        static, pulse = np.empty(shape), np.empty(shape)
        for p, posture in enumerate(postures):
            progress((number + p / len(postures)) / len(tasks), f"task {task}")
            response = prober.measure(posture, task)
            levers.place(posture)
            for link in range(robot.n):
                capsule = robot.capsules[link]
                for k, along in enumerate(PLACES):
                    jacobian = levers.at(link, (1 - along) * capsule.p0 + along * capsule.p1)
                    torques = towards @ jacobian
                    static[link, p, k] = smallest_static(response, torques, threshold)
                    pulse[link, p, k] = smallest_pulse(response, torques, threshold, debounce)
        blindest = towards[static[:, 0].max(axis=1).argmax(axis=1)]
        links = tuple(LinkForces(link + 1, static[link], pulse[link]) for link in range(robot.n))
        results.append(TaskForces(task, configuration.settings.task[task].index, links, blindest))
    return results


def workspace(robot: Robot, count: int, seed: int = 1) -> FloatArray:
    """Postures (count, n) spread over the joints' ranges, with the end-effector above the base."""
    dynamics = Dynamics(robot)
    low = np.array([joint.position_min for joint in robot.joints])
    high = np.array([joint.position_max for joint in robot.joints])
    up = -robot.gravity / max(float(np.linalg.norm(robot.gravity)), 1e-9)
    rng = np.random.default_rng(seed)
    found: list[FloatArray] = []
    for _ in range(200 * count):
        posture = low + (high - low) * rng.uniform(0.02, 0.98, robot.n)
        if dynamics.tip(posture)[0] @ up > 0.0:
            found.append(posture)
        if len(found) == count:
            break
    return np.array(found)


def _spread(values: FloatArray) -> dict[str, float | None]:
    """Best, median, 95 % and worst; None for a force that is never detected."""
    flat = values.ravel()
    numbers = {
        "best": float(flat.min()),
        "median": float(np.quantile(flat, 0.5)),
        "p95": float(np.quantile(flat, 0.95, method="higher")),
        "worst": float(flat.max()),
    }
    return {name: round(value, 1) if value <= BLIND_N else None for name, value in numbers.items()}
