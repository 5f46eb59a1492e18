"""The verdict of `make coverage`: which gaps it refuses, and which comments explain one."""

import sys
from pathlib import Path

import pytest
from checkout import ROOT

sys.path.insert(0, str(ROOT / "tools" / "coverage"))

import coverage

FILE = "firmware/core/one.c"
REASON = "No input can reach it."
CODE = "int one(int a, int b) { return a && b; }\n"


def measured(branches: list[list[int]], shown: list[bool]) -> coverage.Coverage:
    """One function in line 2, as llvm-cov exports it: its region ran, with these counts and conditions."""
    found = coverage.Coverage(lines={FILE: (1, 0)})
    at = [2, 1, 2, 40]
    found.add(
        {
            "filenames": [f"{coverage.ROOT}/{FILE}"],
            "regions": [[*at, 5, 0, 0, 0]],
            "branches": [[2, 10 + place, 2, 20, *counts, 0, 0, 4] for place, counts in enumerate(branches)],
            "mcdc_records": [[*at, 0, 5, shown]],
        }
    )
    return found


@pytest.fixture
def verdict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def of(found: coverage.Coverage, comment: str = "/* none */") -> list[str]:
        source = tmp_path / FILE
        source.parent.mkdir(parents=True, exist_ok=True)
        source.write_text(f"{comment}\n{CODE}")
        monkeypatch.setattr(coverage, "ROOT", tmp_path)
        return coverage.judge("float", found, coverage.exclusions([source]))[0]

    return of


def test_code_that_is_reached_passes(verdict) -> None:
    assert verdict(measured([[1, 1], [2, 3]], [True, True])) == []


def test_a_branch_or_condition_without_a_test_is_named(verdict) -> None:
    said = verdict(measured([[1, 0], [2, 3]], [True, False]))
    assert said == [f"float: {FILE}:2: 1 {kind} missed: {CODE.strip()}" for kind in ("branch", "condition")]


def test_a_comment_explains_as_many_gaps_as_it_names_and_no_more(verdict) -> None:
    comment = f"/* Uncovered in float: 1 branch, 1 condition. {REASON} */"
    assert verdict(measured([[1, 0], [2, 3]], [True, False]), comment) == []
    assert verdict(measured([[1, 0], [0, 3]], [True, False]), comment) == [
        f"float: {FILE}:2: 1 branch explained, 2 missed"
    ]


def test_a_comment_whose_gap_is_closed_fails(verdict) -> None:
    comment = f"/* Uncovered in both: 1 branch. {REASON} */"
    assert verdict(measured([[1, 1], [2, 3]], [True, True]), comment) == [
        f"float: {FILE}:2: 1 branch explained, 0 missed"
    ]


def test_a_comment_is_for_its_numeric_type(verdict) -> None:
    comment = f"/* Uncovered in fixed: 1 branch. {REASON} */"
    assert len(verdict(measured([[1, 0], [2, 3]], [True, True]), comment)) == 1


@pytest.mark.parametrize(
    "comment", ["/* Uncovered in float: 1 branch. Why. */", "/* Uncovered in float: some. Why not? */"]
)
def test_a_comment_without_a_count_or_a_reason_is_refused(verdict, comment: str) -> None:
    with pytest.raises(SystemExit, match="cannot read"):
        verdict(measured([[1, 0]], [True]), comment)
