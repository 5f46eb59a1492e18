"""TOML files from users, checked against a pydantic model. An error is one line with the place of the mistake."""

import difflib
import tomllib
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from tauperp.errors import InputError


class Table(BaseModel):
    """One table of such a file. Unknown keys, NaN and numbers in quotes are errors. The values are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


ModelT = TypeVar("ModelT", bound=BaseModel)


def read_toml(path: str | Path) -> dict[str, Any]:
    """The content of the file as nested dicts. Raises InputError if it is missing, not text, or not TOML."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file in UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not TOML: {error}") from error


def validate(model: type[ModelT], data: dict[str, Any], source: str | Path) -> ModelT:
    """`data` as a `model`. Raises InputError with `source`, the dotted place of the first mistake, and the mistake."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{source}: {_first_mistake(model, error)}") from error


def _first_mistake(model: type[BaseModel], error: ValidationError) -> str:
    mistakes = error.errors()
    first = mistakes[0]
    place = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        message = "unknown key" + _suggestion(model, first["loc"])
    elif first["type"] in ("model_type", "dict_type"):
        message = "should be a table"
    elif first["type"] == "missing":
        message = "is missing"
    elif first["type"] == "value_error":
        message = str(first["ctx"]["error"])
    else:
        message = first["msg"].removeprefix("Input ")
        if isinstance(first["input"], int | float | str):
            message += f", not {first['input']!r}"
    more = f" (and {len(mistakes) - 1} more)" if len(mistakes) > 1 else ""
    return (f"{place}: " if place else "") + message + more


def _suggestion(model: type[BaseModel], place: tuple[int | str, ...]) -> str:
    """The table to which an unknown key belongs; else the most similar known key, if one is close."""
    table: type[BaseModel] | None = model
    for part in place[:-1]:
        if table is None:
            return ""
        if isinstance(part, str) and part in table.model_fields:
            table = _table_of(table.model_fields[part].annotation)
    key = str(place[-1])
    elsewhere = [heading or "the top of the file" for heading, one in tables(model) if key in one.model_fields]
    if elsewhere:
        return f" (it belongs to {' or '.join(dict.fromkeys(elsewhere))})"
    close = difflib.get_close_matches(key, table.model_fields if table else (), n=1)
    return f" (did you mean '{close[0]}'?)" if close else ""


def _table_of(annotation: Any) -> type[BaseModel] | None:
    """The table inside an annotation such as `Task | None`, `list[Task]` or `dict[str, Task]`."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    found = (_table_of(argument) for argument in typing.get_args(annotation))
    return next((table for table in found if table is not None), None)


def tables(model: type[BaseModel], place: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    """Every table of a model with its TOML heading. The model itself comes first, without a heading."""
    yield place, model
    for name, field in model.model_fields.items():
        kind, below = kind_of(field.annotation)
        if below is not None:
            path = f"{place.strip('[]')}.{name}".strip(".")
            yield from tables(below, {"list": f"[[{path}]]", "dict": f"[{path}.NAME]"}.get(kind, f"[{path}]"))


def kind_of(annotation: Any) -> tuple[str, type[BaseModel] | None]:
    """Whether an annotation holds a table: directly, in a list, or in a dict."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return "", annotation if issubclass(annotation, BaseModel) else None
    origin = typing.get_origin(annotation)
    kind = origin.__name__ if origin in (list, dict) else ""
    for argument in typing.get_args(annotation):
        inner, below = kind_of(argument)
        if below is not None:
            return kind or inner, below
    return "", None
