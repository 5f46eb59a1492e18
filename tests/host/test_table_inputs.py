"""Tables as real programs write them: separators, gaps in the rows, times, words, units, names of joints."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from tauperp import cli
from tauperp.errors import InputError
from tauperp.recording import Recording, read_recording
from tauperp.recording.stamps import check_rate
from tauperp.toml import read_toml

N = 2
NAMES = ["time", "q0", "q1", "dq0", "dq1", "tau_J0", "tau_J1", "label"]
ROWS = np.round(np.random.default_rng(3).uniform(-2, 2, (12, len(NAMES))), 3)
ROWS[:, 0] = np.arange(12) * 0.002
ROWS[:, -1] = np.arange(12) > 6


def text(separator: str = ",", decimal: str = ".", rows: np.ndarray = ROWS) -> str:
    lines = [separator.join(NAMES)]
    lines += [separator.join(repr(float(x)).replace(".", decimal) for x in row) for row in rows]
    return "\n".join(lines) + "\n"


def read(folder: Path, content: str | bytes, map_text: str | None = None, joints: int = N) -> Recording:
    path = folder / "x.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_recording(path, joints, mapped(folder, map_text))


def mapped(folder: Path, map_text: str | None) -> Path | None:
    if map_text is None:
        return None
    path = folder / "map.toml"
    path.write_text(map_text)
    return path


def assert_same(recording: Recording, rows: np.ndarray = ROWS) -> None:
    assert recording.damage is None
    np.testing.assert_allclose(recording.time_s, rows[:, 0] - rows[0, 0], atol=1e-9)
    np.testing.assert_allclose(np.hstack([recording.q, recording.qd, recording.tau]), rows[:, 1:7])
    assert recording.touched is not None
    np.testing.assert_array_equal(recording.touched, rows[:, 7] != 0)


@pytest.mark.parametrize("separator", [",", ";", "\t", "|", " "])
@pytest.mark.parametrize("decimal", [".", ","])
def test_separator_and_decimal_comma_are_detected(tmp_path: Path, separator: str, decimal: str) -> None:
    if separator == decimal:
        quoted = text("@", decimal).replace("@", '","').replace("\n", '"\n"')
        assert_same(read(tmp_path, '"' + quoted[:-1]))
        return
    recording = read(tmp_path, text(separator, decimal))
    assert_same(recording)
    assert recording.notes == ()
    assert recording.place(0).endswith("x.csv:2")


def test_separator_and_decimal_comma_can_be_given(tmp_path: Path) -> None:
    assert_same(read(tmp_path, text(";", ","), '[file]\nseparator = ";"\ndecimal = ","'))
    with pytest.raises(InputError, match=r"no column 'time', which this arm needs .*line 1 has 'time;q0;q1"):
        read(tmp_path, text(";"), '[file]\nseparator = ","')
    with pytest.raises(InputError, match=r"x\.csv:2: '0\.0' is not a number"):
        read(tmp_path, text(";"), '[file]\ndecimal = ","')


OTHERS = {
    "blank last lines": lambda: text() + "\n\n",
    "a blank line inside": lambda: text().replace("\n", "\n\n", 3),
    "comments": lambda: "# robot: arm\n# 2026-05-01, 10:00\n" + text() + "# end\n",
    "a commented header": lambda: "# arm\n# " + text(" "),
    "free text": lambda: "Recorder 5.1\nRobot;Arm\n\n" + text(";"),
    "a separator at each end": lambda: text().replace("\n", ",\n").replace("label,", "label", 1),
    "utf-16": lambda: text("\t").encode("utf-16"),
    "cp1252": lambda: ("Winkel in °\n" + text()).encode("cp1252"),
    "a byte order mark": lambda: text().encode("utf-8-sig"),
    "windows": lambda: text().replace("\n", "\r\n"),
    "true and false": lambda: text().replace(",1.0\n", ",True\n").replace(",0.0\n", ",False\n"),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_text_around_the_rows_changes_nothing(tmp_path: Path, kind: str) -> None:
    assert_same(read(tmp_path, OTHERS[kind]()))


def test_a_line_of_units_is_omitted_and_reported(tmp_path: Path) -> None:
    units = ",".join(["s", "rad", "rad", "rad/s", "rad/s", "Nm", "Nm", "-"])
    recording = read(tmp_path, text().replace("label\n", f"label\n{units}\n"))
    assert_same(recording)
    assert recording.notes == ("the line of units is omitted",)


def test_rows_without_readings_are_counted_and_line_numbers_stay_correct(tmp_path: Path) -> None:
    """PlotJuggler writes topics with different times in this way: one row for each, in which the others are empty."""
    lines = text().splitlines()
    lines.insert(4, "0.0041,,,,,,,")
    lines.insert(10, "0.0112,,,,,,,1")
    recording = read(tmp_path, "\n".join(lines))
    assert_same(recording)
    assert recording.notes == ("2 rows without any reading are omitted",)
    assert [recording.place(row).rpartition(":")[2] for row in (0, 2, 3, 11)] == ["2", "4", "6", "15"]
    lines[12] = lines[12].replace(",", ",x", 1)
    damaged = read(tmp_path, "\n".join(lines))
    assert ":13: 'x" in str(damaged.damage)


def test_a_label_with_its_own_times_holds_until_the_next_one(tmp_path: Path) -> None:
    lines = [line.rpartition(",")[0] + "," for line in text().splitlines()]
    lines[0] += "label"
    lines.insert(5, "0.0061,,,,,,,1")
    touched = read(tmp_path, "\n".join(lines)).touched
    assert touched is not None
    assert touched.tolist() == [False] * 4 + [True] * 8


def test_time_may_be_split_into_two_columns(tmp_path: Path) -> None:
    lines = text().splitlines()
    split = ["sec,nanosec" + lines[0].removeprefix("time")]
    for k, line in enumerate(lines[1:]):
        ns = 995_000_000 + k * 2_000_000
        split.append(f"{1_700_000_000 + ns // 10**9},{ns % 10**9}{line[line.index(',') :]}")
    content = "\n".join(split)
    assert_same(read(tmp_path, content, '[time]\ncolumns = ["sec", "nanosec"]'))
    back = read(tmp_path, content, '[time]\ncolumn = "nanosec"\nunit = "ns"')
    assert "time goes back (seconds in another column?" in str(back.damage)
    with pytest.raises(InputError, match=r"time does not advance: 2 time stamps in 12 rows of 'sec' \(columns = "):
        read(tmp_path, content, '[time]\ncolumn = "sec"')
    with pytest.raises(InputError, match="without column and unit"):
        read(tmp_path, content, '[time]\ncolumns = ["sec", "nanosec"]\nunit = "ns"')


def test_repeated_time_stamps_are_dropped_and_counted(tmp_path: Path) -> None:
    recording = read(tmp_path, text(rows=np.repeat(ROWS, 2, axis=0)))
    assert_same(recording)
    assert recording.notes == ("12 rows with the time stamp of the previous row are omitted",)
    assert recording.place(1).endswith(":4")


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_a_time_in_another_unit_is_named(tmp_path: Path, factor: float, unit: str) -> None:
    rows = ROWS * ([factor] + [1.0] * 7)
    with pytest.raises(InputError, match=rf'by \'time\', and a guard runs at .*; is it in {unit} \(unit = "{unit}"'):
        check_rate(read(tmp_path, text(rows=rows)))
    check_rate(read(tmp_path, text(rows=rows), f'[time]\nunit = "{unit}"'))


def test_currents_have_a_factor_for_each_joint(tmp_path: Path) -> None:
    recording = read(tmp_path, text(), "[torque]\nfactor = [2.0, 0.5]\nsign = [1, -1]")
    np.testing.assert_allclose(recording.tau, ROWS[:, 5:7] * [2.0, -0.5])


def test_angles_beyond_the_wire_are_wrapped_and_reported(tmp_path: Path) -> None:
    rows = ROWS.copy()
    rows[:, 1] += 2 * np.pi
    recording = read(tmp_path, text(rows=rows))
    np.testing.assert_allclose(recording.q, ROWS[:, 1:3], atol=1e-9)
    assert recording.notes == ("angles of joint 1 are beyond the wire and wrapped to +-pi",)
    rows[:, 1] += 40 * np.pi
    with pytest.raises(InputError, match=r"joint 1 stands at .* is it in degrees"):
        read(tmp_path, text(rows=rows))
    np.testing.assert_allclose(read(tmp_path, text(rows=rows), "[position]\nwrap = true").q, ROWS[:, 1:3], atol=1e-9)


def test_a_byte_order_mark_in_toml_is_ignored(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_bytes('robot = "panda"'.encode("utf-8-sig"))
    assert read_toml(path) == {"robot": "panda"}


def test_the_command_reports_omitted_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text(rows=np.repeat(ROWS, 2, axis=0)))
    assert cli.main(["score", "--robot", "ku_dex", str(path), "--out", str(tmp_path)]) == 2
    assert "no column 'q2'" in capsys.readouterr().err


# ROS 2

SCHEMA = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""
ROS_MAP = """{}
[time]
columns = ["/joint_states:header.stamp.sec", "/joint_states:header.stamp.nanosec"]
[position]
column = "/joint_states:position"
[velocity]
column = "/joint_states:velocity"
[torque]
column = "/joint_states:effort"
"""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Joints in the order of their names, with a gripper's among them, as joint_state_broadcaster sends them."""
    module = pytest.importorskip("mcap_ros2.writer")
    path = tmp_path_factory.mktemp("bag") / "x.mcap"
    with path.open("wb") as file:
        writer = module.Writer(file)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", SCHEMA)
        for k, row in enumerate(ROWS):
            ns = 1_700_000_000_999_000_000 + k * 2_000_000
            stamp = {"sec": ns // 10**9, "nanosec": ns % 10**9}
            values = {"position": row[1:3], "velocity": row[3:5], "effort": row[5:7]}
            message = {"header": {"stamp": stamp, "frame_id": ""}, "name": ["elbow", "finger", "shoulder"]}
            message |= {key: [float(pair[1]), 9.0, float(pair[0])] for key, pair in values.items()}
            writer.write_message("/joint_states", schema, message, log_time=ns, publish_time=ns)
        writer.finish()
    return path


def test_joint_states_of_ros_2_are_selected_by_name(bag: Path, tmp_path: Path) -> None:
    for names, in_map in ((("shoulder", "elbow"), ""), ((), 'joints = ["shoulder", "elbow"]')):
        recording = read_recording(bag, N, mapped(tmp_path, ROS_MAP.format(in_map)), names=names)
        np.testing.assert_allclose(recording.time_s, ROWS[:, 0], atol=1e-6)
        np.testing.assert_allclose(np.hstack([recording.q, recording.qd, recording.tau]), ROWS[:, 1:7])


def test_unknown_joint_names_are_reported(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no joint 'j1' in a message on '/joint_states' \(it has 'elbow', 'finger'"):
        read_recording(bag, N, mapped(tmp_path, ROS_MAP.format("")), names=("j1", "j2"))


def test_a_cut_gzip_gives_the_rows_before_the_cut(tmp_path: Path) -> None:
    path = tmp_path / "x.csv.gz"
    many = np.repeat(ROWS, 400, axis=0)
    many[:, 0] = np.arange(len(many)) * 0.002
    many[:, 1:7] = np.random.default_rng(1).uniform(-2, 2, (len(many), 6))
    packed = gzip.compress(text(rows=many).encode())
    path.write_bytes(packed[: len(packed) // 2])
    recording = read_recording(path, N)
    assert "cannot be read on at byte " in str(recording.damage)
    assert 100 < len(recording.time_s) < len(many)
