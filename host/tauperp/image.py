"""The identity of a firmware image: the section .tauperp_version of its ELF file (boards/common/identity.h)."""

import dataclasses
import struct
from pathlib import Path

from tauperp.config import NUMERICS, block_crc
from tauperp.errors import InputError

_MAGIC = b"TAUPERP\0"
_FORMAT = 1  # IDENTITY_FORMAT; later ones append fields
_RECORD = struct.Struct("<8s6I16s")
_VARIANT_FORMAT, _VARIANT = 2, struct.Struct("<I")  # appended by it
PRODUCT = "product"
_VARIANTS = (PRODUCT, "lockstep", "emulator")  # guard_variant_t
_VERSION_SECTION = ".tauperp_version"
_BLOCK_SIZE = 8  # offset of a block's size
_CONFIG_SECTION = ".tauperp_config"
_BUILD_ID_SECTION = ".note.gnu.build-id"
_NOTE_HEADER = 16


@dataclasses.dataclass(frozen=True)
class Image:
    """The identity of one image."""

    version: str  # release, major.minor.patch
    build: str  # of the firmware's sources, 8 hex digits; the first 4 are GuardStatus.BuildId
    config_crc: str  # of the configuration block inside, 8 hex digits
    wire_crc: str  # Wire.hash
    numeric: str
    board: str
    variant: str  # variant of the image: product, lockstep, emulator; "not stated" before format 2
    image: str  # the linker's build id of this image; empty without one


def read_image(path: str | Path) -> Image:
    """Raises InputError for a file that is not an ELF file, not a Tauperp image, or holds a block with another CRC."""
    data = Path(path).read_bytes()
    sections = _sections(data, str(path))
    if _VERSION_SECTION not in sections:
        raise InputError(f"{path}: no section {_VERSION_SECTION}: not a Tauperp image")
    record = sections[_VERSION_SECTION]
    if len(record) < _RECORD.size or not record.startswith(_MAGIC):
        raise InputError(f"{path}: the section {_VERSION_SECTION} is damaged")
    _, form, version, build, config, wire, numeric, board = _RECORD.unpack_from(record)
    if form < _FORMAT:
        raise InputError(f"{path}: the section {_VERSION_SECTION} has format {form}")
    blocks = sections.get(_CONFIG_SECTION, b"")
    block = blocks[: int.from_bytes(blocks[_BLOCK_SIZE : _BLOCK_SIZE + 4], "little")]  # the first channel's
    if len(block) < 16 or block_crc(block) != config:
        raise InputError(f"{path}: the configuration block in it is not the one of CRC {config:08x}")
    names = {number: name for name, number in NUMERICS.items()}
    return Image(
        version=f"{version >> 16}.{version >> 8 & 0xFF}.{version & 0xFF}",
        build=f"{build:08x}",
        config_crc=f"{config:08x}",
        wire_crc=f"{wire:08x}",
        numeric=names.get(numeric, f"unknown ({numeric})"),
        board=board.rstrip(b"\0").decode("ascii", "replace"),
        variant=_variant(record) if form >= _VARIANT_FORMAT else "not stated",
        image=sections.get(_BUILD_ID_SECTION, b"")[_NOTE_HEADER:].hex(),
    )


def _variant(record: bytes) -> str:
    if len(record) < _RECORD.size + _VARIANT.size:
        return "not stated"
    (number,) = _VARIANT.unpack_from(record, _RECORD.size)
    return _VARIANTS[number] if number < len(_VARIANTS) else f"unknown ({number})"


def _sections(data: bytes, path: str) -> dict[str, bytes]:
    """Sections of a little-endian 32-bit ELF file by their names (ELF specification 1.2, chapter 1)."""
    if data[:4] != b"\x7fELF":
        raise InputError(f"{path}: not an ELF file")
    if data[4:6] != b"\x01\x01":
        raise InputError(f"{path}: not a 32-bit little-endian ELF file")
    try:
        (table,) = struct.unpack_from("<I", data, 32)
        size, count, names = struct.unpack_from("<3H", data, 46)
        headers = [struct.unpack_from("<6I", data, table + number * size) for number in range(count)]
        text = data[headers[names][4] : headers[names][4] + headers[names][5]]
        return {
            text[header[0] : text.index(b"\0", header[0])].decode("ascii"): data[header[4] : header[4] + header[5]]
            for header in headers
            if header[1] != 8  # NOBITS: nothing in the file
        }
    except (struct.error, IndexError, ValueError) as error:
        raise InputError(f"{path}: a damaged ELF file") from error
