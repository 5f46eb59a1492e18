"""The command line for a user: help, one-line errors, exit codes."""

import argparse
import os
import subprocess
import sys
import types
from collections.abc import Callable
from pathlib import Path

import pytest

import tauperp.commands
from tauperp import cli
from tauperp.errors import InputError

COMMANDS_FOLDER = Path(tauperp.commands.__file__).parent


def run(
    *arguments: str, code: str = "import sys; from tauperp import cli; sys.exit(cli.main())"
) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=60)


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> types.SimpleNamespace:
    """A subcommand `ghost` whose behaviour the test sets."""
    ghost = types.SimpleNamespace(HELP="a command", add_arguments=lambda parser: None, run=lambda args: 0)
    monkeypatch.setitem(cli.COMMANDS, "ghost", "a command")
    monkeypatch.setitem(sys.modules, "tauperp.commands.ghost", ghost)
    return ghost


def raising(error: BaseException) -> Callable[[argparse.Namespace], int]:
    def run(args: argparse.Namespace) -> int:
        raise error

    return run


def test_every_command_is_a_module_and_every_module_a_command() -> None:
    modules = {path.stem for path in COMMANDS_FOLDER.glob("[!_]*.py")}
    assert modules == set(cli.COMMANDS)


@pytest.mark.parametrize("name", [None, *cli.COMMANDS])
def test_help_fits_eighty_columns(name: str | None, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([*([name] if name else []), "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines
    assert [line for line in lines if len(line) > 80] == []


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    cli.main(["--help"])
    words = capsys.readouterr().out.split()
    assert [name for name in cli.COMMANDS if name not in words] == []


def test_help_imports_no_heavy_package() -> None:
    heavy = "{'numpy', 'mujoco', 'matplotlib', 'pydantic', 'can', 'cantools'}"
    result = run(
        code=f"import sys; from tauperp import cli; cli.main(['--help']); sys.exit(str({heavy} & set(sys.modules)))"
    )
    assert result.stderr.strip() == "set()"


def test_the_verdict_of_a_command_is_the_exit_code(command: types.SimpleNamespace) -> None:
    command.run = lambda args: 1
    assert cli.main(["ghost"]) == 1


def test_bad_input_gives_one_line_and_exit_code_2(
    command: types.SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    command.run = raising(InputError("arm.urdf: joint 'slide' is prismatic\n  and more"))
    assert cli.main(["ghost"]) == 2
    assert capsys.readouterr().err == "tauperp: arm.urdf: joint 'slide' is prismatic and more\n"


def test_a_file_that_cannot_be_opened_gives_one_line_with_its_name(
    command: types.SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    command.run = lambda args: len(Path("no-such-file").read_text())
    assert cli.main(["ghost"]) == 2
    assert capsys.readouterr().err == "tauperp: no-such-file: No such file or directory\n"


@pytest.mark.parametrize("arguments", [[], ["nonsense"], ["config"], ["config", "x", "--no-such-option"]])
def test_a_wrong_command_line_gives_one_line_and_exit_code_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1
    assert captured.err.startswith("tauperp: ")


def test_an_abbreviated_option_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["config", "default", "--js"]) == 2
    assert "--js" in capsys.readouterr().err


def test_a_missing_package_is_named_and_affects_only_its_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(cli.COMMANDS, "ghost", "a command")

    def import_module(name: str) -> types.ModuleType:
        raise ModuleNotFoundError("No module named 'mujoco'", name="mujoco")

    monkeypatch.setattr(cli.importlib, "import_module", import_module)
    assert cli.main(["ghost"]) == 2
    assert "'ghost' needs the Python package 'mujoco'" in capsys.readouterr().err
    assert cli.main(["--help"]) == 0


def test_a_missing_module_of_our_own_is_a_defect_and_not_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(cli.COMMANDS, "ghost", "a command")
    with pytest.raises(ModuleNotFoundError):
        cli.main(["ghost"])


def test_an_interrupt_ends_without_a_message(
    command: types.SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    command.run = raising(KeyboardInterrupt())
    assert cli.main(["ghost"]) == 130
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("arguments", [["--help"], ["config", "--help"]])
def test_a_closed_pipe_ends_without_a_message(arguments: list[str]) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "tauperp.cli", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": ""},  # with PYTHONUNBUFFERED argparse gets the error and ignores it
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 141
