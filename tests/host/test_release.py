"""Version, citation and locked dependencies of a release agree with the sources."""

import re

import pytest

from tauperp import __version__
from tauperp.files import repository_root

ROOT = repository_root()


@pytest.mark.gate
def test_the_version_is_defined_once_and_the_citation_agrees() -> None:
    macros = dict(re.findall(r"#define TAUPERP_VERSION_(\w+) +(\d+)u", (ROOT / "firmware/guard/version.h").read_text()))
    assert __version__ == ".".join(macros[part] for part in ("MAJOR", "MINOR", "PATCH"))
    assert re.findall(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE) == [__version__]


@pytest.mark.gate
def test_the_lock_pins_every_direct_dependency() -> None:
    pinned = {line.partition("==")[0].lower().replace("_", "-") for line in (ROOT / "requirements.lock").open()}
    project = (ROOT / "pyproject.toml").read_text().partition("[project.scripts]")[0]
    names = {name.lower() for name in re.findall(r'"([A-Za-z][\w-]*)[>=<"]', project.partition("dependencies = [")[2])}
    optional = {"casadi", "mkdocs", "mkdocs-material", "rerun-sdk", "tauperp"}  # installed on demand
    assert sorted(names - optional - pinned) == []
