"""Recordings through the firmware: reading them, playing them, and scoring the guard's reactions."""

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tauperp import cli
from tauperp.config import Configuration, load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Core, Reason
from tauperp.recording import Playback, Recording, Score, play, read_csv, score
from tauperp.recording.score import faults
from tauperp.sim.moment import Moment
from tauperp.view.replay_figure import replay_figure

POSE = np.array([0.06, 0.69, -0.08, -1.62, 0.03, 2.29, 0.85])
OFFSET = np.array([-0.5, 0.3, -0.2, 0.4, 0.1, 0.1, -0.3])
PERIOD_S = 0.005

Touch = tuple[float, float, float]  # from s, to s, Nm on joint 2


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    return load_configuration("replay_panda")


@pytest.fixture(scope="module")
def gravity() -> np.ndarray:
    return Core("panda").terms(POSE, np.zeros(7)).gravity


@pytest.fixture
def write(tmp_path: Path, gravity: np.ndarray) -> Callable[..., Path]:
    """Write a recording of an arm that stands at POSE and is touched; `labelled` selects the labelled touches."""

    def write(
        touches: list[Touch],
        *,
        labelled: list[tuple[float, float]] | None = None,
        seconds: float = 3.0,
        period_s: float = PERIOD_S,
        name: str = "made.csv",
        change: Callable[[list[str], np.ndarray], None] = lambda columns, values: None,
    ) -> Path:
        time = np.arange(0.0, seconds, period_s)
        values = np.zeros((len(time), 1 + 21 + 1))
        values[:, 0], values[:, 1:8], values[:, 15:22] = time, POSE, gravity + OFFSET
        for begin, end, torque in touches:
            values[(time >= begin) & (time < end), 16] += torque
        for begin, end in labelled if labelled is not None else [touch[:2] for touch in touches]:
            values[(time >= begin) & (time < end), 22] = 1
        columns = ["time", *(f"{kind}{i}" for kind in ("q", "dq", "tau_J") for i in range(7)), "label"]
        change(columns, values)
        path = tmp_path / name
        lines = [",".join(columns), *(",".join(f"{value:.7f}" for value in row) for row in values)]
        path.write_text("\n".join(lines) + "\n")
        return path

    return write


Write = Callable[..., Path]


def played(path: Path, configuration: Configuration) -> tuple[Playback, Score]:
    playback = play(read_csv(path, 7), configuration)
    return playback, score(playback)


def test_a_gzipped_recording_is_the_same(write: Write, tmp_path: Path) -> None:
    path = write([(1.5, 2.0, 5.0)])
    (tmp_path / "packed.csv.gz").write_bytes(gzip.compress(path.read_bytes()))
    plain, packed = read_csv(path, 7), read_csv(tmp_path / "packed.csv.gz", 7)
    assert packed.name == "packed"
    for name in ("time_s", "q", "qd", "tau", "touched"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(packed, name))


def test_columns_are_found_by_their_names(write: Write) -> None:
    def shuffled(columns: list[str], values: np.ndarray) -> None:
        order = np.random.default_rng(7).permutation(len(columns))
        columns[:] = [columns[i] for i in order]
        values[:] = values[:, order]

    ordered, mixed = read_csv(write([]), 7), read_csv(write([], change=shuffled), 7)
    np.testing.assert_array_equal(ordered.tau, mixed.tau)
    np.testing.assert_array_equal(ordered.q, mixed.q)


def test_touches_are_the_stretches_of_the_label(write: Write) -> None:
    recording = read_csv(write([], labelled=[(0.0, 0.5), (1.0, 1.2), (2.5, 9.0)]), 7)
    assert [(touch.start_s, touch.end_s) for touch in recording.touches] == [
        pytest.approx((0.0, 0.5)),
        pytest.approx((1.0, 1.2)),
        pytest.approx((2.5, recording.time_s[-1])),
    ]
    assert recording.touch_at(0) == recording.touches[0]
    assert recording.touch_at(recording.touches[1].last) is None


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda text: "", "no recording"),
        (lambda text: text.splitlines()[0], "no recording"),
        (lambda text: text.replace("tau_J6", "tau_J9", 1), "no column 'tau_J6'"),
        (lambda text: text.replace("0.0050000,", "0.0050000,1,", 1), ":3: 24 values under 23 column names"),
        (lambda text: text.replace("tau_J6", "tau_J5", 1), "column 'tau_J5' is there 2 times"),
        (lambda text: text.replace("0.0050000,", "soon,", 1), ":3: 'soon' is not a number"),
        (lambda text: text.replace("0.0050000,", "nan,", 1), ":3: time is not finite"),
        (lambda text: text.replace("0.0100000,", "0.0010000,", 1), ":4: time goes back"),
    ],
)
def test_a_damaged_recording_is_refused_with_its_place(write: Write, edit: Callable[[str], str], message: str) -> None:
    path = write([])
    path.write_text(edit(path.read_text()))
    with pytest.raises(InputError) as error:
        read_csv(path, 7)
    assert str(error.value).startswith(str(path))
    assert message in str(error.value)


def test_a_byte_order_mark_is_not_part_of_a_columns_name(write: Write) -> None:
    path = write([])
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert len(read_csv(path, 7).time_s) == 600


def test_a_binary_file_is_named(tmp_path: Path) -> None:
    for content in (b"\xff\xff", b"\x1f\x8bnot gzip"):
        (tmp_path / "x.csv").write_bytes(content)
        with pytest.raises(InputError, match=r"x\.csv: (not a CSV file|no recording)"):
            read_csv(tmp_path / "x.csv", 7)


def test_the_offset_of_the_sensors_is_subtracted(write: Write, configuration: Configuration) -> None:
    playback, _ = played(write([]), configuration)
    np.testing.assert_allclose(playback.offset_nm, OFFSET, atol=1e-4)
    assert np.abs(playback.residual).max() < 0.02


def test_a_touch_is_found_and_the_next_one_too(write: Write, configuration: Configuration) -> None:
    playback, result = played(write([(1.5, 1.8, 5.0), (2.0, 2.3, -5.0)]), configuration)
    assert [trip.reason for trip in playback.trips] == [Reason.COLLISION] * 2
    assert [trip.joint for trip in playback.trips] == [2, 2]
    assert [np.sign(trip.index_nm) for trip in playback.trips] == [1, -1]
    assert (len(result.found), result.missed, result.alarms) == (2, (), ())
    assert not faults([result])


def test_permission_is_withdrawn_from_the_trip_until_the_touch_is_over(
    write: Write, configuration: Configuration
) -> None:
    playback, result = played(write([(1.5, 2.0, 5.0)]), configuration)
    ((touch, trip),) = result.found
    healthy_rows = round(configuration.healthy_us * 1e-6 / PERIOD_S)
    assert playback.permitted[trip.row - 1]
    assert not playback.permitted[trip.row : touch.last + healthy_rows].any()
    assert playback.permitted[touch.last + healthy_rows + 30 :].all()


def test_a_touch_below_the_threshold_is_missed(write: Write, configuration: Configuration) -> None:
    threshold = configuration.threshold_nm("none")[1]
    _, result = played(write([(1.5, 2.0, 0.9 * threshold)]), configuration)
    assert (len(result.found), len(result.missed), len(result.alarms)) == (0, 1, 0)
    assert faults([result])


def test_an_unlabelled_push_is_an_alarm(write: Write, configuration: Configuration) -> None:
    _, result = played(write([(1.5, 2.0, 5.0)], labelled=[]), configuration)
    assert (result.touches, len(result.alarms)) == (0, 1)
    assert faults([result])


def test_a_stop_before_the_label_is_an_alarm_and_not_a_detection(write: Write, configuration: Configuration) -> None:
    _, result = played(write([(1.5, 2.0, 5.0)], labelled=[(1.7, 2.0)]), configuration)
    assert (len(result.found), len(result.missed), len(result.alarms)) == (0, 1, 1)


def test_without_labels_every_collision_is_an_alarm(write: Write, configuration: Configuration) -> None:
    def unlabelled(columns: list[str], values: np.ndarray) -> None:
        columns[-1] = "other"

    playback, result = played(write([(1.5, 2.0, 5.0)], change=unlabelled), configuration)
    assert playback.recording.touched is None
    assert (result.touches, len(result.alarms)) == (0, 1)


def test_a_reading_out_of_range_is_an_input_stop_and_not_an_alarm(write: Write, configuration: Configuration) -> None:
    def jump(columns: list[str], values: np.ndarray) -> None:
        values[400, columns.index("q3")] = 0.5  # the joint ends at -0.07

    _, result = played(write([], change=jump), configuration)
    assert [trip.reason for trip in result.input_stops][:1] == [Reason.INPUT_RANGE]
    assert not any(trip.row == 400 for trip in result.alarms)
    assert faults([result])


def test_the_guard_runs_at_the_recordings_rate(write: Write, configuration: Configuration) -> None:
    playback, result = played(write([(1.5, 2.0, 5.0)], period_s=0.008), configuration)
    assert playback.configuration.period_us == 8000
    assert len(result.found) == 1
    ((touch, trip),) = result.found
    rows = trip.row - touch.first + 1
    expected = 5.0 * (1 - np.exp(-50 * 0.008 * (rows - 0.5)))  # half a cycle: the torque is a mean of two samples
    assert playback.residual[trip.row, 1] == pytest.approx(expected, rel=0.1)


def test_a_recording_too_fast_for_classic_can_is_played_as_can_fd(write: Write, configuration: Configuration) -> None:
    assert configuration.settings.wire.format == "classic"
    for period_s, form in ((0.002, "classic"), (0.001, "fd")):
        playback, result = played(write([(1.5, 2.0, 5.0)], period_s=period_s), configuration)
        assert (playback.configuration.settings.wire.format, len(result.found)) == (form, 1)


def test_a_watcher_gets_every_row_with_its_pose(write: Write, configuration: Configuration) -> None:
    seen: list[tuple[float, bool, int]] = []

    def watch(moment: Moment) -> None:
        assert np.allclose(moment.data.qpos[:7], POSE)
        assert np.array_equal(moment.threshold, configuration.threshold_nm("none"))
        seen.append((moment.time_s, moment.permitted, moment.tripped_joint))

    playback = play(read_csv(write([(1.5, 2.0, 5.0)]), 7), configuration, watch=watch)
    (trip,) = playback.trips
    assert np.allclose([time_s for time_s, *_ in seen], playback.recording.time_s)
    assert [permitted for _, permitted, _ in seen] == playback.permitted.tolist()
    assert [joint for *_, joint in seen[trip.row - 1 : trip.row + 2]] == [0, 2, 2]


def test_a_row_that_the_wire_cannot_carry_is_named(write: Write, configuration: Configuration) -> None:
    def strong(columns: list[str], values: np.ndarray) -> None:
        values[300, columns.index("tau_J1")] = 1000.0

    with pytest.raises(InputError, match=r"made\.csv:302: JointState2\.Torque"):
        played(write([], change=strong), configuration)


def test_a_figure_is_a_png_and_the_same_twice(write: Write, configuration: Configuration) -> None:
    playback, result = played(write([(1.5, 2.0, 5.0)]), configuration)
    figure = replay_figure(playback, result)
    assert figure.startswith(b"\x89PNG")
    assert figure == replay_figure(playback, result)


def replay(*arguments: object) -> int:
    return cli.main(["replay", *map(str, arguments)])


def test_the_command_writes_figures_and_numbers(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [write([(1.5, 2.0, 5.0)], name="one.csv"), write([(1.5, 1.8, 5.0), (2.2, 2.6, 5.0)], name="two.csv")]
    assert replay("--csv", *paths, "--robot", "panda", "--out", tmp_path / "out", "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "out" / "score.json").read_text())
    assert (printed["touches"], printed["found"], printed["missed"], printed["alarms_idle"]) == (3, 3, 0, 0)
    assert [len(file["found_touches"]) for file in printed["files"]] == [1, 2]
    assert {"firmware", "configuration", "dbc"} <= set(printed["files"][0]["hashes"])
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["one.png", "score.json", "two.png"]


def test_the_verdict_is_the_exit_code(write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weak = write([(1.5, 2.0, 0.5)])
    assert replay("--csv", weak, "--robot", "panda", "--out", tmp_path / "out") == 1
    assert [line.split()[:4] for line in capsys.readouterr().out.splitlines()[1:3]] == [
        ["made", "1", "0", "1"],
        ["all", "1", "0", "1"],
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robot", "panda", "--csv", "none.csv"], "none.csv: No such file or directory"),
        (["--csv", "none.csv"], "name the arm with --robot"),
        (["--robot", "pandora", "--csv", "none.csv"], "pandora"),
    ],
)
def test_bad_input_gives_one_line_and_leaves_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert replay(*arguments, "--out", tmp_path / "out") == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_two_recordings_of_one_name_are_refused(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = write([])
    (tmp_path / "made.csv.gz").write_bytes(gzip.compress(first.read_bytes()))
    assert replay("--csv", first, tmp_path / "made.csv.gz", "--robot", "panda", "--out", tmp_path / "out") == 2
    assert "of the same name" in capsys.readouterr().err


def test_the_period_is_the_median_distance_of_two_rows() -> None:
    time = np.array([0.0, 0.005, 0.010, 0.030])
    recording = Recording("x", Path("x.csv"), time, *(np.zeros((4, 7)) for _ in range(3)), None)
    assert recording.period_us == 5000
    assert recording.touches == ()
