"""Reference pages, each written from the source that it describes."""

import inspect
import re
import tomllib
import types
from typing import Any

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

import tauperp.config
import tauperp.firmware
import tauperp.robot_side
from tauperp.cli import COMMANDS, command_help
from tauperp.config.settings import Settings
from tauperp.files import repository_root
from tauperp.wire import Wire
from tauperp.wire_values import REASON_CLASS, Page

ROOT = repository_root()
REASONS = ROOT / "docs" / "reasons.toml"
CLASSES = {
    "WAITING": (
        "Waiting",
        "No permission yet; nothing is latched. The guard continues on its own, or waits for a reset.",
    ),
    "STOPPED": ("Stopped", "The permission ended and a trip is latched. It ends on an accepted GuardReset."),
    "BOARD": ("Bus and board", "As stopped, and it latches before the first permission as well."),
    "FAULT": ("Fault", "The guard failed a check of itself. It permits nothing until it is started again."),
}


def reason_names() -> dict[int, str]:
    """Names of StopCommand.Reason by number, from the DBC."""
    signal = Wire.read().message("StopCommand").definition.get_signal_by_name("Reason")
    return {int(number): str(name) for number, name in (signal.choices or {}).items()}


def reason_classes() -> dict[str, str]:
    """Class of each reason by its name in the DBC."""
    names = reason_names()
    return {names[number]: kind.name for number, kind in REASON_CLASS.items()}


def troubleshooting() -> str:
    """The page of reasons: their meaning, and what to check."""
    entries, classes = tomllib.loads(REASONS.read_text()), reason_classes()
    lines = [
        "# Troubleshooting",
        "",
        "The robot does not move, or it stopped. `tauperp monitor --interface socketcan --channel can0` shows state,",
        "reason and joint as the guard sends them. Find the reason here. The number is `StopCommand.Reason`.",
        "",
    ]
    for kind, (title, summary) in CLASSES.items():
        lines += [f"## {title}", "", summary, "", "| reason | meaning | what to check |", "|---|---|---|"]
        for number, name in reason_names().items():
            if classes.get(name) == kind and name in entries:
                lines.append(f"| **{name}** ({number}) | {entries[name]['means']} | {entries[name]['look']} |")
        lines.append("")
    return "\n".join([*lines, SYMPTOMS])


SYMPTOMS = """## Other symptoms

| symptom | what to check |
|---|---|
| `tauperp monitor` shows nothing | Is the interface up? Are the bit rates right? Does `candump can0` show frames? |
| many messages of unknown ids | another DBC, or another protocol on this bus |
| the guard permits, no motion follows | cycle, age and both copies, as the robot checks them ([rules](robot-side.md)) |
| false stops in fast motion | velocity noise, thresholds from slow motion ([calibrate](calibrate.md)) |
| false stops at reversals | friction between sensor and link: `sensor.friction_nm` ([calibrate](calibrate.md)) |
| contacts are detected late or not at all | thresholds, task, blind directions ([sensitivity](sensitivity.md)) |
| `the firmware's library is missing` | in a checkout `make library`; an installed package is damaged |
| `older than the sources` | in a checkout `make library library-fixed kernel` |
| a command needs a package that is not installed | the message names the extra: `pip install 'tauperp[logs]'` |
"""


def _bounds(field: FieldInfo) -> str:
    signs = {Ge: ">=", Gt: ">", Le: "<=", Lt: "<"}
    found = [
        f"{sign} {getattr(rule, kind.__name__.lower()):g}"
        for rule in field.metadata
        for kind, sign in signs.items()
        if isinstance(rule, kind)
    ]
    return ", ".join(found)


def _type_name(annotation: Any) -> str:
    text = str(annotation) if not isinstance(annotation, type) else annotation.__name__
    text = re.sub(r"typing\.|tauperp\.\S*\.", "", text)
    text = re.sub(r"Literal\[(.*?)\]", lambda match: match[1].replace(", ", " or "), text)
    text = re.sub(r"Annotated\[(\w+)(\[\w+\])?.*", r"\1\2", text)
    text = text.replace("| None", "").replace("|", "or").replace("list[Any]", "list").strip()
    return text + "]" * (text.count("[") - text.count("]"))


def _rows(model: type[BaseModel], preset: Any, place: str) -> list[str]:
    rows = []
    for name, field in model.model_fields.items():
        annotation, value = field.annotation, preset.get(name) if isinstance(preset, dict) else None
        kinds = [annotation, *getattr(annotation, "__args__", ())]
        tables = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)]
        key = f"{place}{name}"
        if tables:
            suffix = "[]." if getattr(annotation, "__origin__", None) is list else "."
            rows += _rows(tables[0], value if value is not None else {}, f"{key}{suffix}")
            continue
        if value is None and not field.is_required() and field.default is not None:
            value = field.default
        shown = "" if value is None or value == [] else f"`{value}`"
        rows.append(f"| `{key}` | {_type_name(annotation)} | {_bounds(field)} | {shown} |")
    return rows


def settings() -> str:
    """Every key of the configuration file with its type, bounds and default."""
    preset = tomllib.loads((ROOT / "host" / "tauperp" / "presets" / "default.toml").read_text())
    lines = [
        "# Configuration keys",
        "",
        "Every key that the file may have, from the code that reads it. [Configuration](../configuration.md) explains",
        "them. Defaults are those of the preset `default`. The firmware checks further bounds.",
        "",
        "| key | type | bounds | default |",
        "|---|---|---|---|",
        *_rows(Settings, preset, ""),
        "",
    ]
    return "\n".join(lines)


def commands() -> str:
    """The help of every subcommand, from its parser."""
    lines = [
        "# Command line",
        "",
        "Exit code 0: the verdict is good. 1: the verdict is bad. 2: the input is wrong; one line names the mistake.",
        "",
    ]
    lines += ["| command | does |", "|---|---|"]
    lines += [f"| [`tauperp {name}`](#tauperp-{name}) | {summary} |" for name, summary in COMMANDS.items()]
    for name in COMMANDS:
        lines += ["", f"## tauperp {name}", "", "```text", command_help(name).rstrip(), "```"]
    return "\n".join([*lines, ""])


def wire() -> str:
    """Messages and signals, from the DBC."""
    wire = Wire.read()
    lines = [
        "# Wire",
        "",
        f"From [tauperp.dbc](../../dbc/tauperp.dbc), version {wire.version}. Every frame has 8 bytes and carries",
        "AUTOSAR E2E profile 2: byte 0 is the CRC, the low nibble of byte 1 the counter. Signals are little-endian.",
        "",
        "| message | id | sent by | cycle time at 500 Hz | deadline | meaning |",
        "|---|---|---|---|---|---|",
    ]
    shown = [message for message in wire.messages.values() if not re.search(r"[2-9]$", message.definition.name)]
    for message in shown:
        definition = message.definition
        cycle = f"{definition.cycle_time} ms" if definition.cycle_time else "on request"
        cycles = message.timeout_cycles
        silence = f"{cycles} {'cycle' if cycles == 1 else 'cycles'}" if cycles else ""
        lines.append(
            f"| [{definition.name}](#{definition.name.lower()}) | 0x{definition.frame_id:03X} | "
            f"{', '.join(definition.senders)} | {cycle} | {silence} | {definition.comment or ''} |"
        )
    lines += [
        "",
        "JointState1 represents the joints 1 to 8 (ids 0x101 to 0x108); Residual1 and Index1 represent all joints too.",
    ]
    for message in shown:
        lines += ["", f"## {message.definition.name}", "", message.definition.comment or "", ""]
        lines += ["| signal | page | bits | factor, unit | range | meaning |", "|---|---|---|---|---|---|"]
        for signal in message.definition.signals:
            if re.search(r"[2-8]$", signal.name):
                continue
            named = message.definition.name == "GuardStatus"
            pages = [
                f"{page} {Page(page).name.title()}" if named else str(page) for page in signal.multiplexer_ids or []
            ]
            page = ", ".join(pages)
            values = ", ".join(f"{number} {name}" for number, name in (signal.choices or {}).items())
            meaning = " ".join(filter(None, [signal.comment, values and f"Values: {values}."]))
            unit = f"{signal.scale:g} {signal.unit or ''}".strip()
            lines.append(
                f"| {signal.name} | {page} | {signal.start} + {signal.length} | {unit} | "
                f"{signal.minimum:g} to {signal.maximum:g} | {meaning} |"
            )
    return "\n".join([*lines, ""])


def _member(name: str, value: Any) -> list[str]:
    function = value.fget if isinstance(value, property) else inspect.unwrap(getattr(value, "__func__", value))
    if not isinstance(function, types.FunctionType) or not function.__doc__:
        return []
    signature = (
        ""
        if isinstance(value, property)
        else str(inspect.signature(function)).replace("self, ", "").replace("(self)", "()")
    )
    return [f"**`{name}{signature}`**", "", "```text", inspect.cleandoc(function.__doc__), "```", ""]


def _documented(module: types.ModuleType, names: list[str]) -> list[str]:
    lines = [f"## {module.__name__}", "", "```text", inspect.cleandoc(module.__doc__ or ""), "```", ""]
    for name in names:
        value = getattr(module, name)
        if inspect.isclass(value):
            lines += [f"### {name}", "", "```text", inspect.cleandoc(value.__doc__ or ""), "```", ""]
            for member, inner in vars(value).items():
                lines += _member(member, inner) if not member.startswith("_") else []
        elif callable(value):
            lines += [f"### {name}", "", *_member(name, value)]
    return lines


def python() -> str:
    """Public classes and functions, from their docstrings."""
    side = [name for name in ("RobotSide", "StopCheck", "Permit", "Answer") if hasattr(tauperp.robot_side, name)]
    lines = ["# Python", "", "Arrays are numpy arrays of float64; n is the number of joints.", ""]
    lines += _documented(tauperp.firmware, list(tauperp.firmware.__all__))
    lines += _documented(tauperp.config, [name for name in tauperp.config.__all__ if not name.isupper()])
    lines += _documented(tauperp.robot_side, side)
    return "\n".join(lines)


def c() -> str:
    """The public headers, unchanged: each is its own manual."""
    lines = ["# C", "", "The headers are the manual. [Porting](../porting.md) explains how to build with them.", ""]
    for title, path in (
        ("The guard", "firmware/api/tauperp.h"),
        ("The robot's side", "firmware/robot_side/robot_side.h"),
        ("A complete program", "firmware/examples/minimal/minimal.c"),
    ):
        lines += [f"## {title}", "", f"`{path}`", "", "```c", (ROOT / path).read_text().rstrip(), "```", ""]
    return "\n".join(lines)
