"""What a moving payload leaves in the payload's index, without a collision and with ideal sensors."""

from collections.abc import Iterator

import numpy as np
import pytest

from tauperp.config import Configuration, load_configuration
from tauperp.firmware import Core
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.posture import home

MASS_KG, OFFSET_M = 2.0, (0.04, 0.0, 0.03)  # 5 cm from the end-effector point
SPEED_M_S = 1.0  # of the end-effector
PERIOD_S = 1e-3
ACCELERATION_M_S2 = 4.0
MOVES = 8

Move = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # q, qd, joint torque (m, n), acceleration (m, 3)


def quintic(duration_s: float) -> np.ndarray:
    """Share of the way and its rate, (2, m); at rest for 0.2 s before and after."""
    x = np.clip((np.arange(0.0, duration_s + 0.4, PERIOD_S) - 0.2) / duration_s, 0.0, 1.0)
    way = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    rate = 30.0 * x**2 * (1.0 - x) ** 2 / duration_s
    return np.array([way, rate])


def mean_of_interval(values: np.ndarray) -> np.ndarray:
    return np.concatenate([values[:1], (values[1:] + values[:-1]) / 2])


def carried(core: Core, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Joint torque (m, n) of a point mass at rest in the gripper."""
    point = np.asarray(core.robot.tip) + OFFSET_M
    jacobian = np.array([core.link_jacobian(one, core.n, point)[:3] for one in q])
    velocity = np.einsum("kij,kj->ki", jacobian, qd)
    force = MASS_KG * (np.gradient(velocity, PERIOD_S, axis=0) + np.array([0.0, 0.0, 9.81]))
    return np.einsum("kij,ki->kj", jacobian, force)


def moves(core: Core, seed: int, most_m_s2: float) -> Iterator[Move]:
    """Random moves with a peak speed of SPEED_M_S at the end-effector and at most this acceleration."""
    rng = np.random.default_rng(seed)
    start = home(core.robot, Dynamics(core.robot))
    found = 0
    while found < MOVES:
        way = rng.uniform(-1.0, 1.0, core.n)
        along = start + way * np.linspace(0, 1, 50)[:, None]
        fastest = 1.875 * np.linalg.norm(core.terms(along, np.zeros_like(along)).jacobian[:, :3] @ way, axis=1).max()
        share, rate = quintic(fastest / SPEED_M_S)
        q, qd = start + share[:, None] * way, rate[:, None] * way
        terms = core.terms(q, qd)
        tip = np.gradient(np.einsum("kij,kj->ki", terms.jacobian[:, :3], qd), PERIOD_S, axis=0)
        if np.linalg.norm(tip, axis=1).max() <= most_m_s2:
            found += 1
            change = np.diff(terms.momentum, axis=0, prepend=terms.momentum[:1]) / PERIOD_S
            alone = change - mean_of_interval(terms.coriolis - terms.gravity)
            yield q, qd, alone + mean_of_interval(carried(core, q, qd)), tip


def leak(configuration: Configuration, seed: int, most_m_s2: float) -> tuple[float, float]:
    """Largest |r| and largest |index| of all moves, Nm."""
    core = Core("ku_dex", config=configuration)
    residual = index = 0.0
    for q, qd, torque, acceleration in moves(core, seed, most_m_s2):
        core.reset()
        step = core.step(q, qd, torque, "payload", acceleration)
        residual = max(residual, float(np.abs(step.residual).max()))
        index = max(index, float(np.abs(step.index).max()))
    print(f"|r| up to {residual:.1f} Nm, index up to {index:.3f} Nm")
    return residual, index


@pytest.mark.parametrize(("name", "most_nm"), [("d_p", 0.15), ("d_r", 0.1)])
def test_a_payload_in_motion_leaves_little_in_the_index(name: str, most_nm: float) -> None:
    overrides = {"task": {"payload": {"index": name}}}
    configuration = load_configuration("default", robot="ku_dex", overrides=overrides)
    residual, index = leak(configuration, 4711, ACCELERATION_M_S2)
    assert residual > 10.0
    assert index < most_nm
