"""An installation as a TOML file over a preset, for commands that find settings."""

import json
from collections.abc import Mapping
from typing import Any

from tauperp.config.configuration import Configuration
from tauperp.config.load import load_configuration
from tauperp.config.settings import Task


def changes(configuration: Configuration, preset: str) -> dict[str, Any]:
    """Tables of the keys that differ from the preset's, without the robot; rows of tasks and the wire are complete.

    The file of `robot`, `preset` and these tables is the same installation.
    """
    own = configuration.settings.model_dump(exclude_none=True, exclude={"robot", "preset"})
    base = load_configuration(preset, robot=configuration.robot).settings.model_dump(exclude_none=True)
    different = {"wire": own["wire"], **_different(own, base)}
    plain = {key: field.default for key, field in Task.model_fields.items() if not field.is_required()}
    for name, row in own["task"].items():
        if name == "more" or row["index"] == "off":
            continue
        below = base["task"][name]
        limits = _different(row["limits"], below["limits"])
        whole = {
            key: value
            for key, value in row.items()
            if key != "limits" and not (key in plain and value == plain[key] == below[key])
        }
        different.setdefault("task", {})[name] = {**whole, **({"limits": limits} if limits else {})}
    return different


def _different(own: Mapping[str, Any], base: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in own.items():
        below = base.get(key)
        if isinstance(value, Mapping) and isinstance(below, Mapping):
            if inner := _different(value, below):
                found[key] = inner
        elif value != below:
            found[key] = value
    return found


def toml_lines(tables: Mapping[str, Any], place: str = "") -> list[str]:
    """Nested tables as TOML: the plain keys of each first, then its tables, each after an empty line."""
    lines = [f"{key} = {_value(value)}" for key, value in tables.items() if not _is_table(value)]
    if lines and place:
        lines = ["", f"[{place}]", *lines]
    for key, value in tables.items():
        path = f"{place}.{key}".strip(".")
        if isinstance(value, Mapping):
            lines += toml_lines(value, path)
        elif _is_table(value):
            for row in value:
                inner = toml_lines(row, path)
                lines += ["", f"[[{path}]]", *inner[2:]]
    return lines


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping) or (isinstance(value, list) and bool(value) and isinstance(value[0], Mapping))


def _value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(one) for one in value) + "]"
    return f"{value:.10g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)
