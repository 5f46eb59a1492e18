"""Writes docs/scenario.md from the tables that check a scenario file: `python -m tauperp.run.describe > FILE`."""

import math
import typing
from typing import Any, Literal

import annotated_types
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from tauperp.run.tables import ScenarioTable
from tauperp.toml import kind_of, tables

HEAD = """# Scenario files

A scenario states the robot, its tasks and motion, contacts, and sensor faults. `tauperp run FILE.toml` simulates it
with the compiled firmware as guard. The names of the keys contain the units. A key that is not listed here is an error.
If the key belongs to another table, the message names that table.

`python -m tauperp.run.describe` writes this page from the models that check the files.

Five examples come with the package and run by name:

| example | shows |
|---|---|
| `tauperp run payload` | payloads that the guard does not know, and strikes |
| `tauperp run contact` | guiding by hand, with strikes meanwhile |
| `tauperp run faults` | sensor faults: offset, stuck reading, status |
| `tauperp run wire` | missing and broken frames |
| `tauperp run own_arm` | a template for your own arm: robot, rotors, points, one strike |
"""


def markdown() -> str:
    """The page as Markdown."""
    parts = [HEAD]
    for heading, table in tables(ScenarioTable):
        parts.append(f"\n## {heading or 'Top of the file'}\n\n{' '.join((table.__doc__ or '').split())}\n")
        parts.append("\n| key | value | default | meaning |\n|---|---|---|---|\n")
        parts += [_row(name, field) for name, field in table.model_fields.items()]
    return "".join(parts)


def _row(name: str, field: FieldInfo) -> str:
    default = "needed" if field.is_required() else _default(field.get_default(call_default_factory=True))
    meaning = " ".join((field.description or "").split())
    return f"| `{name}` | {_value(field)} | {default} | {meaning} |\n"


def _value(field: FieldInfo) -> str:
    kind, below = kind_of(field.annotation)
    if below is not None:
        return {"list": "tables", "dict": "tables by name"}.get(kind, "a table")
    words = _words(field.annotation)
    limits = [_limit(one) for one in field.metadata]
    return ", ".join([words, *(one for one in limits if one)])


def _words(annotation: Any) -> str:
    names = {float: "number", int: "whole number", str: "text", bool: "true or false"}
    if annotation in names:
        return names[annotation]
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Literal:
        return " or ".join(f"`{one}`" for one in arguments)
    if origin is typing.Annotated:
        limits = [one for one in map(_limit, _flat(arguments[1:])) if one]
        return ", ".join([_words(arguments[0]), *limits])
    if origin is list:
        return f"list of: {_words(arguments[0])}"
    if origin is tuple:
        return f"{len(arguments)} numbers"
    if origin is dict:
        return "a table"
    return " or ".join(_words(one) for one in arguments if one is not type(None))


def _flat(metadata: tuple[Any, ...]) -> list[Any]:
    return [inner for one in metadata for inner in (one.metadata if isinstance(one, FieldInfo) else [one])]


def _limit(one: Any) -> str:
    said = {annotated_types.Gt: "above {}", annotated_types.Ge: "from {}", annotated_types.Lt: "below {}",
            annotated_types.Le: "to {}"}  # fmt: skip
    for kind, words in said.items():
        if isinstance(one, kind):
            return words.format(f"{getattr(one, kind.__name__.lower()):g}")
    return ""


def _default(value: Any) -> str:
    if value is None or value in ({}, [], "") or isinstance(value, BaseModel):
        return "-"
    if isinstance(value, tuple):
        return f"`{list(value)}`"
    return "the end" if value == math.inf else f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


if __name__ == "__main__":
    print(markdown(), end="")
