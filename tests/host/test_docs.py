"""The documentation: every link leads somewhere, and what is written twice agrees."""

import importlib.util
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from tauperp.cli import COMMANDS
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
def test_links_of_the_readme_lead_somewhere() -> None:
    for name in ("README.md", "SECURITY.md", "RELEASING.md"):
        for target in re.findall(r"\]\((?!https?:|mailto:|#)([^)#\s]+)", (ROOT / name).read_text()):
            assert (ROOT / target).exists(), f"{name}: {target}"


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
