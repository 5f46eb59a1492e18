"""`make evidence`: each number has its command, commit and hash; a part that fails, is missing or is slow is red."""

import hashlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from checkout import ROOT

sys.path.insert(0, str(ROOT / "tools" / "evidence"))

import evidence

MAKEFILE = """
good:
	@echo 12 of 12 proved
bad:
	@echo 3 survived; exit 3
slow:
	@sleep 60
busy:
	@python3 -c 'sum(range(6000000))'
edits:
	@echo >>Makefile
"""


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


def test_a_second_run_replaces_the_page_and_the_files_of_the_first(checkout: Path) -> None:
    assert page_of(checkout, "good", "bad")[0] == 1
    assert page_of(checkout, "good")[0] == 0
    assert sorted(file.name for file in (checkout / "out").iterdir()) == ["index.md", "part-good.log"]


def test_sources_that_change_during_the_run_are_red(checkout: Path) -> None:
    code, page = page_of(checkout, "edits")
    assert code == 0  # parts.toml is not committed: the sources were already changed
    subprocess.run(["git", "checkout", "-q", "Makefile"], cwd=checkout, check=True)
    (checkout / ".git" / "info" / "exclude").write_text("parts.toml\nout/\n")
    code, page = page_of(checkout, "edits")
    assert code == 1
    assert "they changed meanwhile" in page


def test_processor_time_is_counted_and_summed_up(checkout: Path) -> None:
    _, page = page_of(checkout, "busy", "busy")
    rows = [line.split("|") for line in page.splitlines() if line.startswith("| Part busy")]
    assert len(rows) == 2
    assert "seconds of processor time; two cores have 120 in 1 minutes" in page


def test_a_page_of_some_parts_says_so(checkout: Path) -> None:
    page_of(checkout, "good", "bad")
    options = ["--out", str(checkout / "out"), "--parts", str(checkout / "parts.toml"), "--only", "good"]
    assert evidence.main(options, checkout) == 0
    page = (checkout / "out" / "index.md").read_text()
    assert "**Not the whole record**: 1 parts were left out by --only." in page


def test_an_interrupt_leaves_no_page_and_no_process(checkout: Path) -> None:
    page_of(checkout, "good")
    (checkout / "parts.toml").write_text(
        '[[part]]\nname = "Long"\ngoal = "good"\ncommand = "echo $$ >pid; mv pid started; sleep 600"\nminutes = 60\n'
    )
    lines = [
        "import signal, sys, pathlib, evidence",
        "signal.signal(signal.SIGINT, signal.default_int_handler)",  # a test in the background inherits SIG_IGN
        "sys.exit(evidence.main(['--out', 'out', '--parts', 'parts.toml'], pathlib.Path.cwd()))",
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools" / "evidence")}
    process = subprocess.Popen(
        [sys.executable, "-c", "\n".join(lines)], cwd=checkout, stdout=subprocess.PIPE, text=True, env=environment
    )
    log = checkout / "started"
    while not log.exists() and process.poll() is None:
        time.sleep(0.01)
    child = int(log.read_text())
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate()
    assert process.returncode == 130
    assert "interrupted: no page" in said
    assert not (checkout / "out" / "index.md").exists()
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)


def test_every_part_of_the_project_is_well_formed() -> None:
    parts = evidence.read(ROOT / "tools" / "evidence" / "parts.toml")
    assert sum(part.minutes for part in parts) < 60
    assert [part.name for part in parts if not evidence.is_available(part.goal, ROOT)] == []
