"""Every emulated processor produces the library's bits, in both numeric types: random ticks and both experiments.

The library is the same sources built for x86-64 by another compiler at another level of optimisation. The controllers'
images receive the same frames, and every tick compares state, verdict, residual, index and frames.
"""

import struct
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from checkout import ROOT
from emulator import BUILD, built, run_to_end
from recording import SYNC, TICK, RandomTicks, Recorder, record_experiment, record_random
from worst_case import LIMITS

from tauperp.config import Numeric
from tauperp.robot import load

sys.path.append(str(ROOT / "tests" / "host"))
from robot_makers import random_robot

pytestmark = pytest.mark.needs("qemu", "arm")
TICKS = 10_000
SEED = 4711
RUN_S = 600.0

RECORDINGS: dict[str, Callable[[Numeric], Path]] = {
    **{
        f"random ticks of {name}": lambda numeric, name=name: record_random(load(name), numeric, TICKS, SEED)  # type: ignore[misc]
        for name in ("ku_dex", "panda", "kinova3")
    },
    **{
        f"random ticks of {n} joints": lambda numeric, n=n: record_random(random_robot(n, n), numeric, TICKS, SEED)  # type: ignore[misc]
        for n in (2, 6, 8)
    },
    **{
        f"{name} with {robot}": lambda numeric, name=name, robot=robot: record_experiment(name, numeric, robot)  # type: ignore[misc]
        for name in ("payload", "contact")
        for robot in ("ku_dex", "panda")
    },
}
BUILDS: dict[Numeric, str] = {"float32": "float", "q9.22": "fixed"}


def play(target: str, numeric: Numeric, recording: Path) -> tuple[int, list[str]]:
    """Exit code and the words that the image prints."""
    image = BUILD / f"playback-{target}-{BUILDS[numeric]}.elf"
    built(str(image.relative_to(ROOT)), image)
    code, output = run_to_end(target, image, RUN_S, [str(recording.relative_to(ROOT))])
    return code, output.split()


@pytest.mark.parametrize("target", ["m3", "m4f", "m7", "r5f"])
@pytest.mark.parametrize("numeric", BUILDS)
@pytest.mark.parametrize("name", RECORDINGS)
def test_a_controller_produces_the_librarys_bits(name: str, numeric: Numeric, target: str) -> None:
    print(f"seed {SEED}")
    recording = RECORDINGS[name](numeric)
    ticks = struct.unpack_from("<I", recording.read_bytes()[-16:], 4)[0]
    assert ticks >= TICKS or "random" not in name
    code, words = play(target, numeric, recording)
    print(words)
    assert words[:2] == ["same", str(ticks)]
    assert code == 0
    assert int(words[3]) <= LIMITS[target, BUILDS[numeric]][0]


@pytest.mark.parametrize("target", ["m3", "r5f"])
def test_a_difference_is_found_at_its_tick(target: str) -> None:
    """The comparison can fail: one frame is missing, and the later CRCs are unchanged."""
    print(f"seed {SEED}")
    recorder = Recorder()
    source = RandomTicks(load("panda"), "float32", recorder, np.random.default_rng(SEED))
    while recorder.ticks < 500:
        source.episode(500 - recorder.ticks)
    at = recorder.index_of_last(SYNC, len(recorder.records) - 200)
    ticks_before = sum(record[0] == TICK and len(record) == 16 for record in recorder.records[:at])
    del recorder.records[at]
    broken = BUILD / f"broken-{target}.rec"
    broken.write_bytes(recorder.content())
    code, words = play(target, "float32", broken)
    assert (code, words[:2]) == (1, ["different", str(ticks_before)])
