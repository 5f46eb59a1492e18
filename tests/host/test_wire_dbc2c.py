"""tools/dbc2c: the committed sources are current, and a DBC from which no firmware can be generated is refused."""

import re
import shutil
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import pytest

from tauperp.errors import InputError
from tauperp.files import repository_root
from tauperp.wire import Wire

TOOL = repository_root() / "tools" / "dbc2c"
GENERATED = ("messages.h", "messages.c", "protocol.h", "protocol.c", "values.h", "values.c")


@pytest.fixture(scope="module")
def dbc2c() -> ModuleType:
    loader = SourceFileLoader("dbc2c", str(TOOL))
    spec = spec_from_loader("dbc2c", loader)
    assert spec is not None
    module = module_from_spec(spec)
    written, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        loader.exec_module(module)
    finally:
        sys.dont_write_bytecode = written
    return module


@pytest.fixture
def checkout(tmp_path: Path, dbc2c: ModuleType, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the committed files that the tool uses as the repository."""
    wire = tmp_path / "firmware" / "wire" / "generated"
    wire.mkdir(parents=True)
    for name in GENERATED:
        shutil.copy(repository_root() / "firmware" / "wire" / "generated" / name, wire)
    host = tmp_path / "host" / "tauperp"
    host.mkdir(parents=True)
    shutil.copy(repository_root() / "host" / "tauperp" / "wire_values.py", host)
    monkeypatch.setattr(dbc2c, "repository_root", lambda: tmp_path)
    return wire


def run(dbc2c: ModuleType, monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["dbc2c", *arguments])
    return dbc2c.main()


def test_the_committed_sources_are_current() -> None:
    done = subprocess.run([sys.executable, TOOL, "--check"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize("name", GENERATED)
def test_a_changed_file_gives_one_line_and_is_not_overwritten(
    dbc2c: ModuleType,
    checkout: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
) -> None:
    edited = (checkout / name).read_text() + "/* edited */\n"
    (checkout / name).write_text(edited)
    assert run(dbc2c, monkeypatch, "--check") == 1
    message = capsys.readouterr().err
    assert f"{name} differs in 1 lines, first: -/* edited */" in message
    assert message.count("\n") == 1
    assert (checkout / name).read_text() == edited


def test_a_missing_file_is_reported_and_then_written(
    dbc2c: ModuleType, checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (checkout / "protocol.c").unlink()
    assert run(dbc2c, monkeypatch, "--check") == 1
    assert run(dbc2c, monkeypatch) == 0
    assert run(dbc2c, monkeypatch, "--check") == 0


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (
            "BO_ 261 JointState5: 8 JOINT5\n SG_ CRC : 0|8@1+ (1,0) [0|255]",
            "BO_ 261 JointState5: 8 JOINT5\n SG_ CRC : 0|8@1+ (1,0) [0|254]",
            "JointState5: its layout is not that of JointState1",
        ),
        ('"MaxDeltaCounter" BO_ 261 4', '"MaxDeltaCounter" BO_ 261 5', "JointState5: its length or E2E limits"),
        ("BO_ 264 JointState8", "BO_ 264 JointState9", "JointState9: joints must be 1 to 8 at consecutive ids"),
        ("SG_ Index3 m2 : 32|16@1-", "SG_ Index3 m2 : 32|16@1+", "GuardIndex: group 2 has another layout than group 0"),
        ("SG_ Index3 m2", "SG_ Index9 m2", "GuardIndex: the signals of group 2 must end in 3"),
        ("(0.00025,0)", "(0.0003,0)", "Velocity: one over its factor must be whole"),
        ("BO_ 16 StopCommand", "BO_ 33 StopCommand", "Sync has the highest priority of the bus"),
        ("Stopped: Collision ", "Stopped: ", "Collision has no class"),
        ("Stopped: Collision ", "Stopped: Collision BusOff ", "BusOff has two classes"),
        ("Stopped: Collision ", "Stopped: Collision Sneeze ", "Sneeze, which is not a reason"),
        ("Stopped: Collision ", "Halted: Collision ", "'Halted', not one of"),
        (' 6 "Collision"', ' 66 "Collision"', "must count from 0 without a gap"),
        (" Timing Start", " Timing", "PageNames has 10 names for 11 pages"),
        (" Timing Start", " Timing Config", "or one name twice"),
    ],
)
def test_a_dbc_from_which_no_firmware_can_be_generated_is_refused(
    dbc2c: ModuleType, tmp_path: Path, old: str, new: str, complaint: str
) -> None:
    text = (repository_root() / "dbc" / "tauperp.dbc").read_text()
    assert old in text
    text = text.replace(old, new)
    if "BO_ 33" in new:
        text = text.replace("BO_ 16 ", "BO_ 33 ").replace("VAL_ 16 ", "VAL_ 33 ").replace("SG_ 16 ", "SG_ 33 ")
    path = tmp_path / "changed.dbc"
    path.write_text(text)
    with pytest.raises(InputError, match=complaint):
        dbc2c.generated(Wire.read(path))


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ('CM_ SG_ 512 ConfigCrc "CRC-32', 'CM_ SG_ 512 ConfigCrc "The CRC-32', True),
        (" GUARD,MONITOR\n SG_ Request", " GUARD\n SG_ Request", True),
        ("Position : 16|16@1-", "Position : 16|15@1-", False),
        ("(0.00025,0)", "(0.0005,0)", False),
        ("BO_ 48 GuardReset", "BO_ 49 GuardReset", False),
        ('"MaxDeltaCounter" BO_ 257 4', '"MaxDeltaCounter" BO_ 257 5', False),
        ('"Collision"', '"Touch"', False),
    ],
)
def test_the_identity_depends_only_on_the_meaning(tmp_path: Path, old: str, new: str, same: bool) -> None:
    """A comment or a receiver can change; a layout, a scaling, an id, a limit, a value's name cannot."""
    text = (repository_root() / "dbc" / "tauperp.dbc").read_text()
    assert old in text
    text = text.replace(old, new)
    if "BO_ 49" in new:
        text = text.replace(" BO_ 48 ", " BO_ 49 ").replace("VAL_ 48 ", "VAL_ 49 ").replace("SG_ 48 ", "SG_ 49 ")
    path = tmp_path / "changed.dbc"
    path.write_text(text)
    assert (Wire.read(path).crc == Wire.read().crc) is same


def unfilled(header: str, sources: str) -> list[str]:
    """Signals that no function sets, of the messages that are packed. CRC and counter are e2e.h's."""
    functions = re.split(r"^}$", sources, flags=re.MULTILINE)
    found = []
    for name in re.findall(r"void tauperp_(\w+)_pack\(", header):
        struct = f"struct tauperp_{name}_t"
        body = re.search(rf"^{struct} {{(.*?)}};", header, re.DOTALL | re.MULTILINE)
        assert body is not None
        filling = "".join(function for function in functions if struct in function)
        filled = set(re.findall(r"(?:\.|->)(\w+) =[^=]", filling)) | {"crc", "counter"}
        found += [f"{name}.{field}" for field in re.findall(r"(\w+)[,;]", body[1]) if field not in filled]
    return found


def test_every_signal_that_the_guard_sends_is_filled() -> None:
    header = (repository_root() / "firmware" / "wire" / "generated" / "messages.h").read_text()
    sources = "".join(file.read_text() for file in (repository_root() / "firmware" / "guard").glob("*.c"))
    assert unfilled(header, sources) == []
    without = sources.replace("message.threshold =", "ignored =").replace("message->event_step =", "ignored =")
    assert unfilled(header, without) == ["guard_index.threshold", "guard_event.event_step"]


def test_the_generated_code_of_the_wire_stays_short() -> None:
    folder = repository_root() / "firmware" / "wire" / "generated"
    assert sum(len((folder / name).read_text().splitlines()) for name in GENERATED) < 700
