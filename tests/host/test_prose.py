"""tools/prose: what the prose check finds, and what it ignores."""

import importlib.util
from importlib.machinery import SourceFileLoader
from types import ModuleType

import pytest

from tauperp.files import repository_root


@pytest.fixture(scope="module")
def prose() -> ModuleType:
    path = str(repository_root() / "tools" / "prose")
    spec = importlib.util.spec_from_loader("prose", SourceFileLoader("prose", path))
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    assert spec.loader is not None
    spec.loader.exec_module(module)
    return module


RULES = {"is told": "is sent", "utilise*": "use", "anew": "again"}


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("It starts anew.", 1),
        ("first\nWhat the guard is told matters.", 2),
        ("/* what it is\n * told, and when */", 1),
        ("# what it is\n# told", 1),
        ("It Utilises a table.", 1),
    ],
)
def test_an_idiom_is_found_across_lines_and_cases(prose: ModuleType, text: str, line: int) -> None:
    assert [found[0] for found in prose.finds(text, prose.patterns(RULES))] == [line]


@pytest.mark.parametrize("text", ["a new one", "anewly", "is toldless", "this told"])
def test_parts_of_words_are_left_alone(prose: ModuleType, text: str) -> None:
    assert prose.finds(text, prose.patterns(RULES)) == []


def test_the_list_has_a_hint_for_everything_and_reads_its_scope(prose: ModuleType) -> None:
    settings = prose.tomllib.loads((repository_root() / "tools" / "prose.toml").read_text())
    assert all(settings["replace"].values())
    names = prose.files_in_scope(settings["scope"])
    assert {"README.md", "docs/guard.md", "firmware/wire/e2e.h", "tools/vcan"} <= set(names)
    assert "firmware/wire/messages.c" not in names
