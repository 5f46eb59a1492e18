"""The committed inputs of tests/fuzz and a few more, seeded ones (tools/fuzz check). For a long run: make fuzz."""

import subprocess
import sys

import pytest
from checkout import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.needs("clang19", "unity")]


@pytest.mark.parametrize("numeric", ["float", "fixed"])
def test_no_stream_of_frames_and_no_block_breaks_a_rule_of_the_guard(numeric: str) -> None:
    command = [sys.executable, str(ROOT / "tools" / "fuzz"), "check", "--numeric", numeric]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("no finding") == 3
