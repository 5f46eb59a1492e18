"""`make firmware`: any board with any robot, and mistakes are reported before the build; `tauperp version` on the
images, and GuardStatus of the guard in them."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT, make, rows

from tauperp.config import load_configuration
from tauperp.firmware import Guard
from tauperp.image import Image, read_image
from tauperp.robot import shipped
from tauperp.wire import Receiver

pytestmark = pytest.mark.needs("arm")


def image_of(name: str, *arguments: str) -> tuple[Path, Image]:
    place = f"build/target/{name}.elf"
    make("firmware", f"IMAGE={place}", *arguments)
    return ROOT / place, read_image(ROOT / place)


@pytest.mark.parametrize("numeric", ["float", "fixed"])
@pytest.mark.parametrize("board", rows("board"))
def test_every_board_works_with_every_robot(board: str, numeric: str) -> None:
    for robot in shipped():
        configuration = load_configuration("default", robot=robot)
        kind = "float32" if numeric == "float" else "q9.22"
        _, image = image_of(f"{board}-{robot}-{numeric}", f"BOARD={board}", f"ROBOT={robot}", f"NUMERIC={numeric}")
        assert (image.board, image.numeric) == (board, kind)
        assert image.config_crc == f"{configuration.crc(kind):08x}"
        assert image.wire_crc == configuration.wire.hash


@pytest.mark.parametrize(
    ("flags", "variant", "in_memory"),
    [
        ([], "product", False),
        (["EMULATOR=1"], "emulator", True),
        (["LOCKSTEP=1"], "lockstep", False),
        (["LOCKSTEP=1", "EMULATOR=1"], "lockstep", True),
    ],
)
def test_the_product_image_is_the_default_and_any_other_states_its_purpose(
    flags: list[str], variant: str, in_memory: bool
) -> None:
    """The emulator has no registers for pin and watchdog. Its image uses words in memory instead."""
    place, image = image_of(f"variant-{variant}-{in_memory}", "BOARD=versal_r5", *flags)
    names = subprocess.run(["arm-none-eabi-nm", place], capture_output=True, text=True, check=True).stdout
    assert image.variant == variant
    assert ("output_words" in names) == in_memory


def test_a_stm32g4_image_with_two_channels_fits_into_96_kib_of_flash() -> None:
    place, _ = image_of("stm32g4-two", "BOARD=stm32g4", "CHANNELS=2")
    sizes = subprocess.run(["arm-none-eabi-size", place], capture_output=True, text=True, check=True).stdout
    text, data = sizes.splitlines()[1].split()[:2]
    assert int(text) + int(data) <= 96 * 1024


CMAKE = Path(sys.executable).parent / "cmake"
LINKED = ["boards/versal_r5/versal_r5.ld", "boards/versal_r5/startup.S", "boards/common/loop.c", "schedule/schedule.c"]


@pytest.mark.parametrize("source", LINKED)
def test_the_build_id_covers_everything_that_is_linked(source: str, tmp_path: Path) -> None:
    """An additional comment gives another build id."""
    shutil.copytree(ROOT / "firmware", tmp_path / "firmware")
    header = tmp_path / "build_id.h"

    def build() -> str:
        script = tmp_path / "firmware" / "cmake" / "build_id.cmake"
        definitions = [f"-DFIRMWARE={tmp_path / 'firmware'}", f"-DOUTPUT={header}"]
        subprocess.run([CMAKE, *definitions, "-P", script], check=True, capture_output=True)
        return header.read_text()

    before = build()
    with open(tmp_path / "firmware" / source, "a", encoding="utf-8") as file:
        file.write("/* */\n")
    assert build() != before


def test_a_users_configuration_becomes_an_image_with_its_name(tmp_path: Path) -> None:
    cell = tmp_path / "my_cell.toml"
    cell.write_text('robot = "panda"\npreset = "paper"\n[task.none]\nthreshold_nm = 1.7\n')
    make("firmware", "BOARD=stm32g4", f"CONFIG={cell}")
    image = read_image(ROOT / "build" / "firmware" / "stm32g4-my_cell.elf")
    assert image.config_crc == f"{load_configuration(cell).crc():08x}"


def test_an_image_and_its_guard_on_the_bus_state_the_same_identity() -> None:
    """With the library, because the image's answers have the same bits."""
    _, image = image_of("said", "BOARD=versal_r5", "ROBOT=kinova3")
    configuration = load_configuration("default", robot="kinova3")
    guard, receiver = Guard(configuration.block()), Receiver(configuration.wire)
    said: dict[str, float] = {}
    for number in range(40):
        for frame in guard.tick(number * 1000).frames:
            received = receiver.receive(frame)
            assert received is not None
            said |= received.signals if received.message.name == "GuardStatus" else {}
    major, minor, _ = map(int, image.version.split("."))
    assert int(said["FirmwareVersion"]) == major << 8 | minor
    assert int(said["BuildId"]) == int(image.build, 16) >> 16
    assert int(said["ConfigCrc"]) == int(image.config_crc, 16)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["BOARD=nucleo"], "there is no board nucleo: versal_r5 stm32g4"),
        (["BOARD="], "board: one of versal_r5 stm32g4"),
        (["NUMERIC=double"], "there is no numeric type double: float fixed"),
        (["ROBOT=pandas"], "pandas: no such file, and no shipped robot"),
        (["CONFIG=nowhere.toml"], "nowhere.toml: No such file"),
        (["BLOCK=nowhere.bin"], "nowhere.bin: no such block"),
    ],
)
def test_an_unknown_name_gives_one_line_before_the_build(arguments: list[str], words: str) -> None:
    done = subprocess.run(
        ["make", "-C", str(ROOT), "--no-print-directory", "firmware", "IMAGE=build/target/never.elf", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    said = [line for line in done.stderr.splitlines() if not line.endswith(": firmware] Error 2")]
    assert len(said) == 1
    assert words in said[0]
    assert done.stdout == ""
    assert not (ROOT / "build" / "target" / "never.block").exists()


def test_there_is_one_board_to_flash() -> None:
    done = subprocess.run(
        ["make", "-C", str(ROOT), "flash", "BOARD=versal_r5"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "there is no board to flash versal_r5: stm32g4" in done.stderr


@pytest.mark.parametrize(
    ("tool", "words"),
    [
        ("openocd", "-c program build/firmware/stm32g4-panda.elf verify reset exit"),
        ("st-flash", "write build/firmware/stm32g4-panda.bin 0x08000000"),
    ],
)
def test_an_image_is_flashed_by_the_installed_tool(tool: str, words: str, tmp_path: Path) -> None:
    """With a tool that only prints its arguments."""
    stub = tmp_path / tool
    stub.write_text('#!/bin/sh\necho "asked: $*"\n')
    stub.chmod(0o755)
    here = "/usr/local/bin:/usr/bin:/bin"
    if tool != "openocd" and shutil.which("openocd", path=here):
        pytest.skip("optional: openocd is installed and comes first")
    done = subprocess.run(
        ["make", "-C", str(ROOT), "flash", "BOARD=stm32g4", "ROBOT=panda"],
        capture_output=True,
        text=True,
        env={"PATH": f"{tmp_path}:{here}", "HOME": str(tmp_path)},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    asked = next(line for line in done.stdout.splitlines() if line.startswith("asked: "))
    assert words in asked
