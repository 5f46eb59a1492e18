"""Six recordings of a real arm that people touch; skipped where there are none.

Their folder is next to the checkout, or TAUPERP_PANDA_TOUCHES names it.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from tauperp import cli
from tauperp.config import load_configuration
from tauperp.errors import InputError
from tauperp.files import repository_root
from tauperp.recording import Playback, play, read_csv, score
from tauperp.recording.score import faults, median_latency_ms

FOLDER = Path(os.environ.get("TAUPERP_PANDA_TOUCHES", repository_root().parent / "shared" / "data" / "panda_touches"))
DERIVED_FROM = ("a4", "c2", "d3")
HELD_OUT = ("b6", "c3", "f2")

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"optional: no recordings in {FOLDER}")


@pytest.fixture(scope="module")
def playbacks() -> dict[str, Playback]:
    configuration = load_configuration("replay_panda")
    return {name: play(read_csv(FOLDER / f"{name}.csv.gz", 7), configuration) for name in (*DERIVED_FROM, *HELD_OUT)}


def idle_peak(playback: Playback) -> np.ndarray:
    """Largest index of each joint from 0.2 s after a touch to 20 ms before the next, (n,) Nm."""
    time = playback.recording.time_s
    idle = np.ones(time.shape, bool)
    for touch in playback.recording.touches:
        idle &= (time < touch.start_s - 0.02) | (time >= touch.end_s + 0.2)
    return np.abs(playback.index[idle]).max(axis=0)


def test_nine_of_ten_touches_are_found_and_nothing_alarms_while_idle(playbacks: dict[str, Playback]) -> None:
    scores = [score(playback) for playback in playbacks.values()]
    touches, found = sum(one.touches for one in scores), sum(len(one.found) for one in scores)
    print(f"{found} of {touches} touches found")
    assert touches == 92
    assert found >= 0.9 * touches
    assert [one.alarms for one in scores] == [()] * len(scores)
    assert [one.input_stops for one in scores] == [()] * len(scores)
    assert not faults(scores)
    assert median_latency_ms(scores) == pytest.approx(40.0, abs=0.5)
    assert median_latency_ms([score(playbacks[name]) for name in HELD_OUT]) <= 40.5


def test_the_thresholds_follow_their_rule_on_one_half_of_the_recordings(playbacks: dict[str, Playback]) -> None:
    peak = np.max([idle_peak(playbacks[name]) for name in DERIVED_FROM], axis=0)
    rule = np.maximum(0.4, np.ceil(np.round(1.5 * peak / 0.05, 6)) * 0.05)
    np.testing.assert_allclose(load_configuration("replay_panda").threshold_nm("none"), rule, atol=1e-9)


def test_the_held_out_half_stays_below_the_thresholds_while_idle(playbacks: dict[str, Playback]) -> None:
    peak = np.max([idle_peak(playbacks[name]) for name in HELD_OUT], axis=0)
    share = (peak / load_configuration("replay_panda").threshold_nm("none")).max()
    print(f"idle peak {share:.2f} of the threshold")
    assert share < 0.85


def test_the_model_with_the_hand_is_the_one_that_fits(playbacks: dict[str, Playback]) -> None:
    """The offset found in the first second is a sensor's error, not the mass of a missing hand."""
    assert max(np.abs(playback.offset_nm).max() for playback in playbacks.values()) < 0.7
    bare = load_configuration("replay_panda", robot="panda_bare")
    with pytest.raises(InputError, match=r"as a payload of \+0\.\d+ kg would: no offsets from it"):
        play(playbacks["a4"].recording, bare)


def test_the_contact_index_hardly_reacts_to_touches_by_hand(tmp_path: Path) -> None:
    """A limit that users have to know: d_e explains the torque of a hand on a link."""
    arguments = ["replay", "--robot", "panda", "--task", "contact", "--out", str(tmp_path)]
    assert cli.main([*arguments, "--csv", str(FOLDER / "f2.csv.gz")]) == 1
