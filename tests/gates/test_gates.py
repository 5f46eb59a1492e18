"""Checks of the sources: strict builds, formatting, types, and generated files that are current."""

import subprocess

import pytest
from checkout import ROOT

GENERATORS = sorted(path.name for path in (ROOT / "tools").glob("*2c"))


def holds(gate: str) -> None:
    """By tools/lint and not by `make`, because only one `make` of the tests runs at a time."""
    command = [ROOT / "tools" / "lint", gate]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == 0, done.stdout[-8000:]


@pytest.mark.slow
def test_lint_gcc() -> None:
    holds("lint-gcc")


@pytest.mark.slow
@pytest.mark.needs("clang")
def test_lint_clang() -> None:
    holds("lint-clang")


@pytest.mark.slow
def test_lint_misra() -> None:
    holds("lint-misra")


@pytest.mark.slow
def test_lint_tidy() -> None:
    holds("lint-tidy")


@pytest.mark.slow
def test_lint_types() -> None:
    holds("lint-types")


@pytest.mark.parametrize("gate", ["format", "python"])
def test_lint(gate: str) -> None:
    holds(f"lint-{gate}")


@pytest.mark.parametrize("generator", GENERATORS)
def test_generated_files_are_current(generator: str) -> None:
    holds(f"current-{generator}")
