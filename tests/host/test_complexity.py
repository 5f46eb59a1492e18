"""How complex a function of the firmware may be: paths, lines and parameters, counted by lizard."""

from pathlib import Path

import lizard
import pytest
from checkout import ROOT

ROOMS = ("core", "wire", "guard", "schedule")
# The largest values today. A function beyond them is to be split; the limits stay.
MOST_PATHS, MOST_LINES, MOST_PARAMETERS = 15, 50, 9
SOURCES = [file for room in ROOMS for file in sorted((ROOT / "firmware" / room).glob("*.[ch]"))]


def too_complex(name: str, text: str) -> list[str]:
    found = lizard.analyze_file.analyze_source_code(name, text).function_list
    return [
        f"{name}: {function.name}"
        for function in found
        if function.cyclomatic_complexity > MOST_PATHS
        or function.nloc > MOST_LINES
        or function.parameter_count > MOST_PARAMETERS
    ]


@pytest.mark.parametrize("source", SOURCES, ids=lambda file: f"{file.parent.name}/{file.name}")
def test_no_function_is_too_complex(source: Path) -> None:
    assert too_complex(source.name, source.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "planted",
    [
        "int f(int a) {" + "if (a) { ++a; }" * MOST_PATHS + "return a; }",
        "int f(int a) {\n" + "++a;\n" * MOST_LINES + "return a; }",
        "int f(" + ", ".join(f"int a{i}" for i in range(MOST_PARAMETERS + 1)) + ") { return a0; }",
    ],
)
def test_a_planted_function_is_named(planted: str) -> None:
    assert too_complex("planted.c", planted) == ["planted.c: f"]
