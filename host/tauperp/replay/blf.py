"""Vector's .blf: python-can's reader, extended to read or report the parts that it skips.

Objects outside the containers are read like those inside. For a later header version the length in the header counts.
Unreadable parts (a container with another compression, a truncated object) are an error.
"""

import struct
from collections.abc import Generator, Iterator

import can
from can.io.blf import (
    CAN_ERROR_EXT,
    CAN_FD_MESSAGE,
    CAN_FD_MESSAGE_64,
    CAN_MESSAGE,
    CAN_MESSAGE2,
    LOG_CONTAINER,
    LOG_CONTAINER_STRUCT,
    NO_COMPRESSION,
    OBJ_HEADER_BASE_STRUCT,
    ZLIB_DEFLATE,
)

_FRAMES = (CAN_MESSAGE, CAN_MESSAGE2, CAN_ERROR_EXT, CAN_FD_MESSAGE, CAN_FD_MESSAGE_64)
_VERSION_BY_LENGTH = {32: 1, 40: 2}  # of the object header, bytes: both have the time stamp at byte 24
_VERSION = struct.Struct("<H")
_VERSION_AT = 6
_SIGNATURE = b"LOBJ"
_PADDING = 8  # bytes at most between two objects


class BlfReader(can.BLFReader):
    """python-can's reader; passed_over counts objects that are not frames. Raises ValueError for damage."""

    passed_over = 0
    _unreadable: str | None = None

    def __iter__(self) -> Generator[can.Message, None, None]:
        while header := self.file.read(OBJ_HEADER_BASE_STRUCT.size):
            signature, _, _, size, kind = OBJ_HEADER_BASE_STRUCT.unpack(header)
            if signature != _SIGNATURE:
                raise ValueError("no object begins here")
            body = self.file.read(size - OBJ_HEADER_BASE_STRUCT.size)
            self.file.read(size % 4)
            if kind != LOG_CONTAINER:
                yield from self._parse_container(header + body)
                continue
            method, _ = LOG_CONTAINER_STRUCT.unpack_from(body)
            if method not in (NO_COMPRESSION, ZLIB_DEFLATE):
                raise ValueError(f"a container that is packed by method {method}")
            yield from self._parse_container(_unpacked(method, body[LOG_CONTAINER_STRUCT.size :]))
        self.stop()

    def _parse_data(self, data: bytes) -> Iterator[can.Message]:
        yield from super()._parse_data(self._readable(data))
        if self._unreadable is not None:
            raise ValueError(self._unreadable)

    def _readable(self, data: bytes) -> bytes:
        """The same objects with header versions that python-can knows. Counts those that are not frames."""
        changed = bytearray(data)
        at = data.find(_SIGNATURE, 0, _PADDING)
        while at >= 0 and at + OBJ_HEADER_BASE_STRUCT.size <= len(data):
            _, header_size, version, size, kind = OBJ_HEADER_BASE_STRUCT.unpack_from(data, at)
            if size < OBJ_HEADER_BASE_STRUCT.size:  # python-can would read it again without end
                self._unreadable = f"an object of {size} bytes"
                return bytes(changed[:at])
            if at + size > len(data):
                break
            if kind not in _FRAMES:
                self.passed_over += 1
            elif version not in (1, 2):
                if header_size not in _VERSION_BY_LENGTH:
                    self._unreadable = f"a frame whose header is {header_size} bytes long"
                    return bytes(changed[:at])
                _VERSION.pack_into(changed, at + _VERSION_AT, _VERSION_BY_LENGTH[header_size])
            at = data.find(_SIGNATURE, at + size, at + size + _PADDING)
        return bytes(changed)

    def check_end(self) -> None:
        """Called after the last frame. Raises ValueError if a part of a truncated object remains."""
        if _SIGNATURE in self._tail:
            raise ValueError("the file ends in the middle of an object")


def _unpacked(method: int, data: bytes) -> bytes:
    if method == NO_COMPRESSION:
        return data
    import zlib

    return zlib.decompressobj().decompress(data)
