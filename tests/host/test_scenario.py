"""Scenario files: each mistake of a new user gives one line with the file, the place and the expected value."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from tauperp.cli import main
from tauperp.errors import InputError
from tauperp.experiment import run_scenario
from tauperp.files import repository_root
from tauperp.run import tables as scenario_tables
from tauperp.run.describe import markdown
from tauperp.run.scenario import Scenario, load_scenario, shipped
from tauperp.run.tables import ScenarioTable
from tauperp.sim.arm import Payload
from tauperp.sim.contact import Strike
from tauperp.sim.control import ImpedanceGains
from tauperp.sim.guiding import GuidingForce
from tauperp.sim.motion import Recovery
from tauperp.sim.sensors import SensorFault, SensorModel
from tauperp.sim.trajectory import Limits
from tauperp.toml import tables

DEFINED_ONCE = [
    (scenario_tables.PayloadTable, Payload),
    (scenario_tables.StrikeTable, Strike),
    (scenario_tables.GuideTable, GuidingForce),
    (scenario_tables.SensorTable, SensorModel),
    (scenario_tables.FaultTable, SensorFault),
    (scenario_tables.LimitTable, Limits),
    (scenario_tables.ImpedanceTable, ImpedanceGains),
    (scenario_tables.RecoveryTable, Recovery),
]
GOOD = """
robot = "ku_dex"
config = "paper"
[point.A]
offset_m = [0.0, 0.1, 0.0]
[[phase]]
task = "payload"
payload = { mass_kg = 1.5 }
do = [{ wait_s = 0.1 }, { move = "A" }]
[[phase.strike]]
step = 2
link = 4
direction = [0.0, 1.0, 0.0]
"""

MISTAKES = {
    "an unknown key": ('config = "paper"', 'config = "paper"\nsped = 3', "sped: unknown key (did you mean 'seed'?)"),
    "a key of another table": ('config = "paper"', 'config = "paper"\npush_n = 3', "(it belongs to [[phase.strike]])"),
    "a key of the top": ("link = 4", "link = 4\nseed = 3", "phase.0.strike.0.seed: unknown key (it belongs to the top"),
    "an unknown key deep down": ("link = 4", "link = 4\nforce = 3", "phase.0.strike.0.force: unknown key"),
    "a negative mass": ("mass_kg = 1.5", "mass_kg = -1", "phase.0.payload.mass_kg: should be greater than 0, not -1"),
    "a number in quotes": ("mass_kg = 1.5", 'mass_kg = "1"', "phase.0.payload.mass_kg: should be a valid number"),
    "an unknown point": ('move = "A"', 'move = "B"', "phase.0.do.1.move: there is no point 'B' (there are A)"),
    "two things at once": ('move = "A"', 'move = "A", wait_s = 1.0', "phase.0.do.1: must have exactly one of"),
    "an unknown link": ("link = 4", "link = 8", "phase.0.strike.0.link: ku_dex has 7 links, not 8"),
    "an unknown step": ("step = 2", "step = 3", "phase.0.strike.0.step: the phase has 2 steps, not 3"),
    "a direction without length": (
        "[0.0, 1.0, 0.0]",
        "[0.0, 0.0, 0.0]",
        "phase.0.strike.0.direction: must have a length",
    ),
    "an unknown task": ('task = "payload"', 'task = "lift"', "phase.0.task: should be 'none', 'payload' or"),
    "an unknown robot": ('robot = "ku_dex"', 'robot = "r2d2"', "r2d2"),
    "an unknown preset": ('config = "paper"', 'config = "papr"', "papr"),
    "an unknown key of the guard": ('config = "paper"', 'config = "paper"\nguard = { tsk = 1 }', "tsk: unknown key"),
    "a point in two ways": ("offset_m =", "joints_rad = [0.0]\noffset_m =", "point.A: must have either offset_m or"),
    "too few joints": ("offset_m = [0.0, 0.1, 0.0]", "joints_rad = [0.0]", "point.A.joints_rad: 1 values for 7 joints"),
    "no phase": (GOOD, 'robot = "ku_dex"', "phase: is missing"),
    "not TOML": ('robot = "ku_dex"', "robot = ku_dex", "not TOML"),
}


def written(folder: Path, text: str) -> Path:
    path = folder / "cell.toml"
    path.write_text(text)
    return path


def test_a_good_file_gives_its_values(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, GOOD))
    (phase,) = scenario.phases
    assert phase.payload is not None
    assert (phase.task, phase.payload.mass_kg) == (2, 1.5)
    ((step, after_s, strike),) = phase.strikes
    assert (step, after_s, strike.link) == (1, 0.0, 4)
    assert scenario.configuration.settings.observer.gain_per_s == 50.0


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_gives_one_line_with_its_place(
    tmp_path: Path, mistake: str, capsys: pytest.CaptureFixture[str]
) -> None:
    good, bad, message = MISTAKES[mistake]
    assert good in GOOD
    path = written(tmp_path, GOOD.replace(good, bad))
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    assert message in str(caught.value)
    assert main(["run", str(path), "--record", str(tmp_path / "bus.log")]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1
    assert [one.name for one in tmp_path.iterdir()] == ["cell.toml"]


def test_a_missing_file_gives_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        load_scenario(tmp_path / "none.toml")


def test_the_shipped_scenarios_are_valid_for_every_shipped_arm() -> None:
    for name in ("payload", "contact"):
        for robot in ("ku_dex", "panda", "iiwa7", "kinova3"):
            assert isinstance(load_scenario(shipped(name), robot=robot), Scenario)
    with pytest.raises(InputError, match="there are contact, faults, own_arm, payload, wire"):
        shipped("juggling")


@pytest.mark.parametrize("name", ["faults", "wire", "own_arm"])
def test_an_example_runs_and_tests_what_it_claims(name: str) -> None:
    report = run_scenario(load_scenario(shipped(name), rate_hz=500)).report
    assert report["verdict"] == "passed", report["why"]
    assert [one["verdict"] for one in report["faults"]] == {
        "faults": ["no stop", "stopped", "stopped"], "wire": ["stopped", "stopped"], "own_arm": []}[name]  # fmt: skip


def test_the_page_of_scenario_files_agrees_with_the_models() -> None:
    page = (repository_root() / "docs" / "scenario.md").read_text()
    assert page == markdown(), "python -m tauperp.run.describe > docs/scenario.md"
    for _, table in tables(ScenarioTable):
        for key, field in table.model_fields.items():
            assert field.description, key


def test_the_callers_values_take_precedence() -> None:
    scenario = load_scenario(shipped("payload"), seed=3, rate_hz=500, mass_kg=3.0)
    assert scenario.seed == 3
    settings = scenario.configuration.settings
    assert (settings.wire.rate_hz, settings.wire.format) == (500, "classic")
    masses = [0.0 if phase.payload is None else phase.payload.mass_kg for phase in scenario.phases]
    assert masses == [0.0, 1.5, 3.0]


def test_a_configuration_beside_the_scenario_is_found(tmp_path: Path) -> None:
    (tmp_path / "guard.toml").write_text('preset = "paper"\n[task.payload]\nindex = "d_p"\nthreshold_nm = 1.25\n')
    scenario = load_scenario(written(tmp_path, GOOD.replace('"paper"', '"guard.toml"')))
    assert np.allclose(scenario.configuration.threshold_nm("payload"), 1.25)


def test_a_task_that_is_off_for_this_arm_is_refused(tmp_path: Path) -> None:
    text = GOOD + '[guard.task.payload]\nindex = "off"\n'
    with pytest.raises(InputError, match=r"phase\.0\.task: 'payload' is off"):
        load_scenario(written(tmp_path, text))


@pytest.mark.parametrize(("table", "simulated"), DEFINED_ONCE, ids=lambda kind: kind.__name__)
def test_a_table_has_every_key_and_default_of_the_simulation(table: type[BaseModel], simulated: type[Any]) -> None:
    renamed = {"start_s": "after_s"} if simulated is GuidingForce else {}
    own = {"limits"} if simulated is Recovery else set()  # of the retreat: not a key of a scenario
    for field in dataclasses.fields(simulated):
        if field.name not in own:
            key = table.model_fields[renamed.get(field.name, field.name)]
            assert key.is_required() == (field.default is dataclasses.MISSING)
            assert key.is_required() or key.default == field.default
