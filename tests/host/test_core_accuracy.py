"""The firmware's mathematics against Pinocchio and LAPACK in float64, on random states of every robot that ships."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest
from plain import plain

from tauperp.config import Numeric
from tauperp.firmware import Core
from tauperp.robot import Robot, load, shipped
from tauperp.robot.check import pinocchio_reader

Array = npt.NDArray[np.float64]

STATES = 1000
SEED = 20260


@dataclass(frozen=True)
class Bounds:
    """Largest differences allowed: Nm s and Nm, the Jacobian's entries, and the projector's by the smallest sigma."""

    torque: float
    jacobian: float
    projector: float  # smallest singular value above 1e-3
    projector_well: float  # above 1e-2


BOUNDS: dict[Numeric, Bounds] = {
    "float32": Bounds(1e-4, 1e-5, 2e-5, 2e-5),
    "q9.22": Bounds(1e-4, 1e-5, 2e-4, 2e-5),
}


@pytest.fixture(params=shipped())
def robot(request: pytest.FixtureRequest) -> Robot:
    return load(request.param)


@pytest.fixture(params=["float32", "q9.22"])
def numeric(request: pytest.FixtureRequest) -> Numeric:
    return request.param


@pytest.fixture
def core(robot: Robot, numeric: Numeric) -> Core:
    return Core(robot, numeric=numeric, config=plain(robot))


def random_states(robot: Robot, count: int = STATES) -> tuple[Array, Array]:
    """Positions within the limits and velocities up to the limits, (count, n) each, exactly representable in num_t.

    Multiples of 2^-16 are numbers of both types, so that no difference comes from rounding the input.
    """
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    low = [joint.position_min for joint in robot.joints]
    high = [joint.position_max for joint in robot.joints]
    limit = np.array([joint.velocity_max for joint in robot.joints])
    q = random.uniform(low, high, (count, robot.n))
    qd = random.uniform(-limit, limit, (count, robot.n))
    qd[::10] = np.sign(qd[::10]) * limit  # the worst ones
    return np.trunc(q * 2**16) / 2**16, np.trunc(qd * 2**16) / 2**16


def exact(values: Array, numeric: Numeric) -> Array:
    """The float64 value of a num_t."""
    return values.astype(np.float32).astype(float) if numeric == "float32" else np.rint(values * 2**22) / 2**22


def projector_of(core: Core, basis: Array, tolerance: float) -> tuple[Array, Array, int]:
    """The firmware's projector (n, n), column by column, its singular values and rank."""
    n = len(basis)
    results = [core.project(basis, unit, tolerance) for unit in np.eye(n)]
    return np.column_stack([r.index for r in results]), results[0].singular_values, results[0].rank


def reference_projector(basis: Array, tolerance: float) -> tuple[Array, Array, int]:
    left, singular, _ = np.linalg.svd(basis, full_matrices=False)
    explained = left[:, singular > tolerance]
    return np.eye(len(basis)) - explained @ explained.T, singular, explained.shape[1]


def bases_of(jacobian: Array, acceleration: Array, lever: float = 0.1) -> dict[str, Array]:
    """The two tasks' columns (n, 5) and (n, 6) at one pose."""
    moments = lever * jacobian[3:].T
    down, across = np.array([0.0, 0.0, -1.0]), acceleration * (1.0, 1.0, 0.0)
    payload = np.column_stack([jacobian[:3].T @ down, jacobian[:3].T @ across, moments])
    return {"payload": payload, "contact": np.column_stack([jacobian[:3].T, moments])}


def test_the_motion_pass_agrees_with_pinocchio(core: Core, robot: Robot, numeric: Numeric) -> None:
    bounds = BOUNDS[numeric]
    q, qd = random_states(robot)
    ours, reader = core.terms(q, qd), pinocchio_reader(robot)
    worst = dict.fromkeys(("momentum", "coriolis", "gravity", "jacobian"), 0.0)
    for k in range(STATES):
        theirs = reader(q[k], qd[k])
        for name in worst:
            difference = float(np.max(np.abs(getattr(ours, name)[k] - getattr(theirs, name))))
            assert np.isfinite(difference)
            worst[name] = max(worst[name], difference)
    print({name: f"{value:.1e}" for name, value in worst.items()})
    assert max(worst["momentum"], worst["coriolis"], worst["gravity"]) <= bounds.torque
    assert worst["jacobian"] <= bounds.jacobian


def test_the_projector_agrees_with_lapack(core: Core, robot: Robot, numeric: Numeric) -> None:
    bounds = BOUNDS[numeric]
    q, qd = random_states(robot)
    random = np.random.default_rng(SEED + 1)
    jacobians = core.terms(q, qd).jacobian
    counted = {"well": 0, "ill": 0}
    worst = {"well": 0.0, "ill": 0.0, "singular": 0.0}
    for k in range(STATES):
        bases = bases_of(jacobians[k], random.uniform(-4.0, 4.0, 3))
        basis = exact(bases["payload" if k % 3 == 0 else "contact"], numeric)
        expected, singular, rank = reference_projector(basis, 5e-4)
        if singular[-1] <= 1e-3:
            continue
        found, ours, our_rank = projector_of(core, basis, 5e-4)
        assert our_rank == rank
        kind = "well" if singular[-1] > 1e-2 else "ill"
        counted[kind] += 1
        worst[kind] = max(worst[kind], float(np.max(np.linalg.norm(found - expected, axis=0))))
        worst["singular"] = max(worst["singular"], float(np.max(np.abs(ours - singular))))
    print(counted, {name: f"{value:.1e}" for name, value in worst.items()})
    assert counted["well"] > STATES / 2  # most poses are well conditioned
    assert worst["well"] <= bounds.projector_well
    assert worst["ill"] <= bounds.projector
    assert worst["singular"] <= 1e-5


def test_the_residual_agrees_with_a_float64_observer(core: Core, robot: Robot, numeric: Numeric) -> None:
    """A second of fast motion with unrelated torques: only the arithmetic differs."""
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    period, gain, ticks = 1e-3, 50.0, 1000
    reader = pinocchio_reader(robot)
    middle = np.array([(joint.position_min + joint.position_max) / 2 for joint in robot.joints])
    limit = np.array([joint.velocity_max for joint in robot.joints])
    rate = random.uniform(3.0, 9.0, robot.n)
    phase = random.uniform(0.0, 2.0 * np.pi, robot.n)
    decay = np.exp(-gain * period)
    residual, before = np.zeros(robot.n), None
    worst = 0.0
    for k in range(ticks):
        angle = rate * k * period + phase
        q = np.trunc((middle + 0.9 * limit / rate * np.sin(angle)) * 2**16) / 2**16
        qd = np.trunc(0.9 * limit * np.cos(angle) * 2**16) / 2**16
        tau = np.trunc(random.uniform(-60.0, 60.0, robot.n) * 2**8) / 2**8
        terms = reader(q, qd)
        drift = terms.coriolis - terms.gravity
        if before is not None:
            rest = tau + (drift + before[1]) / 2 - (terms.momentum - before[0]) / period
            residual = decay * residual + (1.0 - decay) * rest
        before = (terms.momentum, drift)
        step = core.step(q, qd, tau, "none")
        worst = max(worst, float(np.max(np.abs(step.residual - residual))))
        assert np.allclose(step.index, step.residual, atol=1e-3)
    print(f"{worst:.1e}")
    assert worst <= 0.002


def test_rank_deficient_columns_agree_with_lapack(numeric: Numeric) -> None:
    core = Core("ku_dex", numeric=numeric, config=plain("ku_dex"))
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    worst = 0.0
    for k in range(STATES):
        rank, columns = k % 6, 1 + k % 6
        left = np.linalg.qr(random.normal(size=(7, 7)))[0][:, :rank]
        right = np.linalg.qr(random.normal(size=(columns, columns)))[0][:, :rank]
        basis = exact((left * random.uniform(0.05, 1.5, left.shape[1])) @ right.T, numeric)
        expected, singular, full = reference_projector(basis, 1e-3)
        found, ours, our_rank = projector_of(core, basis, 1e-3)
        assert our_rank == full == rank
        assert np.max(np.abs(ours - singular)) < 5e-6
        worst = max(worst, float(np.max(np.linalg.norm(found - expected, axis=0))))
    print(f"{worst:.1e}")
    assert worst <= 2e-5


class TestDegenerateInput:
    def test_without_columns_nothing_is_explained(self, numeric: Numeric) -> None:
        tau = exact(np.linspace(-20.0, 30.0, 7), numeric)
        result = Core("ku_dex", numeric=numeric).project(np.zeros((7, 0)), tau, 0.005)
        assert result.rank == 0
        assert result.singular_values.shape == (0,)
        assert np.array_equal(result.index, tau)

    def test_columns_of_zeros_explain_nothing(self, numeric: Numeric) -> None:
        tau = exact(np.linspace(-20.0, 30.0, 7), numeric)
        result = Core("ku_dex", numeric=numeric).project(np.zeros((7, 5)), tau, 0.005)
        assert result.rank == 0
        assert not result.singular_values.any()
        assert np.array_equal(result.index, tau)

    def test_an_arm_at_rest_without_torque_has_zero_indexes(self, numeric: Numeric) -> None:
        core = Core("ku_dex", numeric=numeric, config=plain("ku_dex"))
        zero = np.zeros(7)
        gravity = core.terms(zero, zero).gravity
        for task in ("none", "payload", "contact"):
            for _ in range(20):
                step = core.step(zero, zero, gravity, task)
                assert np.max(np.abs(step.residual)) < 1e-5
                assert np.max(np.abs(step.index)) < 1e-5

    @pytest.mark.parametrize("upward", [0.0, -9.81, 4.0])
    def test_no_acceleration_across_gravity_leaves_gravity_and_the_moments(
        self, numeric: Numeric, upward: float
    ) -> None:
        """The payload's index is then of rank 4, whatever the acceleration along gravity is."""
        core = Core("ku_dex", numeric=numeric, config=plain("ku_dex"))
        q = np.array([0.3, 0.8, -0.4, -1.3, 0.6, 0.9, 0.2])
        terms = core.terms(q, np.zeros(7))
        push = np.array([2.0, -3.0, 1.0, 4.0, -1.0, 0.5, 1.0])
        for _ in range(300):
            step = core.step(q, np.zeros(7), terms.gravity + push, "payload", [0.0, 0.0, upward])
        basis = bases_of(terms.jacobian, np.zeros(3))["payload"]
        expected, _, rank = reference_projector(basis, 0.005)
        assert rank == 4
        assert np.max(np.abs(step.index - expected @ step.residual)) < 2e-4
        assert np.max(np.abs(step.residual - push)) < 1e-3
