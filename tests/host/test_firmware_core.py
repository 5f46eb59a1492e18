"""The firmware's mathematics through Core: the meaning of its results, and its messages for wrong arguments.

test_core_accuracy.py tests the accuracy.
"""

import dataclasses
import pydoc
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from plain import plain

from tauperp import robot
from tauperp.config import Numeric, load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Core, Guard
from tauperp.firmware.core import Method
from tauperp.sim.model import build_spec

SEED = 20261122
FLOAT32_PROJECTOR = 2e-5

Q = np.array([0.3, -0.7, 0.5, 1.1, -0.4, 0.8, 0.2])
REST = np.zeros(7)


@pytest.fixture(scope="module")
def core() -> Core:
    return Core("ku_dex", config=plain("ku_dex"))


METHODS: tuple[Method, ...] = ("golub-kahan", "jacobi")


@pytest.mark.parametrize("method", METHODS)
def test_singular_values_agree_with_lapack_in_descending_order(core: Core, method: Method) -> None:
    random = np.random.default_rng(SEED)
    for columns in range(7):
        matrix = random.normal(size=(7, columns))
        found = core.project(matrix, np.ones(7), 1e-3, method)
        np.testing.assert_allclose(found.singular_values, np.linalg.svd(matrix, compute_uv=False), rtol=1e-5)
        assert found.rank == columns


@pytest.mark.parametrize("numeric", ["float32", "q9.22"])
def test_both_methods_project_alike(numeric: Numeric) -> None:
    core, random = Core("ku_dex", numeric, config=plain("ku_dex")), np.random.default_rng(SEED)
    for _ in range(200):
        matrix, tau = random.uniform(-1, 1, size=(7, 5)), random.uniform(-10, 10, size=7)
        first, second = (core.project(matrix, tau, 1e-3, method) for method in METHODS)
        assert first.rank == second.rank
        np.testing.assert_allclose(first.index, second.index, atol=4e-4)
        np.testing.assert_allclose(first.singular_values, second.singular_values, atol=5e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_direction_below_the_tolerance_is_not_explained(core: Core, method: Method) -> None:
    matrix = np.zeros((7, 2))
    matrix[0, 0], matrix[1, 1] = 1.0, 0.01
    tau = np.arange(1.0, 8.0)
    fine, coarse = (core.project(matrix, tau, tolerance, method) for tolerance in (0.005, 0.02))
    np.testing.assert_allclose(fine.index, [0, 0, 3, 4, 5, 6, 7], atol=1e-6)
    np.testing.assert_allclose(coarse.index, [0, 2, 3, 4, 5, 6, 7], atol=1e-6)
    assert (fine.rank, coarse.rank) == (2, 1)


def test_a_repeated_column_explains_no_more_than_one(core: Core) -> None:
    random = np.random.default_rng(SEED)
    matrix, tau = random.normal(size=(7, 3)), random.normal(size=7)
    twice = core.project(np.hstack([matrix, matrix[:, :1]]), tau, 1e-3)
    assert twice.rank == 3
    np.testing.assert_allclose(twice.index, core.project(matrix, tau, 1e-3).index, atol=FLOAT32_PROJECTOR)


@pytest.mark.parametrize("columns", [0, 6])
def test_zero_columns_explain_nothing(core: Core, columns: int) -> None:
    found = core.project(np.zeros((7, columns)), np.arange(7.0), 1e-3)
    assert found.rank == 0
    np.testing.assert_array_equal(found.index, np.arange(7.0))


def test_as_many_columns_as_joints_leave_nothing(core: Core) -> None:
    assert np.abs(core.project(np.eye(6), np.arange(6.0), 1e-3).index).max() < 1e-6


def hold(core: Core, external: np.ndarray, steps: int, task: str | int = "none", **options: Any) -> Any:
    """Stand at Q with an external torque on top of gravity from the second sample on."""
    gravity = core.terms(Q, REST).gravity
    core.reset()
    core.step(Q, REST, gravity, task, **options)
    for _ in range(steps):
        last = core.step(Q, REST, gravity + external, task, **options)
    return last


def test_the_residual_approaches_the_external_torque_at_the_rate_of_the_gain(core: Core) -> None:
    external = np.array([3.0, -2.0, 1.0, 0.0, 0.5, -0.5, 0.2])
    found = hold(core, external, 20)
    np.testing.assert_allclose(found.residual, external * (1 - np.exp(-50 * 0.020)), atol=1e-4)
    np.testing.assert_array_equal(found.index, found.residual)


def test_the_first_step_after_a_reset_has_no_residual(core: Core) -> None:
    hold(core, np.ones(7), 5)
    core.reset()
    np.testing.assert_array_equal(core.step(Q, REST, np.ones(7), "none").residual, np.zeros(7))


def test_contact_explains_a_wrench_at_the_end_effector_and_no_other_torque(core: Core) -> None:
    jacobian = core.terms(Q, REST).jacobian
    wrench = np.array([20.0, -10.0, 15.0, 1.0, -2.0, 0.5])
    guided = hold(core, jacobian.T @ wrench, 100, "contact")
    assert np.abs(guided.residual).max() > 5
    assert np.abs(guided.index).max() < 1e-3
    left, _, _ = np.linalg.svd(jacobian.T)
    struck = hold(core, jacobian.T @ wrench + 3 * left[:, 6], 100, "contact")
    np.testing.assert_allclose(struck.index, 3 * left[:, 6] * (1 - np.exp(-5)), atol=1e-3)


def test_payload_explains_a_weight_but_not_a_push_across_it(core: Core) -> None:
    linear = core.terms(Q, REST).jacobian[:3]
    assert np.abs(hold(core, linear.T @ [0, 0, -20.0], 100, "payload").index).max() < 1e-3
    assert np.abs(hold(core, linear.T @ [20.0, 0, 0], 100, "payload").index).max() > 1


def test_an_acceleration_that_the_arm_does_not_make_explains_nothing(core: Core) -> None:
    push = core.terms(Q, REST).jacobian[:3].T @ [20.0, 0, 0]
    expected = hold(core, push, 200, "payload").index
    np.testing.assert_allclose(hold(core, push, 200, "payload", accel=[3.0, 0, 0]).index, expected, atol=1e-3)
    np.testing.assert_allclose(hold(core, push, 200, "payload", accel=[0.02, 0, 0]).index, expected, atol=1e-4)


def test_payload_explains_inertia_along_an_acceleration_that_the_arm_makes() -> None:
    core = Core("ku_dex", config="default")
    step, worst = np.zeros(7), 0.0
    for k in range(400):  # the tip moves back and forth along x with 3 m/s^2
        sign = 1.0 if k % 200 < 100 else -1.0
        velocity = 3.0 * 1e-3 * (k % 100 if sign > 0 else 100 - k % 100)
        jacobian = core.terms(Q, REST).jacobian
        rates = np.linalg.pinv(jacobian[:3]) @ [velocity, 0.0, 0.0]
        terms = core.terms(Q, rates)
        before = core.terms(Q, np.linalg.pinv(jacobian[:3]) @ [velocity - sign * 3e-3, 0.0, 0.0])
        torque = terms.gravity - terms.coriolis + (terms.momentum - before.momentum) / 1e-3
        carried = jacobian[:3].T @ [sign * 3.0 * 2.0, 0.0, 0.0]  # 2 kg
        found = core.step(Q, rates, torque + carried, "payload", accel=[sign * 3.0, 0.0, 0.0])
        if k % 100 > 60:  # the filtered commanded and measured acceleration agree again
            worst = max(worst, float(np.abs(found.index).max()))
        step = np.maximum(step, np.abs(found.residual))
    assert step.max() > 2.0
    assert worst < 0.35


@pytest.mark.parametrize("acceleration", [None, [0.0, 0.0, 0.0], [0.0, 0.0, 4.0]])
def test_no_acceleration_and_one_along_gravity_are_the_same_to_payload(core: Core, acceleration: Any) -> None:
    push = core.terms(Q, REST).jacobian[:3].T @ [20.0, 0, 0]
    expected = hold(core, push, 100, "payload").index
    np.testing.assert_allclose(hold(core, push, 100, "payload", accel=acceleration).index, expected, atol=1e-4)


def test_a_task_is_given_by_name_or_by_the_wires_number(core: Core) -> None:
    push = core.terms(Q, REST).jacobian[:3].T @ [20.0, 0, 0]
    for number, name in enumerate(("none", "payload", "contact"), start=1):
        np.testing.assert_array_equal(hold(core, push, 10, number).index, hold(core, push, 10, name).index)


def test_an_arm_at_rest_without_any_torque_is_all_zero() -> None:
    weightless = dataclasses.replace(robot.load("ku_dex"), gravity=np.zeros(3))
    core = Core(weightless)
    terms = core.terms(Q, REST)
    assert not np.concatenate([terms.momentum, terms.coriolis, terms.gravity]).any()
    for task in ("none", "payload", "contact"):
        core.reset()
        for _ in range(3):
            assert not core.step(Q, REST, REST, task).index.any()


def test_a_configuration_decides_gain_and_period() -> None:
    slow = load_configuration("default", robot="ku_dex").changed(observer={"gain_per_s": 10.0}, wire={"rate_hz": 200})
    found = hold(Core("ku_dex", config=slow), np.ones(7), 20)
    np.testing.assert_allclose(found.residual, 1 - np.exp(-10 * 0.1), atol=1e-4)


def test_results_are_copies(core: Core) -> None:
    first = core.terms(Q, REST)
    kept = first.gravity.copy()
    core.terms(-Q, REST)
    np.testing.assert_array_equal(first.gravity, kept)


def test_many_instants_at_once_are_the_same_as_one_by_one(core: Core) -> None:
    positions, velocities = np.random.default_rng(SEED).uniform(-1.5, 1.5, (2, 3, core.n))
    together = core.terms(positions, velocities)
    assert together.jacobian.shape == (3, 6, 7)
    for i in range(3):
        for ours, one in zip(together, core.terms(positions[i], velocities[i]), strict=True):
            np.testing.assert_array_equal(ours[i], one)


def recording(core: Core, rows: int) -> tuple[np.ndarray, ...]:
    """An arm that moves slowly, and is pushed from the middle on."""
    time = np.arange(rows)[:, None] * 1e-3
    q = Q + 0.01 * np.sin(time * np.arange(1, core.n + 1))
    qd = np.gradient(q, 1e-3, axis=0)
    tau = core.terms(q, qd).gravity
    tau[rows // 2 :, 3] += 5.0
    return q, qd, tau


@pytest.mark.parametrize("task", ["none", "payload", "contact"])
def test_many_cycles_in_one_call_are_the_same_as_one_by_one(core: Core, task: Any) -> None:
    q, qd, tau = recording(core, 60)
    accel = np.random.default_rng(SEED).uniform(-1, 1, (60, 3))
    core.reset()
    together = core.step(q, qd, tau, task, accel)
    core.reset()
    for row in range(60):
        one = core.step(q[row], qd[row], tau[row], task, accel[row])
        np.testing.assert_array_equal(together.residual[row], one.residual)
        np.testing.assert_array_equal(together.index[row], one.index)


def test_a_task_may_change_from_row_to_row(core: Core) -> None:
    q, qd, tau = recording(core, 40)
    core.reset()
    found = core.step(q, qd, tau, np.repeat([1, 3], 20)).index
    core.reset()
    first, second = core.step(q[:20], qd[:20], tau[:20], "none"), core.step(q[20:], qd[20:], tau[20:], "contact")
    np.testing.assert_array_equal(found, np.concatenate([first.index, second.index]))
    with pytest.raises(ValueError, match=r"task: shape \(3,\) of int64, must be whole numbers \(40,\)"):
        core.step(q, qd, tau, [1, 1, 1])
    with pytest.raises(ValueError, match=r"q\[1, 2\]: nan is not a finite number"):
        core.step(np.where(np.arange(7) + 7 * np.arange(40)[:, None] == 9, np.nan, q), qd, tau, "none")


def test_one_call_finds_the_trips_in_arrays(core: Core) -> None:
    q, qd, tau = recording(core, 200)
    core.step(q, qd, -tau, "none")  # trips() starts from a reset and forgets this
    (trip,) = core.trips(q, qd, tau, "none")
    assert trip.joint == 4
    assert 100 < trip.row < 120
    assert abs(trip.index_nm) > trip.threshold_nm > 0
    assert core.trips(q[:100], qd[:100], tau[:100], "none") == []


def test_the_basis_is_what_the_task_explains(core: Core) -> None:
    jacobian = core.terms(Q, REST).jacobian
    core.reset()
    core.step(Q, REST, np.ones(7), "contact")
    assert core.basis.shape == (7, 6)
    np.testing.assert_allclose(core.basis[:, :3], jacobian[:3].T, atol=1e-6)
    core.step(Q, REST, np.ones(7), "none")
    assert core.basis.shape == (7, 0)


def test_jacobians_of_links_are_the_motion_of_their_points(core: Core) -> None:
    tip = core.robot.tip
    np.testing.assert_allclose(core.link_jacobian(Q, 7, tip), core.terms(Q, REST).jacobian, atol=1e-6)
    data = mujoco.MjData(model := build_spec(core.robot, timestep_s=1e-3).compile())
    data.qpos[:7] = Q
    mujoco.mj_forward(model, data)
    point, body = np.array([0.02, -0.03, 0.1]), model.body(core.robot.joints[3].name).id
    expected = np.zeros((6, model.nv))
    place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ point
    mujoco.mj_jac(model, data, expected[:3], expected[3:], place, body)
    np.testing.assert_allclose(core.link_jacobian(Q, 4, point), expected[:, :7], atol=1e-6)
    with pytest.raises(ValueError, match="link: 8, must be 1 to 7"):
        core.link_jacobian(Q, 8)


def test_an_object_describes_itself_and_help_is_short(core: Core) -> None:
    assert repr(core) == "Core('ku_dex', 'float32', 'default'): 7 joints"
    assert repr(Guard(core.configuration.block())).startswith("Guard: 7 joints, float32, UNINITIALISED")
    assert max(len(line) for line in pydoc.render_doc(Core.step, renderer=pydoc.plaintext).splitlines()) < 200


NAN = np.full(7, np.nan)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda core: core.terms(Q[:6], REST), r"q: shape \(6,\), must be \(7,\)"),
        (lambda core: core.terms(Q, REST[:, None]), r"qd: shape \(7, 1\), must be \(7,\)"),
        (lambda core: core.terms([Q, Q], REST), r"qd: shape \(7,\), but q has \(2, 7\)"),
        (lambda core: core.terms(np.empty((0, 7)), np.empty((0, 7))), "q: no rows"),
        (lambda core: core.terms(NAN, REST), r"q\[0\]: nan is not a finite number"),
        (lambda core: core.terms(Q, NAN), r"qd\[0\]: nan"),
        (lambda core: core.step(Q, REST, np.inf * Q, 1), r"tau\[0\]: inf"),
        (lambda core: core.step(Q, REST, Q, 1, [0, 0]), r"accel: shape \(2,\), must be \(3,\)"),
        (lambda core: core.step(Q, REST, Q, "payloads"), "task: 'payloads' is unknown"),
        (lambda core: core.step(Q, REST, Q, 0), "task: 0 is unknown"),
        (lambda core: core.project(np.eye(7), Q, 1e-3), r"A: shape \(7, 7\)"),
        (lambda core: core.project(Q, Q, 1e-3), r"A: shape \(7,\)"),
        (lambda core: core.project(np.full((7, 2), np.nan), Q, 1e-3), "A: every entry must be a number"),
        (lambda core: core.project(np.full((7, 2), 64.0), Q, 1e-3), "A: every entry must be a number below 64"),
        (lambda core: core.project(np.ones((7, 2)), Q[:5], 1e-3), r"tau: shape \(5,\), must be \(7,\)"),
        (lambda core: core.project(np.ones((7, 2)), Q, -1.0), "tolerance: -1.0"),
        (lambda core: core.project(np.ones((7, 2)), Q, 0.1, "qr"), "method: 'qr' is unknown"),
        (lambda core: core.project(np.ones((7, 2)), Q, np.nan), "tolerance: nan"),
    ],
)
def test_a_wrong_argument_is_named(core: Core, call: Callable[[Core], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(core)


def test_a_wrong_argument_changes_nothing() -> None:
    core = Core("ku_dex")
    before = hold(core, np.ones(7), 5)
    with pytest.raises(ValueError, match="tau"):
        core.step(Q, REST, NAN, "none")
    gravity = core.terms(Q, REST).gravity
    after = core.step(Q, REST, gravity + 1, "none")
    np.testing.assert_allclose(after.residual, 1 - (1 - before.residual) * np.exp(-0.05), atol=1e-5)


def test_a_task_that_is_off_for_the_arm_is_refused_with_the_reason() -> None:
    whole = robot.load("ku_dex")
    core = Core(dataclasses.replace(whole, joints=whole.joints[:6], capsules=whole.capsules[:6]))
    with pytest.raises(InputError, match="'contact' is off for the 6 joints"):
        core.step(Q[:6], REST[:6], Q[:6], "contact")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(("nonsense",), "nonsense"), (("ku_dex", "float64"), "'float64' is unknown"), (("ku_dex", "float32", "x"), "x")],
)
def test_an_unknown_robot_numeric_or_configuration_is_refused(arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Core(*arguments)
