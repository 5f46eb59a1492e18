"""`tauperp robot`, the C that it writes, and tools/robot2c that keeps the shipped tables current."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from robot_makers import random_robot, urdf_of

from tauperp import cli
from tauperp.files import repository_root
from tauperp.robot import check as check_module
from tauperp.robot import load, shipped
from tauperp.robot.descriptor import descriptor_text, read_descriptor
from tauperp.robot.emit import c_source, identifier
from tauperp.robot.table import make_table

ROOT = repository_root()


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_of(random_robot(77, 4)))
    return path


def test_the_command_prints_the_robot_and_its_checks(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["robot", str(arm)]) == 0
    text = capsys.readouterr().out
    for joint in load(arm).joints:
        assert joint.name in text
    assert text.count("agrees with Pinocchio") == 2
    assert "on arm.urdf on 100 states: momentum" in text


def test_json_holds_the_same_as_the_text(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--tool", "0", "0", "-0.1", "--base-rpy", "3.1415926", "0", "0", "--name", "My Arm"]
    assert cli.main(["robot", str(arm), "--json", *options]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["robot"] == "my_arm"
    assert summary["gravity_m_s2"] == pytest.approx([0.0, 0.0, 9.81], abs=1e-5)
    assert [joint["name"] for joint in summary["joints"]] == ["joint0", "joint1", "joint2", "joint3"]
    assert [check["good"] for check in summary["checks"]] == [True, True]


def test_the_c_source_is_the_same_every_time(arm: Path, tmp_path: Path) -> None:
    for name in ("one.c", "two.c"):
        assert cli.main(["robot", str(arm), "-o", str(tmp_path / name)]) == 0
    text = (tmp_path / "one.c").read_text()
    assert text == (tmp_path / "two.c").read_text() == c_source(load(arm))
    assert "const robot_t robot_made_up = {" in text


def test_nothing_is_written_when_the_readers_differ(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(check_module, "TOLERANCE", 1e-30)
    out = tmp_path / "table.c"
    assert cli.main(["robot", str(arm), "-o", str(out)]) == 1
    assert not out.exists()
    captured = capsys.readouterr()
    assert "DIFFERS" in captured.out
    assert captured.err == "tauperp: the readers differ: no table is written\n"


def test_bad_input_gives_one_line_and_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "table.c"
    assert cli.main(["robot", "gone.urdf", "-o", str(out)]) == 2
    assert not out.exists()
    error = capsys.readouterr().err
    assert error.startswith("tauperp: gone.urdf: no such file")
    assert error.count("\n") == 1
    assert cli.main(["robot", "panda", "--name", "+++"]) == 2
    assert "'+++' is not a name for a robot" in capsys.readouterr().err


@pytest.mark.parametrize("compiler", ["gcc", pytest.param("clang", marks=pytest.mark.needs("clang"))])
@pytest.mark.parametrize("n", [1, 8])
def test_the_c_source_compiles_without_a_warning_to_the_numbers(tmp_path: Path, compiler: str, n: int) -> None:
    robot = random_robot(12 + n, n)
    (tmp_path / "table.c").write_text(c_source(robot))
    fields = "moment_x", "inertia_zz", "sin_twist", "zero_rad"
    prints = "".join(f'printf("%.9g\\n", (double)robot_made_up.joint[i].{field});' for field in fields)
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "robot.h"\nextern const robot_t robot_made_up;\n'
        f"int main(void) {{ for (uint32_t i = 0; i < robot_made_up.joint_count; ++i) {{ {prints} }} }}\n"
    )
    warnings = ["-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror"]
    command = [compiler, "-std=c11", *warnings, f"-I{ROOT / 'firmware' / 'core'}", "-o", str(tmp_path / "main")]
    subprocess.run([*command, str(tmp_path / "table.c"), str(tmp_path / "main.c")], check=True)
    lines = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout.split()
    expected = [getattr(joint, field) for joint in make_table(robot).joint for field in fields]
    assert [float(line) for line in lines] == pytest.approx(expected, rel=1e-7, abs=1e-12)


def test_a_name_becomes_a_c_identifier() -> None:
    assert identifier("UR5e (left)") == "ur5e_left"
    assert identifier("7-axis arm") == "7_axis_arm"


@pytest.mark.parametrize("name", [name for name in shipped() if name != "ku_dex"])
def test_a_written_description_is_read_back_unchanged(name: str, tmp_path: Path) -> None:
    text = (ROOT / "host" / "tauperp" / "robot" / "models" / f"{name}.toml").read_text()
    (tmp_path / "again.toml").write_text(text)
    assert descriptor_text(read_descriptor(tmp_path / "again.toml")) == text


def robot2c(*options: str, root: Path = ROOT) -> "subprocess.CompletedProcess[str]":
    """The tool with the package in `root`; -S, because the editable installation would bring the checkout's."""
    command = [sys.executable, "-S", str(ROOT / "tools" / "robot2c"), *options]
    packages = [str(root / "host"), *(entry for entry in sys.path if "site-packages" in entry)]
    environment = {"PYTHONPATH": os.pathsep.join(packages), "PATH": "/usr/bin:/bin"}
    return subprocess.run(command, capture_output=True, text=True, env=environment)


def test_the_committed_tables_and_descriptions_are_current() -> None:
    result = robot2c("--check")
    assert result.returncode == 0, result.stderr


def test_a_changed_missing_or_stray_table_is_found(tmp_path: Path) -> None:
    """On a copy: the same tool with a package whose repository is elsewhere."""
    shutil.copytree(ROOT / "host" / "tauperp", tmp_path / "host" / "tauperp")
    shutil.copytree(ROOT / "tests" / "robots", tmp_path / "tests" / "robots")
    tables = tmp_path / "tests" / "robots"
    panda = tables / "robot_panda.c"
    panda.write_text(panda.read_text().replace("NUM(-9.81)", "NUM(-9.82)"))
    (tables / "robot_ku_dex.c").unlink()
    (tables / "robot_old.c").write_text("")
    result = robot2c("--check", root=tmp_path)
    assert result.returncode == 1
    for line in (
        "tests/robots/robot_panda.c is not current",
        "tests/robots/robot_ku_dex.c is not current",
        "tests/robots/robot_old.c belongs to no shipped robot",
    ):
        assert line in result.stderr
    assert "iiwa7.c" not in result.stderr
