"""Recordings as tables of every format, with other names, units and signs; mistakes are reported with their place."""

import gzip
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tauperp.cli import main
from tauperp.errors import InputError
from tauperp.firmware import Core
from tauperp.recording import Recording, read_csv, read_recording
from tauperp.recording.mapping import column_map

N = 7
ROWS = 300
POSE = np.array([0.06, 0.69, -0.08, -1.62, 0.03, 2.29, 0.85])
Table = dict[str, np.ndarray]

OTHER_MAP = """
[time]
column = "stamp"
unit = "ms"
[position]
column = "A{}_deg"
first = 1
unit = "deg"
sign = [1, 1, -1, 1, 1, 1, -1]
[velocity]
column = "A{}_speed"
first = 1
unit = "mrad/s"
[torque]
columns = ["base", "shoulder", "upper", "elbow", "lower", "wrist", "hand"]
unit = "mNm"
sign = -1
[label]
column = "touched"
"""
LIST_MAP = """
[position]
column = "q"
[velocity]
column = "dq"
[torque]
column = "tau"
unit = "cNm"
"""
MCAP_MAP = """
[time]
column = "log_time"
unit = "ns"
[position]
column = "/joints:position"
[velocity]
column = "/joints:velocity"
[torque]
column = "/torques:data.joint{}"
first = 1
unit = "mNm"
[label]
column = "/torques:touched"
"""


@pytest.fixture(scope="module")
def table(seed: int) -> Table:
    """Columns by the default names."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    columns = {"time": np.arange(ROWS) * 0.004}
    for name in ("q", "dq", "tau_J"):
        columns |= {f"{name}{joint}": rng.uniform(-2, 2, ROWS) for joint in range(N)}
    columns["label"] = (np.arange(ROWS) > 200).astype(float)
    return columns


def stacked(table: Table, name: str) -> np.ndarray:
    return np.stack([table[f"{name}{joint}"] for joint in range(N)], axis=1)


def other(table: Table) -> Table:
    """The same readings as OTHER_MAP names them."""
    names = ["base", "shoulder", "upper", "elbow", "lower", "wrist", "hand"]
    signs = [1, 1, -1, 1, 1, 1, -1]
    return {
        "stamp": table["time"] * 1e3 + 17.0,
        **{f"A{joint + 1}_deg": np.rad2deg(table[f"q{joint}"]) * signs[joint] for joint in range(N)},
        **{f"A{joint + 1}_speed": table[f"dq{joint}"] * 1e3 for joint in range(N)},
        **{names[joint]: table[f"tau_J{joint}"] * -1e3 for joint in range(N)},
        "touched": table["label"],
    }


def lists(table: Table) -> Table:
    """The same readings as LIST_MAP names them."""
    q, dq, tau = (stacked(table, name) for name in ("q", "dq", "tau_J"))
    return {"time": table["time"], "q": q, "dq": dq, "tau": tau * 100, "label": table["label"]}


def write_csv(path: Path, table: Table) -> Path:
    rows = np.stack(list(table.values()), axis=1).tolist()
    text = "\n".join([",".join(table), *(",".join(map(repr, row)) for row in rows)]) + "\n"
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())
    return path


def write_npz(path: Path, table: Table) -> Path:
    np.savez(path, **table)
    return path


def write_parquet(path: Path, table: Table) -> Path:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {name: values.tolist() for name, values in table.items()}
    parquet.write_table(pyarrow.table(columns), path, row_group_size=50)
    return path


def write_mcap(path: Path, table: Table, *, encoding: str = "json") -> Path:
    """As MCAP_MAP names it; torques come first, 1 us earlier."""
    writer_module = pytest.importorskip("mcap.writer")
    with path.open("wb") as file:
        writer = writer_module.Writer(file, chunk_size=4096)
        writer.start()
        schema = writer.register_schema("joints", "jsonschema", b"{}")
        torques = writer.register_channel("/torques", encoding, schema)
        joints = writer.register_channel("/joints", encoding, schema)
        others = writer.register_channel("/camera", "cdr", schema)
        for row in range(ROWS):
            stamp = 1_700_000_000_000_000_000 + round(table["time"][row] * 1e9)
            torque = {f"joint{joint + 1}": table[f"tau_J{joint}"][row] * 1e3 for joint in range(N)}
            touched = bool(table["label"][row])
            position, velocity = stacked(table, "q")[row].tolist(), stacked(table, "dq")[row].tolist()
            for channel, at, content in (
                (torques, stamp - 1000, {"data": torque, "touched": touched}),
                (joints, stamp, {"position": position, "velocity": velocity}),
            ):
                writer.add_message(channel, at, json.dumps(content).encode(), at)
            writer.add_message(others, stamp, b"\x00\x01", stamp)
        writer.finish()
    return path


def mapped(folder: Path, text: str) -> Path:
    path = folder / "map.toml"
    path.write_text(text)
    return path


def assert_same(recording: Recording, table: Table) -> None:
    np.testing.assert_allclose(recording.time_s, table["time"], atol=1e-7)
    for values, name in ((recording.q, "q"), (recording.qd, "dq"), (recording.tau, "tau_J")):
        np.testing.assert_allclose(values, stacked(table, name), rtol=1e-12)
    assert recording.touched is not None
    np.testing.assert_array_equal(recording.touched, table["label"] != 0)
    assert recording.damage is None


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".npz", ".parquet"])
@pytest.mark.parametrize("named", ["default", "other"])
def test_every_format_holds_the_same_readings_under_any_names_units_and_signs(
    tmp_path: Path, table: Table, suffix: str, named: str
) -> None:
    write = {".npz": write_npz, ".parquet": write_parquet}.get(suffix, write_csv)
    path = write(tmp_path / f"x{suffix}", table if named == "default" else other(table))
    map_file = None if named == "default" else mapped(tmp_path, OTHER_MAP)
    recording = read_recording(path, N, map_file)
    assert_same(recording, table)
    assert recording.name == "x"
    assert recording.period_us == 4000


@pytest.mark.parametrize("suffix", [".npz", ".parquet"])
def test_a_column_may_hold_a_list_with_a_value_for_each_joint(tmp_path: Path, table: Table, suffix: str) -> None:
    write = {".npz": write_npz, ".parquet": write_parquet}[suffix]
    path = write(tmp_path / f"x{suffix}", lists(table))
    assert_same(read_recording(path, N, mapped(tmp_path, LIST_MAP)), table)


def test_topics_of_an_mcap_become_rows_of_the_positions_topic(tmp_path: Path, table: Table) -> None:
    assert_same(read_recording(write_mcap(tmp_path / "x.mcap", table), N, mapped(tmp_path, MCAP_MAP)), table)


def test_a_missing_label_column_means_no_labels(tmp_path: Path, table: Table) -> None:
    bare = {name: values for name, values in table.items() if name != "label"}
    for path in (write_csv(tmp_path / "x.csv", bare), write_npz(tmp_path / "x.npz", bare)):
        assert read_recording(path, N).touched is None
    with pytest.raises(InputError, match="no column 'label'"):
        read_recording(tmp_path / "x.csv", N, mapped(tmp_path, '[label]\ncolumn = "label"'))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[position]\nunit = 'inch'", "position.unit: should be 'rad', 'mrad' or 'deg'"),
        ("[position]\ncolum = 'x{}'", "position.colum: unknown key (did you mean 'column'?)"),
        ("[position]\nsign = [1, 1]", "position.sign: 2 signs for 7 joints"),
        ("[position]\nsign = 2", "position.sign"),
        ("[torque]\ncolumns = ['a', 'b']", "torque.columns: 2 names for 7 joints"),
        ("[torque]\ncolumns = ['a']\ncolumn = 'b'", "torque: must have either column or columns"),
        ("[torque]\ncolumn = 'a{}{}'", "torque.column: has room for one joint number only"),
        ("[speed]\nunit = 'deg'", "speed: unknown key"),
        ("[position", "not TOML"),
    ],
)
def test_a_mistake_in_a_map_gives_one_line_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    path = mapped(tmp_path, text)
    with pytest.raises(InputError) as error:
        column_map(N, path)
    assert str(error.value).startswith(str(path))
    assert message in str(error.value)


def without(table: Table, name: str) -> Table:
    return {key: values for key, values in table.items() if key != name}


def test_a_missing_column_is_named(tmp_path: Path, table: Table) -> None:
    writers = {".csv": write_csv, ".csv.gz": write_csv, ".npz": write_npz, ".parquet": write_parquet}
    for suffix, write in writers.items():
        with pytest.raises(InputError, match=rf"x{suffix}: no (column|array) 'dq3', which this arm needs"):
            read_recording(write(tmp_path / f"x{suffix}", without(table, "dq3")), N)
    path = write_mcap(tmp_path / "x.mcap", table)
    for old, new, message in (
        ("/torques:data.joint{}", "/torques:data.axis{}", r"no field 'data\.axis1' in a message on '/torques'"),
        ("/torques:data.joint{}", "/none:joint{}", "no message on the topic '/none'"),
        ("/torques:data.joint{}", "/camera:joint{}", "'/camera' is in cdr, and neither in JSON nor"),
        ("/torques:data.joint{}", "joint{}", "column 'joint1' has no topic"),
        ("/torques:data.joint{}", "/torques:data", "does not hold 7 values"),
    ):
        with pytest.raises(InputError, match=message):
            read_recording(path, N, mapped(tmp_path, MCAP_MAP.replace(old, new)))


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".parquet"])
def test_a_value_that_is_not_finite_ends_the_recording_at_its_row(tmp_path: Path, table: Table, suffix: str) -> None:
    broken = {name: values.copy() for name, values in table.items()}
    broken["tau_J4"][120] = np.nan
    write = {".csv": write_csv, ".npz": write_npz, ".parquet": write_parquet}[suffix]
    recording = read_recording(write(tmp_path / f"x{suffix}", broken), N)
    place = ":122: " if suffix == ".csv" else ": row 121: "
    assert recording.damage == f"{tmp_path / f'x{suffix}'}{place}tau_J4 is not finite"
    np.testing.assert_array_equal(recording.time_s, table["time"][:120])
    assert recording.touched is not None
    assert recording.touched.shape == (120,)


def test_an_empty_cell_is_a_missing_value(tmp_path: Path, table: Table) -> None:
    path = write_csv(tmp_path / "x.csv", table)
    lines = path.read_text().splitlines()
    lines[50] = lines[50].partition(",")[0] + "," + lines[50].partition(",")[2].partition(",")[2].join([",", ""])
    path.write_text("\n".join(lines))
    recording = read_recording(path, N)
    assert recording.damage == f"{path}:51: a value is missing"
    assert len(recording.time_s) == 49


def test_damage_after_the_first_block_neither_loses_nor_repeats_rows(tmp_path: Path) -> None:
    rows = 10_000
    long = {
        name: np.arange(rows) * 1e-3 for name in ("time", *(f"{k}{j}" for k in ("q", "dq", "tau_J") for j in range(N)))
    }
    path = write_csv(tmp_path / "x.csv", long)
    for bad in (4097, 5000, 8193, 9999):
        lines = path.read_text().splitlines()
        lines[bad] = lines[bad].replace(",", ",x", 1)
        (tmp_path / "bad.csv").write_text("\n".join(lines))
        recording = read_recording(tmp_path / "bad.csv", N)
        assert f"bad.csv:{bad + 1}: 'x" in str(recording.damage)
        np.testing.assert_array_equal(recording.time_s, long["time"][: bad - 1])


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def test_a_cut_gzip_is_read_up_to_the_cut(tmp_path: Path, table: Table) -> None:
    path = write_csv(tmp_path / "x.csv.gz", table)
    size = path.stat().st_size
    cut(path)
    recording = read_recording(path, N)
    print(recording.damage)
    assert "cannot be read on at byte " in str(recording.damage)
    assert int(str(recording.damage).partition("at byte ")[2].partition(":")[0]) <= size // 2
    assert 50 < len(recording.time_s) < ROWS
    np.testing.assert_array_equal(recording.q, stacked(table, "q")[: len(recording.q)])


def test_a_cut_mcap_is_read_up_to_the_cut(tmp_path: Path, table: Table) -> None:
    path = write_mcap(tmp_path / "x.mcap", table)
    cut(path)
    recording = read_recording(path, N, mapped(tmp_path, MCAP_MAP))
    print(recording.damage)
    assert f"{path}: byte " in str(recording.damage)
    assert 50 < len(recording.time_s) < ROWS


def test_a_cut_file_whose_directory_is_at_its_end_gives_one_line(tmp_path: Path, table: Table) -> None:
    for path in (write_npz(tmp_path / "x.npz", table), write_parquet(tmp_path / "x.parquet", table)):
        cut(path)
        with pytest.raises(InputError, match=r"not an? \.\w+ file.*or cut"):
            read_recording(path, N)


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".npz", ".parquet", ".mcap", ".xlsx", ""])
@pytest.mark.parametrize("content", [b"", b"Some notes,\nnot a table\n", b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 9])
def test_a_foreign_file_gives_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str, content: bytes
) -> None:
    path = tmp_path / f"x{suffix}"
    path.write_bytes(content)
    arguments = ["replay", "--robot", "panda", "--csv", str(path), "--out", str(tmp_path / "out")]
    assert main([*arguments, "--map", str(mapped(tmp_path, MCAP_MAP if suffix == ".mcap" else ""))]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert str(path) in output.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("suffix", "package", "write"), [(".parquet", "pyarrow", write_parquet), (".mcap", "mcap", write_mcap)]
)
def test_a_missing_package_gives_one_line_that_names_the_extra(
    tmp_path: Path,
    table: Table,
    monkeypatch: pytest.MonkeyPatch,
    suffix: str,
    package: str,
    write: Callable[[Path, Table], Path],
) -> None:
    path = write(tmp_path / f"x{suffix}", table)
    for module in [name for name in sys.modules if name.partition(".")[0] == package]:
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=rf"needs the package {package}, .*pip install 'tauperp\[logs\]'"):
        read_recording(path, N, mapped(tmp_path, MCAP_MAP) if suffix == ".mcap" else None)


def test_a_recording_that_would_not_fit_is_refused(
    tmp_path: Path, table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tauperp.recording.tables.MAX_ROWS", 200)
    with pytest.raises(InputError, match="more than 200 rows; cut it"):
        read_recording(write_csv(tmp_path / "x.csv", table), N)


def test_the_command_scores_the_part_before_the_damage_and_exits_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An arm at rest, in degrees and mNm, with a touch before the line that cannot be read."""
    time = np.arange(0, 3.0, 0.005)
    gravity = Core("panda").terms(POSE, np.zeros(N)).gravity
    rest = {"time": time}
    for name, values in (("q", POSE), ("dq", np.zeros(N)), ("tau_J", gravity)):
        rest |= {f"{name}{joint}": np.full(time.shape, values[joint]) for joint in range(N)}
    rest["label"] = ((time >= 1.5) & (time < 2.0)).astype(float)
    rest["tau_J1"] = rest["tau_J1"] + 5.0 * rest["label"]
    path = write_csv(tmp_path / "x.csv", other(rest))
    arguments = ["replay", "--robot", "panda", "--csv", str(path), "--out", str(tmp_path / "out"), "--json"]
    arguments += ["--map", str(mapped(tmp_path, OTHER_MAP))]
    assert main(arguments) == 0
    capsys.readouterr()
    lines = path.read_text().splitlines()
    lines[500] = "oops"
    path.write_text("\n".join(lines))
    assert main(arguments) == 2
    output = capsys.readouterr()
    assert output.err == f"tauperp: {path}:501: 1 values under 23 column names\n"
    report = json.loads(output.out)
    assert (report["found"], report["alarms_idle"]) == (1, 0)
    assert report["files"][0]["damage"] in output.err
    assert (tmp_path / "out" / "x.png").is_file()
    with pytest.raises(InputError, match=r"no column"):
        read_csv(path, N)
