"""The documentation: every link is valid, every command exists, and repeated facts agree."""

import importlib.util
import re
import shlex
import sys
import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tauperp import cli
from tauperp.cli import COMMANDS, command_help
from tauperp.config import load_configuration
from tauperp.config.settings import Settings
from tauperp.files import repository_root

ROOT = repository_root()
FOLDER = ROOT / "tools" / "docs"


@pytest.fixture(scope="module")
def builder() -> Iterator[ModuleType]:
    """tools/docs/build.py"""
    sys.path.insert(0, str(FOLDER))
    spec = importlib.util.spec_from_file_location("docs_build", FOLDER / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    sys.path.remove(str(FOLDER))


@pytest.fixture(scope="module")
def site(builder: ModuleType) -> dict[str, str]:
    """Pages by their path in the repository."""
    built = builder.build()
    assert built.problems == []
    return dict(built.text)


def _anchors(text: str) -> set[str]:
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title).strip().lower().replace(" ", "-") for title in titles}


@pytest.mark.gate
def test_every_link_between_pages_leads_to_a_page_and_a_heading(builder: ModuleType, site: dict[str, str]) -> None:
    pages = {builder.site_path(path): text for path, text in site.items()}
    for path, text in pages.items():
        prose = builder.CODE.sub("", text)
        for target, anchor in re.findall(r"\]\((?!https?:|mailto:)([^)#\s]*)(#[^)\s]*)?\)", prose):
            page = str(Path(builder.normpath(f"{Path(path).parent}/{target}"))) if target else path
            if anchor and page in pages:
                assert anchor[1:] in _anchors(pages[page]), f"{path}: {target}{anchor}"


@pytest.mark.gate
def test_links_of_the_readme_are_valid() -> None:
    for name in ("README.md", "SECURITY.md", "RELEASING.md"):
        for target in re.findall(r"\]\((?!https?:|mailto:|#)([^)#\s]+)", (ROOT / name).read_text()):
            assert (ROOT / target).exists(), f"{name}: {target}"


PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("firmware/**/README.md")])


def _calls(page: Path, program: str) -> list[list[str]]:
    """Arguments of each call of a program in the page's indented code."""
    lines = re.findall(rf"^ {{4,}}(?:sudo )?{program} (.*)$", page.read_text(), re.MULTILINE)
    return [
        shlex.split(re.split(r"[|>;&]| {3,}", re.sub(r"<\([^)]*\)", "FILE", line))[0], comments=True) for line in lines
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_command_of_a_page_exists_and_takes_its_arguments(page: Path) -> None:
    makefile = (ROOT / "Makefile").read_text()
    targets = {name for line in re.findall(r"^([a-z][a-z -]*):", makefile, re.MULTILINE) for name in line.split()}
    for arguments in _calls(page, "make"):
        assert {name for name in arguments if re.fullmatch(r"[a-z-]+", name)} <= targets, arguments
    for arguments in _calls(page, "tauperp"):
        if arguments != ["--help"]:
            cli._parser(arguments[0]).parse_args(arguments)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_command_and_option_in_a_sentence_exists(page: Path) -> None:
    for call in re.findall(r"`tauperp ([a-z][^`]*)`", page.read_text()):
        name = call.split()[0]
        assert name in COMMANDS, call
        assert all(option in command_help(name) for option in re.findall(r"--[a-z][a-z-]*", call)), call


def test_the_python_example_of_the_readme_runs() -> None:
    text = (ROOT / "README.md").read_text()
    example = re.search(r"^    from tauperp.firmware import Core\n(?:(?:    .*)?\n)*", text, re.MULTILINE)
    assert example is not None
    at_rest = {"q": np.zeros((20, 7)), "qd": np.zeros((20, 7)), "tau": np.zeros((20, 7)), "accel": np.zeros((20, 3))}
    names: dict[str, Any] = dict(at_rest)
    exec(textwrap.dedent(example[0]), names)
    assert names["step"].index.shape == (20, 7)


def test_the_configuration_of_the_readme_is_accepted(tmp_path: Path) -> None:
    readme = (ROOT / "README.md").read_text()
    text = re.search(r"^ +robot = .my_arm.urdf.\n(?:.*\n)*?.*threshold_nm.*\n", readme, re.MULTILINE)
    assert text is not None
    (tmp_path / "my_arm.toml").write_text(textwrap.dedent(text[0]).replace("my_arm.urdf", "panda"))
    assert load_configuration(tmp_path / "my_arm.toml").robot.n == 7


@pytest.mark.gate
def test_every_page_is_in_the_navigation(builder: ModuleType, site: dict[str, str]) -> None:
    navigation = (ROOT / "mkdocs.yml").read_text()
    for path in site:
        place = builder.site_path(path)
        if not place.startswith(("decisions/", "source/")):
            assert f": {place}\n" in navigation, place


@pytest.mark.gate
def test_every_reason_has_advice_and_a_class(builder: ModuleType) -> None:
    pages = sys.modules["pages"]
    names = set(pages.reason_names().values())
    entries = tomllib.loads(pages.REASONS.read_text())
    assert names == set(entries), "docs/reasons.toml has one table for each name of StopCommand.Reason"
    assert names == set(pages.reason_classes())
    assert set(pages.reason_classes().values()) == set(pages.CLASSES)
    assert all(set(entry) == {"means", "look"} for entry in entries.values())


def test_every_subcommand_has_its_help_on_the_reference_page(site: dict[str, str]) -> None:
    page = site["docs/reference/commands.md"]
    assert [name for name in COMMANDS if f"\nusage: tauperp {name}" not in page] == []


def test_the_reference_of_the_wire_names_every_signal_of_joint_1(site: dict[str, str]) -> None:
    page = site["docs/reference/wire.md"]
    for signal in ("PermissionInverted", "CycleHigh", "TripNumber", "Residual1", "BuildId"):
        assert f"| {signal} |" in page


@pytest.mark.gate
def test_every_group_of_keys_is_explained_on_the_page_of_the_configuration() -> None:
    page = (ROOT / "docs" / "configuration.md").read_text()
    assert [name for name in Settings.model_fields if f"`{name}" not in page] == []


@pytest.mark.gate
def test_the_decisions_are_listed() -> None:
    folder = ROOT / "docs" / "decisions"
    listed = re.findall(r"\]\((\w[\w-]*\.md)\)", (folder / "index.md").read_text())
    assert sorted([*listed, "index.md"]) == sorted(file.name for file in folder.glob("*.md"))
