"""Both experiments on arms as their makers publish them (PyPI's example-robot-data): each is fitted to the arm and
passes, or the report names what the arm cannot do. All are fitted and one runs; `make arms` runs every one."""

import os
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tauperp.campaign.plan import Plan, PlanFile
from tauperp.config import load_configuration
from tauperp.errors import InputError
from tauperp.experiment import EXPERIMENTS, load_experiment, run_experiment, run_scenario
from tauperp.robot import Robot, load
from tauperp.run.reach import within_wire
from tauperp.run.scenario import load_scenario
from tauperp.sim.arm import Arm
from tauperp.sim.rotor import with_rotors
from tauperp.sim.stability import Stability

ARMS: dict[str, tuple[str, dict[str, Any]]] = {
    "ur3": ("ur_description/urdf/ur3_robot.urdf", {}),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", {}),
    "ur10": ("ur_description/urdf/ur10_robot.urdf", {}),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", {}),
    "z1": ("z1_description/urdf/z1.urdf", {}),
    "panda": ("panda_description/urdf/panda.urdf", {"tip": "panda_hand_tcp"}),
    "j2s6s200": ("kinova_description/robots/kinova.urdf", {"tip": "j2s6s200_end_effector"}),
    "baxter": ("baxter_description/urdf/baxter.urdf", {"tip": "right_gripper"}),
    "tiago": (
        "tiago_description/robots/tiago_dual.urdf",
        {"base": "torso_lift_link", "tip": "arm_left_tool_link"},
    ),
    "tiago_pro": (
        "tiago_pro_description/robots/tiago_pro.urdf",
        {"base": "torso_lift_link", "tip": "arm_left_7_link"},
    ),
}
CANNOT = {  # messages about what an arm cannot do
    **{(name, "contact"): "6 joints d_e is zero for every force" for name in ("ur3", "ur5", "ur10", "j2s6s200")},
    **{("tiago", name): "1/3 of the torque limit of 3 Nm of joint arm_left_5_joint" for name in EXPERIMENTS},
}
EVERY = [(arm, name) for arm in ARMS for name in EXPERIMENTS]
ALL = os.environ.get("TAUPERP_ARMS") == "all"
RUN = [one for one in EVERY if one not in CANNOT] if ALL else [("xarm7", "contact")]


def arm(name: str) -> Robot:
    try:
        package = distribution("example-robot-data")
    except PackageNotFoundError:
        pytest.skip("the Python package example-robot-data is not installed")
    file, options = ARMS[name]
    return load(Path(str(package.locate_file("cmeel.prefix/share/example-robot-data/robots"))) / file, **options)


@pytest.fixture
def tell(capsys: pytest.CaptureFixture[str]) -> Callable[[str], None]:
    """`make arms` prints one line per arm and experiment."""

    def say(line: str) -> None:
        if ALL:
            with capsys.disabled():
                print(f"\n{line}", end=" ", flush=True)

    return say


@pytest.mark.parametrize(("name", "experiment"), EVERY)
def test_an_experiment_is_fitted_to_the_arm_or_the_reason_is_reported(
    name: str, experiment: str, tell: Callable[[str], None]
) -> None:
    robot = arm(name)
    if (name, experiment) in CANNOT:
        with pytest.raises(InputError, match=CANNOT[name, experiment]) as error:
            load_experiment(experiment, robot=robot, rate_hz=500)
        tell(f"{name} {experiment}: cannot: {str(error.value).split(': ', 1)[1]}")
        return
    scenario = load_experiment(experiment, robot=robot, rate_hz=500)
    assert any(note.startswith("rotor inertia") for note in scenario.notes)
    for phase in scenario.phases:
        for _, _, strike in phase.strikes:
            assert 1 <= strike.link <= robot.n
            assert 20.0 <= strike.push_n <= 120.0
    assert scenario.start_rad is not None
    assert np.abs(scenario.start_rad).max() < 4.09


@pytest.mark.parametrize(("name", "experiment"), RUN)
def test_a_fitted_experiment_passes(name: str, experiment: str, tell: Callable[[str], None]) -> None:
    outcome = run_experiment(experiment, load_experiment(experiment, robot=arm(name), rate_hz=500))
    why = f": {'; '.join(outcome.report['why'])}" if outcome.report["why"] else ""
    tell(f"{name} {experiment}: {outcome.report['verdict']}{why}")
    assert outcome.report["verdict"] == "passed", outcome.report["why"]
    assert all(one["detected"] for one in outcome.report["collisions"])


def test_an_unstable_simulation_without_rotors_is_not_a_false_stop() -> None:
    scenario = load_experiment("contact", robot=arm("xarm7"))
    bare, note = with_rotors(arm("xarm7"), [1e-9] * 7)
    assert note is None
    with pytest.raises(InputError, match=r"simulation of UF_ROBOT is unstable at .*joint \d.*the guard was not judged"):
        run_scenario(replace(scenario, robot=bare))


@pytest.mark.parametrize(("swing", "touched", "wrong"), [(0.3, False, True), (0.3, True, False), (1e-3, False, False)])
def test_a_velocity_that_alternates_each_cycle_is_a_fault_of_the_simulation(
    swing: float, touched: bool, wrong: bool
) -> None:
    bench = Arm(arm("z1"), period_s=1e-3)
    stability = Stability(bench)
    told = [stability.look(np.full(7, swing * (-1) ** k), alone=not touched) for k in range(200)]
    assert any(told) == wrong
    if wrong:
        assert "joint 1 oscillates from cycle to cycle" in next(one for one in told if one)


def test_a_given_rotor_inertia_is_used_and_a_missing_one_is_estimated() -> None:
    robot, note = with_rotors(arm("xarm7"), [0.3, 0.3, 0.0, 0.2, 0.1, 0.1, 0.1])
    assert [joint.rotor_inertia for joint in robot.joints][:2] == [0.3, 0.3]
    assert 0.01 < robot.joints[2].rotor_inertia < 1.0
    assert note is not None
    assert "rotor inertia of joint3 is not given" in note


def test_a_campaign_estimates_rotors_too_and_reports_it() -> None:
    given = load_configuration("default", robot=arm("xarm7"))
    plan = Plan(PlanFile(collisions=1, free_moves=20), given, Path("plan.toml"))
    assert all(joint.rotor_inertia > 0 for joint in plan.configuration.robot.joints)
    assert plan.assumed[0].startswith("rotor inertia is not given: estimated")
    assert plan.configuration.crc() == given.crc()  # the firmware's table has no rotors


def test_a_scenario_gives_rotors_by_their_own_inertia_and_gear(tmp_path: Path) -> None:
    path = tmp_path / "geared.toml"
    text = '[[phase]]\ntask = "none"\ndo = [{ wait_s = 0.1 }]\n[plant]\n'
    path.write_text(
        text + "rotor_kg_m2 = [1e-4, 1e-4, 5e-5, 5e-5, 2e-5, 1e-5, 1e-5]\n" + f"gear_ratio = {[100.0] * 7}\n"
    )
    rotors = [joint.rotor_inertia for joint in load_scenario(path).robot.joints]
    assert rotors == pytest.approx([1.0, 1.0, 0.5, 0.5, 0.2, 0.1, 0.1])
    path.write_text(text.split("gear")[0] + "rotor_inertia_kg_m2 = [1.0]\n")
    with pytest.raises(InputError, match="plant: 1 values of rotor inertia for 7 joints"):
        load_scenario(path)


def test_an_arm_stays_within_the_range_of_the_wire() -> None:
    wire = load_configuration("default", robot="ku_dex").wire
    robot = within_wire(arm("j2s6s200"), wire)
    for joint in robot.joints:
        assert -4.09 < joint.position_min < joint.position_max < 4.09


@pytest.mark.parametrize(("key", "value"), [("start_rad", 4.2), ("point.A.joints_rad", -3.2)])
def test_an_impossible_posture_gives_one_line(tmp_path: Path, key: str, value: float) -> None:
    posture = f"{key.split('.')[-1]} = {[0.0, 0.0, value, 0.0, 0.0, 0.0, 0.0]}\n"
    table = "" if key == "start_rad" else "[point.A]\n"
    path = tmp_path / "far.toml"
    path.write_text(table + posture + '[[phase]]\ntask = "none"\ndo = [{ wait_s = 0.1 }]\n')
    with pytest.raises(InputError, match=rf"far\.toml: {key}\.2: .* is outside the range of joint3"):
        load_scenario(path)
