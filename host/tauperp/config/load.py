"""From a TOML file or a shipped preset to a checked Configuration."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tauperp.config.configuration import Configuration
from tauperp.config.indexes import is_blind
from tauperp.config.settings import TASKS, RobotChoice, Settings
from tauperp.errors import InputError
from tauperp.toml import read_toml, validate
from tauperp.wire import Wire

if TYPE_CHECKING:
    from tauperp.robot import Robot

_PRESETS = Path(__file__).resolve().parents[1] / "presets"


def preset_names() -> list[str]:
    """The shipped presets, sorted."""
    return sorted(path.stem for path in _PRESETS.glob("*.toml"))


def load_configuration(
    source: str | Path = "default",
    *,
    robot: "str | Path | Robot | None" = None,
    overrides: Mapping[str, Any] | None = None,
    chain: Mapping[str, Any] | None = None,
) -> Configuration:
    """Read, complete and check one installation's configuration.

    source      a shipped preset's name or the path of a TOML file (see tauperp.config.settings)
    robot       instead of the file's: a shipped name, the path of a URDF or MJCF file, or a Robot
    overrides   nested tables over both the file and its preset, e.g. {"wire": {"rate_hz": 200}}
    chain       base, tip, tool and accept_inertia of the robot, as of tauperp.robot.load; replaces the file's

    On an arm with too few joints for d_e (6) or d_p (5) to detect anything, a preset's task with that index is off; a
    user's file with such a task is refused. Raises InputError: one line with the file and the key.
    """
    is_preset = str(source) in preset_names()
    path = _PRESETS / f"{source}.toml" if is_preset else Path(source)
    name = str(source) if is_preset else os.fspath(path)
    own = read_toml(path)
    if overrides:
        own = _merged(own, overrides)
    settings = validate(Settings, _fitting(own, _with_sensors(_completed(own, name, is_preset))), name)

    arm = _robot(settings.robot, robot, path.parent, name, chain or {})
    for task in TASKS:
        chosen = settings.task[task]
        asked_for = not is_preset and "index" in own.get("task", {}).get(task, {})
        if is_blind(chosen.index, arm.n, chosen.components) and not asked_for:
            off = settings.task.model_copy(update={task: chosen.model_copy(update={"index": "off", "fast": []})})
            settings = settings.model_copy(update={"task": off})
    return Configuration(settings, arm, Wire.read(), name)


def _completed(own: Mapping[str, Any], name: str, is_preset: bool) -> dict[str, Any]:
    """The file's tables over those of its preset, and so on down to one that names none."""
    if is_preset and "preset" not in own:
        return dict(own)
    preset = own.get("preset", "default")
    if preset not in preset_names():
        known = ", ".join(preset_names())
        raise InputError(f"{name}: preset: there is no preset {preset!r} (there are {known})")
    return _merged(_completed(read_toml(_PRESETS / f"{preset}.toml"), preset, True), own)


def _with_sensors(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables, with the thresholds of their sensor preset where they contain none."""
    sensor = tables.get("sensor")
    path = _PRESETS / "sensors" / f"{sensor.get('preset') if isinstance(sensor, Mapping) else None}.toml"
    return _merged(read_toml(path), tables) if path.is_file() else tables


def _fitting(own: Mapping[str, Any], tables: dict[str, Any]) -> dict[str, Any]:
    """The tables. A task whose index the file chooses keeps only the fast components that it explains.

    If that would leave no slow component, it keeps none.
    """
    chosen = own.get("task")
    rows = {name: chosen.get(name) for name in TASKS} if isinstance(chosen, Mapping) else {}
    for name, row in rows.items():
        if isinstance(row, Mapping) and "index" in row and "fast" not in row and row["index"] != "d_e":
            components = row.get("components", [])
            kept = [part for part in tables["task"][name].get("fast", []) if part in components]
            tables = _merged(tables, {"task": {name: {"fast": kept if len(kept) < len(components) else []}}})
    return tables


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables, merged key by key; a value that is not a table is replaced."""
    merged = dict(below)
    for key, value in above.items():
        if isinstance(value, Mapping) and isinstance(merged.get(key), Mapping):
            merged[key] = _merged(merged[key], value)
        else:
            merged[key] = value
    return merged


def _robot(
    choice: RobotChoice | None,
    given: "str | Path | Robot | None",
    folder: Path,
    name: str,
    chain: Mapping[str, Any],
) -> "Robot":
    from tauperp import robot as robots  # imported here because `tauperp.robot` may import configurations

    if isinstance(given, robots.Robot):
        if chain:
            raise InputError(f"{name}: {', '.join(chain)} applies to a robot's name or file, not to a Robot object")
        return given
    if given is not None:
        return robots.load(given, **chain)
    if choice is None:
        raise InputError(f"{name}: robot: no robot is named; give a shipped name or the path of a URDF or MJCF file")
    beside = folder / choice.model
    model = beside if beside.suffix or beside.is_file() else choice.model
    own = {"base": choice.base, "tip": choice.tip, "tool": choice.tool, "accept_inertia": choice.accept_inertia}
    return robots.load(model, **{**own, **chain})
