"""`tauperp version`: the identity of an image, and refusal of every file without one."""

import struct
from pathlib import Path

import pytest

from tauperp.cli import main
from tauperp.errors import InputError
from tauperp.image import read_image

RECORD = struct.pack("<8s6I16s", b"TAUPERP\0", 1, 0x000102, 0xAABBCCDD, 0x11223344, 0x55667788, 1, b"some_board")
BLOCK = struct.pack("<4I", 0x50524554, 1, 916, 0x11223344) + bytes(900)
NOTE = bytes(16) + bytes.fromhex("0123456789")


def elf(sections: dict[str, bytes]) -> bytes:
    """An ELF file with only these sections."""
    contents = {"": b"", **sections, ".shstrtab": b""}
    names = b"".join(name.encode() + b"\0" for name in contents)
    contents[".shstrtab"] = names
    body, headers, at = b"", b"", 52
    for name, data in contents.items():
        place = 0 if not name else names.index(b"\0" + name.encode() + b"\0") + 1
        headers += struct.pack("<10I", place, 1 if name else 0, 0, 0, at + len(body), len(data), 0, 0, 1, 0)
        body += data
    count = len(contents)
    header = b"\x7fELF\x01\x01\x01" + bytes(9)
    header += struct.pack("<2H5I6H", 2, 40, 1, 0, 0, 52 + len(body), 0, 52, 0, 0, 40, count, count - 1)
    return header + body + headers


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


GOOD = {".tauperp_version": RECORD, ".tauperp_config": BLOCK, ".note.gnu.build-id": NOTE}


def test_an_image_states_its_identity(tmp_path: Path) -> None:
    image = read_image(write(tmp_path / "good.elf", elf(GOOD)))
    assert (image.version, image.build, image.config_crc) == ("0.1.2", "aabbccdd", "11223344")
    assert (image.wire_crc, image.numeric, image.board, image.image) == (
        "55667788",
        "float32",
        "some_board",
        "0123456789",
    )


@pytest.mark.parametrize(("number", "variant"), [(0, "product"), (1, "lockstep"), (2, "emulator"), (9, "unknown (9)")])
def test_an_image_states_its_purpose(
    number: int, variant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = struct.pack("<8sI", b"TAUPERP\0", 2) + RECORD[12:] + struct.pack("<I", number)
    file = write(tmp_path / "variant.elf", elf({**GOOD, ".tauperp_version": record}))
    assert read_image(file).variant == variant
    assert main(["version", str(file)]) == 0
    assert ("not for a robot" in capsys.readouterr().out) == (number != 0)


def test_an_image_of_the_first_format_states_no_purpose(tmp_path: Path) -> None:
    assert read_image(write(tmp_path / "first.elf", elf(GOOD))).variant == "not stated"


def test_fields_appended_by_a_later_format_are_ignored(tmp_path: Path) -> None:
    later = struct.pack("<8sI", b"TAUPERP\0", 2) + RECORD[12:] + bytes(8)
    assert read_image(write(tmp_path / "later.elf", elf({**GOOD, ".tauperp_version": later}))).version == "0.1.2"


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "not an ELF file"),
        (b"#!/bin/sh\n", "not an ELF file"),
        (b"\x7fELF\x02\x01" + bytes(60), "not a 32-bit little-endian"),
        (elf(GOOD)[:-30], "damaged ELF file"),
        (elf({}), "no section .tauperp_version"),
        (elf({**GOOD, ".tauperp_version": RECORD[:-1]}), "is damaged"),
        (elf({**GOOD, ".tauperp_version": bytes(48)}), "is damaged"),
        (elf({**GOOD, ".tauperp_config": BLOCK[:12] + bytes(904)}), "not the one of CRC 11223344"),
        (elf({**GOOD, ".tauperp_config": b""}), "not the one of CRC 11223344"),
    ],
)
def test_a_file_that_is_not_an_image_is_refused_with_the_reason(tmp_path: Path, data: bytes, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_image(write(tmp_path / "bad.elf", data))


def test_the_command_prints_it_and_refuses_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["version", str(write(tmp_path / "good.elf", elf(GOOD)))]) == 0
    assert "build aabbccdd, configuration 11223344" in capsys.readouterr().out
    assert main(["version", str(tmp_path / "none.elf")]) == 2
    assert "none.elf" in capsys.readouterr().err
