"""The runs of a plan, drawn one by one from counter-based random numbers.

A run depends only on the plan's seed, the task, the kind of run and its number. A shard of the plan can therefore be
drawn anywhere, in any order, and repeatedly.
"""

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tauperp.campaign.plan import Plan
from tauperp.config import TASKS, TaskName
from tauperp.kernel import layout
from tauperp.kernel.bench import Rows
from tauperp.robot import Robot
from tauperp.sim.contact import BODY_PARTS
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.posture import home
from tauperp.sim.sensors import SensorModel

FREE, HIT = 0, 1  # kinds of runs
LOWEST_TIP_M = 0.05  # height above the base; lower postures are drawn again
MOST_TRIES = 200
RANGE_SHARE = 0.96  # of a joint's range that a motion may use
SETTLED_S = 0.35  # from the start of the motion to the earliest collision
WATCHED_S = 0.35  # from the end of the latest push to the end of the run
STAYS_S = 1.2  # a force that stays, after its rise
WIRE_RAD, WIRE_RAD_S = 4.0, 8.0  # range of JointState, with margin for noise
ROD_RADIUS_M = 0.02
BALL_RADIUS_M = 0.05

Vector = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Arm:
    """Constants of a robot for drawing; computed once."""

    robot: Robot
    dynamics: Dynamics
    home: Vector
    low: Vector
    high: Vector
    speed: Vector
    up: Vector


@functools.lru_cache(maxsize=4)
def arm_of(robot: Robot) -> Arm:
    """Limits within which motions stay."""
    dynamics = Dynamics(robot)
    low = np.array([joint.position_min for joint in robot.joints])
    high = np.array([joint.position_max for joint in robot.joints])
    low, high = np.maximum(low, -WIRE_RAD), np.minimum(high, WIRE_RAD)
    middle, half = (low + high) / 2, RANGE_SHARE * (high - low) / 2
    speed = np.array([joint.velocity_max for joint in robot.joints])
    return Arm(
        robot,
        dynamics,
        home(robot, dynamics),
        middle - half,
        middle + half,
        np.minimum(speed, WIRE_RAD_S),
        -robot.gravity / max(float(np.linalg.norm(robot.gravity)), 1e-9),
    )


def draw(plan: Plan, task: TaskName, kind: int, first: int, count: int) -> Rows:
    """Rows `first` to `first + count` (layout.RUN) of the task's free moves or collisions."""
    arm = arm_of(plan.configuration.robot)
    runs = np.zeros(count, layout.RUN)
    for offset in range(count):
        number = first + offset
        rng = np.random.Generator(np.random.Philox(key=plan.file.seed, counter=[0, TASKS[task], kind, number]))
        _draw_one(plan, arm, task, kind, rng, runs[offset])
        runs[offset]["seed"] = plan.file.seed * 64 + TASKS[task] * 4 + kind
        runs[offset]["number"] = number
    return runs


def _draw_one(plan: Plan, arm: Arm, task: TaskName, kind: int, rng: np.random.Generator, run: Any) -> None:
    file, n = plan.file, arm.robot.n
    run["task"], run["obeys"] = TASKS[task], 1
    run["duration_s"] = file.motion.duration_s
    run["mass_scale"][:n] = 1 + file.model_error * rng.uniform(-1, 1, n)
    _draw_motion(plan, arm, rng, run)
    draw_sensors(plan.sensors, n, rng, run["sensors"])
    if task == "payload":
        _draw_payload(plan, rng, run)
    if task == "contact":
        _draw_guide(plan, rng, run)
    if kind == HIT:
        _draw_collision(plan, arm, rng, run)


def _posture(arm: Arm, spread: float, rng: np.random.Generator) -> Vector:
    for _ in range(MOST_TRIES):
        joints = np.clip(arm.home + spread * rng.uniform(-1, 1, arm.robot.n), arm.low, arm.high)
        if arm.dynamics.tip(joints)[0] @ arm.up > LOWEST_TIP_M:
            return joints
    return np.clip(arm.home, arm.low, arm.high)


def _draw_motion(plan: Plan, arm: Arm, rng: np.random.Generator, run: Any) -> None:
    motion, n = plan.file.motion, arm.robot.n
    spread, share = rng.uniform(*motion.spread_rad), rng.uniform(*motion.speed)
    kind = motion.kinds[int(rng.integers(len(motion.kinds)))]
    start, goal = _posture(arm, spread, rng), _posture(arm, spread, rng)
    run["start"][:n], run["goal"][:n] = start, goal
    run["move_s"] = 1.0
    if kind == "move":
        run["motion"] = layout.MOVE
        fastest = float(np.max(np.abs(goal - start) / arm.speed))
        run["move_s"] = max(1.875 * fastest / share, 0.25)
    elif kind == "wave":
        run["motion"] = layout.WAVE
        rates = 2 * math.pi * np.sort(rng.uniform(0.15, 1.2, layout.WAVES))
        phases = rng.uniform(-math.pi, math.pi, layout.WAVES)
        raw = rng.uniform(-1, 1, (layout.WAVES, n)) / rates[:, None]
        time = np.linspace(0, plan.file.motion.duration_s, 200)
        angles = rates[:, None] * time + phases[:, None]
        velocity = raw.T @ (rates[:, None] * np.cos(angles))
        position = raw.T @ (np.sin(angles) - np.sin(phases)[:, None])
        slowest = [share * float(np.min(arm.speed / np.maximum(np.abs(velocity).max(axis=1), 1e-9)))]
        for joint in range(n):
            for extreme, room in ((position[joint].max(), arm.high), (position[joint].min(), arm.low)):
                if abs(extreme) > 1e-9:
                    slowest.append(max((room[joint] - start[joint]) / extreme, 0.0))
        run["amplitude"][:, :n] = raw * min(slowest)
        run["frequency"], run["phase"] = rates, phases
    else:
        run["motion"] = layout.REST


def draw_sensors(model: SensorModel, n: int, rng: np.random.Generator, sensors: Any) -> None:
    """One arm's sensors, as tauperp.sim.sensors draws them."""
    sensors["offset"][:n] = model.torque_offset_nm * rng.uniform(-1, 1, n)
    sensors["gain"][:n] = 1 + model.torque_gain_error * rng.uniform(-1, 1, n)
    sensors["ripple"][:n] = model.torque_ripple_nm * rng.uniform(-1, 1, n)
    sensors["phase"][:n] = rng.uniform(0, 2 * math.pi, n)
    sensors["ripple_per_turn"] = model.ripple_per_turn
    sensors["torque_noise"] = model.torque_noise_nm
    sensors["velocity_noise"] = model.velocity_noise_rad_s
    sensors["position_noise"] = model.position_noise_rad
    sensors["delay"] = model.delay_cycles
    sensors["friction"][:n] = model.torque_friction_nm * rng.uniform(0.5, 1, n)
    sensors["torque_quantum"] = model.torque_quantum_nm
    sensors["velocity_quantum"] = model.velocity_quantum_rad_s


def _draw_payload(plan: Plan, rng: np.random.Generator, run: Any) -> None:
    payload = plan.file.payload
    mass = rng.uniform(*payload.mass_kg)
    is_rod = rng.uniform() < payload.rods
    direction = unit(rng)
    run["payload_mass"], run["payload_com"] = mass, rng.uniform(*payload.com_m) * direction
    length = rng.uniform(*payload.rod_m)
    if is_rod:  # across the flange, along its x axis
        across = mass * (length**2 / 12 + ROD_RADIUS_M**2 / 4)
        run["payload_inertia"] = [mass * ROD_RADIUS_M**2 / 2, across, across]
    else:
        run["payload_inertia"] = 0.4 * mass * BALL_RADIUS_M**2


def _draw_guide(plan: Plan, rng: np.random.Generator, run: Any) -> None:
    guide = plan.file.guide
    run["guide_force"] = rng.uniform(*guide.force_n) * unit(rng)
    run["guide_moment"] = rng.uniform(*guide.moment_nm) * unit(rng)
    rise = rng.uniform(*guide.rise_s)
    run["guide_start_s"], run["guide_rise_s"] = rng.uniform(0.0, 0.4), rise
    run["guide_hold_s"] = plan.file.motion.duration_s


def _draw_collision(plan: Plan, arm: Arm, rng: np.random.Generator, run: Any) -> None:
    collision = plan.file.collision
    kind = collision.kinds[int(rng.integers(len(collision.kinds)))]
    link = int(rng.integers(plan.links[0], plan.links[1] + 1)) - 1
    run["link"], run["push"] = link, layout.PUSHES[kind]
    run["force_n"] = rng.uniform(*collision.force_n)
    run["push_s"] = rng.uniform(*collision.push_ms) * 1e-3
    latest = plan.file.motion.duration_s - run["push_s"] - WATCHED_S
    run["onset_s"] = rng.uniform(SETTLED_S, max(latest, SETTLED_S + 1e-3))
    run["along"], run["angle"] = rng.uniform(0, 1), rng.uniform(0, 2 * math.pi)
    part = BODY_PARTS[collision.parts[int(rng.integers(len(collision.parts)))]]
    run["part_mass"], run["part_stiffness"], run["part_radius"] = part.mass_kg, part.stiffness_n_m, part.radius_m
    run["speed_m_s"] = rng.uniform(*collision.speed_m_s)
    run["point"] = surface_point(arm.robot, link, run["along"], rng)
    run["direction"] = unit(rng)
    if kind in ("touch", "clamp"):  # the force stays: the run lasts until the guard can classify it
        run["push_s"] = rng.uniform(*collision.touch_ms) * 1e-3
        run["onset_s"] = rng.uniform(SETTLED_S, 2 * SETTLED_S)
        run["duration_s"] = run["onset_s"] + run["push_s"] + STAYS_S
    if kind == "contact":  # time for the part to reach the arm
        run["onset_s"] = max(run["onset_s"] - 0.12 / run["speed_m_s"], 0.05)


def surface_point(robot: Robot, link: int, along: float, rng: np.random.Generator) -> Vector:
    """A point (3,) m of a link's surface in the link's frame: `along` 0 to 1 from its lower to its upper end."""
    shape = robot.capsules[link]
    axis = shape.p1 - shape.p0
    length = float(np.linalg.norm(axis))
    side = unit(rng)
    if length > 1e-9:
        side = side - axis * (side @ axis) / length**2
    point: Vector = shape.p0 + along * axis + shape.radius * side / max(float(np.linalg.norm(side)), 1e-9)
    return point


def unit(rng: np.random.Generator) -> Vector:
    """A direction (3,), evenly distributed."""
    vector = rng.standard_normal(3)
    result: Vector = vector / np.linalg.norm(vector)
    return result
