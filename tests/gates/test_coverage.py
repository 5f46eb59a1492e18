"""Unit tests reach every line, branch and condition of the portable firmware, but for gaps that a comment explains."""

import subprocess
import sys

import pytest
from checkout import ROOT


@pytest.mark.slow
@pytest.mark.needs("clang19")
def test_unit_tests_reach_every_branch_and_condition() -> None:
    done = subprocess.run(
        [sys.executable, "tools/coverage/coverage.py"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-8000:]
