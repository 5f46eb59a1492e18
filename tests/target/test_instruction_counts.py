"""No number of instructions and no size has grown by more than 1 % against tools/bench/baseline.json."""

import os
import platform
import subprocess
import sys

import pytest
from checkout import ROOT, make

TARGETS = ["m3", "m4f", "m7", "r5f"]
NUMERICS = ["float", "fixed"]
ON_CONTROLLERS = pytest.mark.needs("qemu", "arm")
ON_HOST = [
    pytest.mark.needs("valgrind"),
    pytest.mark.skipif(platform.machine() != "x86_64", reason="optional: the counts of the host are for x86-64"),
]


@pytest.mark.gate
@pytest.mark.parametrize(
    ("target", "numeric"),
    [
        *(pytest.param(target, numeric, marks=ON_CONTROLLERS) for target in TARGETS for numeric in NUMERICS),
        pytest.param("m4f", "second_channel", marks=ON_CONTROLLERS),
        *(pytest.param("host", numeric, marks=ON_HOST) for numeric in NUMERICS),
    ],
)
def test_no_count_has_grown_by_more_than_one_percent(target: str, numeric: str) -> None:
    make(f"bench-images-{target}-{numeric}")
    bench = [sys.executable, str(ROOT / "tools" / "bench" / "bench.py"), "--jobs", "1"]
    done = subprocess.run(
        [*bench, "--baseline", str(ROOT / "tools" / "bench" / "baseline.json"), f"{target}:{numeric}"],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env=dict(os.environ),
    )
    print(done.stdout)
    assert done.returncode == 0, done.stderr
    if done.stderr:  # for example another compiler than the baseline's
        pytest.skip(done.stderr.strip().splitlines()[-1].removeprefix("bench: "))
