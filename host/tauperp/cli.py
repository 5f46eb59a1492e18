"""The command `tauperp`. It finds the subcommand, and turns a user's error into one line and exit code 2.

A subcommand is a module of `tauperp.commands` with

    HELP: str                                                description on its help page
    add_arguments(parser: argparse.ArgumentParser) -> None
    run(args: argparse.Namespace) -> int                     exit code: 0 good result, 1 bad result, 2 bad input

Only the module of the chosen subcommand is imported. `tauperp --help` is therefore fast, and a missing package matters
only to the command that needs it.
"""

import argparse
import importlib
import os
import sys
from collections.abc import Callable, Sequence
from typing import NoReturn

from tauperp import __version__
from tauperp.errors import InputError

COMMANDS = {
    "robot": "make the firmware's robot table from a URDF or MJCF file",
    "config": "make the guard's configuration block from a TOML file",
    "version": "print the firmware, build and configuration of an image",
    "experiment": "simulate one of the paper's two experiments",
    "demo": "simulate both experiments of the paper",
    "run": "simulate any scenario with the firmware as guard",
    "replay": "send a bus log to the firmware, and compare its answers",
    "score": "send recordings of a real arm to the firmware, and score it",
    "calibrate": "compute thresholds, offsets and friction from recordings",
    "campaign": "simulate thousands of collisions, and count the detected ones",
    "sensitivity": "compute the smallest force that the guard detects",
    "guard": "run the guard on a CAN bus",
    "monitor": "show the guard and the robot on a bus, live",
}

BAD_INPUT = 2
INTERRUPTED = 130  # 128 + SIGINT, as a shell reports it
MISSES_READER = 141  # 128 + SIGPIPE
HELP_COLUMNS = 80
LONGEST_CHOICES = 40
# Which extra of the package brings a module that not every installation has.
EXTRAS = {
    "dask": "campaign",
    "distributed": "campaign",
    "pyarrow": "campaign",
    "mcap": "logs",
    "mcap_ros2": "logs",
    "glfw": "view",
    "OpenGL": "view",
    "rerun": "rerun",
}


class _Formatter(argparse.HelpFormatter):
    """Help with a fixed width of 80 columns, so that it is the same everywhere."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=26, width=HELP_COLUMNS)

    def _metavar_formatter(self, action: argparse.Action, default_metavar: str) -> Callable[[int], tuple[str, ...]]:
        """The option's name instead of a long list of choices, such as python-can's interfaces."""
        if action.metavar is None and action.choices and len(",".join(map(str, action.choices))) > LONGEST_CHOICES:
            return lambda size: (default_metavar,) * size
        return super()._metavar_formatter(action, default_metavar)


class _CommandsFormatter(_Formatter):
    """Help of the whole program. argparse does not count the indent of the subcommands' names."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog)
        self._action_max_length = max(map(len, COMMANDS)) + 2 * self._indent_increment


class _Parser(argparse.ArgumentParser):
    """argparse with one-line errors, as for every other bad input, and without abbreviated options."""

    def __init__(self, **options: object) -> None:
        chosen = {"formatter_class": _Formatter, **options}
        super().__init__(allow_abbrev=False, **chosen)  # type: ignore[arg-type]

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see '{self.prog} --help')")


def _parser(chosen: str | None) -> argparse.ArgumentParser:
    """The whole command line, with the arguments of the chosen subcommand only."""
    about = "Host tools of Tauperp, a collision guard for torque-sensing robot arms."
    parser = _Parser(prog="tauperp", description=about, formatter_class=_CommandsFormatter)
    parser.add_argument("--version", action="version", version=f"tauperp {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, summary in COMMANDS.items():
        if name != chosen:
            commands.add_parser(name, help=summary)
            continue
        module = importlib.import_module(f"tauperp.commands.{name}")
        command = commands.add_parser(name, help=summary, description=module.HELP)
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return parser


def command_help(name: str) -> str:
    """Help text of one subcommand, as `tauperp NAME --help` prints it."""
    parser = _parser(name)
    choices = next(action.choices for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return str(choices[name].format_help())


def _message(error: InputError | OSError) -> str:
    """The exception's message as one line."""
    text = str(error)
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return " ".join(text.split())


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command. `argv` without the program's name; the process' own arguments by default. Returns exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    chosen = next((argument for argument in arguments if argument in COMMANDS), None)
    try:
        code = _run(arguments, chosen)
        sys.stdout.flush()
        return code
    except BrokenPipeError:
        # The reader (`| head`) has closed the pipe. The interpreter flushes stdout at its end, so stdout gets a sink.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return MISSES_READER
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] == "tauperp":
            raise
        root = error.name.partition(".")[0]
        hint = f": pip install 'tauperp[{EXTRAS[root]}]'" if root in EXTRAS else ""
        print(
            f"tauperp: '{chosen}' needs the Python package '{error.name}', which is not installed{hint}",
            file=sys.stderr,
        )
        return BAD_INPUT
    except (InputError, OSError) as error:
        print(f"tauperp: {_message(error)}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED


def _run(arguments: list[str], chosen: str | None) -> int:
    try:
        args = _parser(chosen).parse_args(arguments)
    except SystemExit as done:  # --help and --version, which have printed what they had to
        return int(done.code or 0)
    code: int = args.run(args)
    return code


if __name__ == "__main__":
    sys.exit(main())
