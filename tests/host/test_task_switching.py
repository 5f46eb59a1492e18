"""The task changes on the bus at any time, with payloads picked up and put down: no gap, no false stop."""

import random
from dataclasses import replace
from pathlib import Path

import pytest

from tauperp.experiment import run_scenario
from tauperp.run.scenario import Scenario, load_scenario

HEAD = """
robot = "ku_dex"
config = "default"
[sensors]
torque_noise_nm = 0.05
[point.P1]
offset_m = [0.0, 0.0, 0.0]
[point.P2]
offset_m = [0.0, 0.25, 0.15]
"""


def scenario(folder: Path, phases: list[str], seed: int) -> Scenario:
    path = folder / "switching.toml"
    path.write_text(HEAD + "\n".join(phases))
    return replace(load_scenario(path), seed=seed)


def phase(number: int, task: str, mass_kg: float, point: str, extra: str = "") -> str:
    payload = f"payload = {{ mass_kg = {mass_kg:.2f}, com_m = [0.0, 0.03, 0.05] }}\n" if mass_kg else ""
    stay = f'{{ move = "{point}" }}' if task != "contact" else "{ wait_s = 0.3 }"
    return (
        f'[[phase]]\nname = "{number}: {task}"\ntask = "{task}"\n{payload}do = [{{ wait_s = 0.15 }}, {stay}]\n{extra}'
    )


@pytest.mark.parametrize("seed", [4, 11])
def test_picking_up_switching_and_putting_down_stops_nothing(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    phases = []
    put_down_kg = 0.0  # the heaviest payload put down
    for number in range(8):
        if number % 4 == 0:
            mass_kg = round(rng.uniform(0.5, 3.0), 2)
            put_down_kg = max(put_down_kg, mass_kg)
        task = ("none", "payload", "contact", "payload")[number % 4]
        phases.append(phase(number, task, 0.0 if task == "none" else mass_kg, rng.choice(["P1", "P2"])))
    result = run_scenario(scenario(tmp_path, phases, seed)).report
    assert result["stops"] == []
    assert result["peak_residual_free_nm"] > 2.0  # r shows the payload
    # A load put down in the cycle in which its task ends leaves an index of about 0.25 Nm per kg.
    assert result["peak_index_free_nm"] < 0.1 + 0.3 * put_down_kg
    assert result["finished"]


def test_a_collision_right_after_a_switch_is_found(tmp_path: Path) -> None:
    strike = (
        "[[phase.strike]]\nafter_s = 0.02\nlink = 4\ndirection = [-1.0, 0.0, 0.0]\n"
        'part = "forearm"\npush_n = 120.0\nstep = 1\n'
    )
    phases = [phase(0, "payload", 2.0, "P2"), phase(1, "none", 0.0, "P1", strike)]
    result = run_scenario(scenario(tmp_path, phases, 5)).report
    assert result["false_stops"] == 0
    assert [collision["detected"] for collision in result["collisions"]] == [True]
