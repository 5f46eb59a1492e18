"""`make evidence`: each number has its command, commit and hash; a part that fails, is missing or is slow is red."""

import hashlib
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT

sys.path.insert(0, str(ROOT / "tools" / "evidence"))

import evidence

MAKEFILE = "good:\n\t@echo 12 of 12 proved\nbad:\n\t@echo 3 survived; exit 3\nslow:\n\t@sleep 60\n"


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    (tmp_path / "Makefile").write_text(MAKEFILE)
    for command in (["init", "-q"], ["add", "."], ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "x"]):
        subprocess.run(["git", *command], cwd=tmp_path, check=True)
    return tmp_path


def page_of(checkout: Path, *goals: str, minutes: str = "1") -> tuple[int, str]:
    parts = checkout / "parts.toml"
    rows = [f'[[part]]\nname = "Part {g}"\ngoal = "{g}"\ncommand = "make {g}"\nminutes = 0.02\n' for g in goals]
    parts.write_text("\n".join(rows))
    out = checkout / "out"
    code = evidence.main(["--out", str(out), "--parts", str(parts), "--minutes", minutes], checkout)
    return code, (out / "index.md").read_text()


def test_a_number_has_its_command_commit_and_hash(checkout: Path) -> None:
    code, page = page_of(checkout, "good")
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=checkout, capture_output=True, text=True, check=True)
    output = (checkout / "out" / "part-good.log").read_bytes()
    assert code == 0
    assert "**GREEN**: 1 of 1 parts" in page
    assert "12 of 12 proved" in page
    assert "`make good`" in page
    assert commit.stdout.strip() in page
    assert "with changes that are not committed" in page  # parts.toml
    assert hashlib.sha256(output).hexdigest() in page


@pytest.mark.parametrize(
    ("goal", "said"), [("bad", "red: exit code 2"), ("slow", "red: took too long"), ("nowhere", "not available")]
)
def test_a_failed_part_is_red(checkout: Path, goal: str, said: str) -> None:
    code, page = page_of(checkout, "good", goal)
    assert code == 1
    assert "**RED**: 1 of 2 parts" in page
    assert said in page


def test_without_time_left_a_part_is_red(checkout: Path) -> None:
    code, page = page_of(checkout, "good", minutes="0")
    assert code == 1
    assert "not run: no time left" in page


def test_every_part_of_the_project_is_well_formed() -> None:
    parts = evidence.read(ROOT / "tools" / "evidence" / "parts.toml")
    assert sum(part.minutes for part in parts if evidence.is_available(part.goal, ROOT)) <= 90
    assert evidence.is_available("test", ROOT)
    assert evidence.is_available("faults", ROOT)
