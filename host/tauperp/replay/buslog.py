"""Bus logs in python-can's formats (.blf, candump's .log and others, also with .gz) and in .asc. Damage is detected.

python-can's readers skip lines that they do not understand, and a truncated file ends without a message. A log that
serves as evidence needs more. This reader delivers every frame before the damage, then reports its byte or line. It
counts entries that are not frames.
"""

import gzip
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any, cast

import can
from can.io import MESSAGE_READERS
from can.io.generic import BinaryIOMessageReader, TextIOMessageReader

from tauperp.errors import InputError
from tauperp.replay.asc import BEGIN, END, AscReader
from tauperp.replay.blf import BlfReader

_GZIP_SUFFIX = ".gz"
_MOST_INFLATED = 1032  # largest ratio of inflated to deflated bytes
_SMALLEST_FRAME = 48  # size of the smallest BLF frame object, bytes
_PADDING = 3  # bytes at most between two such objects

_SHOWN = 48  # characters of a line that cannot be read


class _Unreadable(ValueError):
    """Damage with a readable message, unlike the exceptions of a reader that does not expect damage."""


class LogDamage(InputError):
    """The log cannot be read from here on: it is truncated or corrupt."""


class BusLog(Iterator[can.Message]):
    """Every frame, in the order of the file, with its stated data length. Memory: one container of the file.

    channel        only frames of this channel, by its name in the file ("can0", "1"); None: all
    damage         why the frames end before the log does; None without damage
    passed_over    number of lines or objects so far that are not frames
    channels       channels of the frames so far, with their counts

    Raises InputError, before the first frame, if nothing of the file can be read: it is of another kind, or empty.
    """

    def __init__(self, path: str | Path, channel: str | None = None) -> None:
        self.path = Path(path)
        self.channel = channel
        self.damage: LogDamage | None = None
        self.channels: dict[str, int] = {}
        self._passed_over = _PassedOver()
        self._frames = _read(self.path, self._passed_over)

    @property
    def passed_over(self) -> int:
        return self._passed_over.count()

    def __next__(self) -> can.Message:
        try:
            while True:
                frame = next(self._frames)
                name = channel_name(frame)
                self.channels[name] = self.channels.get(name, 0) + 1
                if self.channel is None or name == self.channel:
                    return frame
        except LogDamage as damage:
            self.damage = damage
            raise StopIteration from damage
        except StopIteration:
            if self.channel is not None and self.channel not in self.channels:
                there = ", ".join(sorted(self.channels)) or "none"
                raise InputError(f"{self.path}: no channel '{self.channel}' (it has {there})") from None
            raise


class _PassedOver:
    """Number of entries of a log that are not frames, as the open reader counts them."""

    def __init__(self) -> None:
        self.count: Callable[[], int] = lambda: 0


def channel_name(frame: can.Message) -> str:
    """The name of a logged frame's channel in its file. Vector's formats count from 1, python-can from 0."""
    channel = frame.channel
    return str(channel + 1) if isinstance(channel, int) else str(channel or "-")


def _read(path: Path, passed_over: _PassedOver) -> Iterator[can.Message]:
    reader_type = _reader_type(path)
    try:
        raw = cast(IO[bytes], gzip.open(path) if path.suffix.lower() == _GZIP_SUFFIX else path.open("rb"))  # noqa: SIM115
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error
    with raw:
        if issubclass(reader_type, TextIOMessageReader):
            source: _Lines | _Bytes | Path = _Lines(raw, is_asc=".asc" in path.suffixes)
        elif issubclass(reader_type, BinaryIOMessageReader):
            source = _Bytes(raw, path.stat().st_size)
        else:
            source = path
        yield from _frames(path, reader_type, source, passed_over)


def _reader_type(path: Path) -> Any:
    suffixes = [suffix.lower() for suffix in path.suffixes]
    suffix = "".join(suffixes[-2:-1] if suffixes[-1:] == [_GZIP_SUFFIX] else suffixes[-1:])
    try:
        return MESSAGE_READERS[suffix]
    except KeyError:
        known = " ".join(sorted(MESSAGE_READERS))
        raise InputError(f"{path}: python-can reads no '{suffix}' (it reads {known}); use --csv for a table") from None


def _opened(reader_type: Any, source: "_Lines | _Bytes | Path", passed_over: _PassedOver) -> Any:
    """The reader of the format: python-can's, except for .asc and .blf."""
    if isinstance(source, _Lines) and source.is_asc:
        reader = AscReader(source.readline)
        passed_over.count = lambda: reader.passed_over
        return reader
    if issubclass(reader_type, can.BLFReader):
        blf = BlfReader(source)  # type: ignore[arg-type]
        passed_over.count = lambda: blf.passed_over
        return blf
    return reader_type(source)


def _frames(
    path: Path, reader_type: Any, source: "_Lines | _Bytes | Path", passed_over: _PassedOver
) -> Iterator[can.Message]:
    """The reader's frames. For a broken file python-can's readers raise exceptions of any type."""
    place = source.place if isinstance(source, _Lines | _Bytes) else lambda: "its database"
    count = 0
    try:
        reader = _opened(reader_type, source, passed_over)
        frames = iter(reader)
        while True:
            frame = next(frames, None)
            if frame is None:
                break
            if not (frame.is_error_frame or frame.is_remote_frame) and len(frame.data) != frame.dlc:
                raise _Unreadable(f"{len(frame.data)} data bytes where {frame.dlc} are announced")
            if isinstance(source, _Bytes):
                source.count_frame()
            count += 1
            yield frame
        if isinstance(source, _Bytes):
            source.check_end(getattr(reader, "file_size", 0))
            reader.check_end() if isinstance(reader, BlfReader) else None
        elif isinstance(source, _Lines):
            source.check_end()
    except GeneratorExit:
        raise
    except (ImportError, NotImplementedError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}") from error
    except Exception as error:
        reason = _reason(error, source)
        if count == 0:
            hint = ", as candump -L writes it" if ".log" in path.suffixes else ""
            raise InputError(f"{path}: {place()}: not a {path.suffix} log{hint}: {reason}") from error
        raise LogDamage(f"{path}: {place()}, after {count} frames: {reason}") from error
    if count == 0:
        raise InputError(f"{path}: {place()}: holds no frame")


def _reason(error: Exception, source: "_Lines | _Bytes | Path") -> str:
    if isinstance(source, _Lines) and isinstance(error, IndexError | KeyError | TypeError | ValueError):
        return str(error) if isinstance(error, _Unreadable) or source.is_asc else f"{source.text!r} is not a frame"
    if isinstance(error, struct.error):
        return "the file ends in the middle of its header"
    return " ".join(str(error).split()) or type(error).__name__


class _Lines:
    """A text file for readers of logs. It counts lines, and refuses a truncated line or one that is not text."""

    def __init__(self, raw: IO[bytes], *, is_asc: bool) -> None:
        self.text = ""  # printable start of the newest line
        self._raw = raw
        self.is_asc = is_asc
        self._in_block = False
        self._line = 0

    def place(self) -> str:
        return f"line {max(self._line, 1)}"

    def __iter__(self) -> "_Lines":
        return self

    def __next__(self) -> str:
        self._line += 1
        data = self._raw.readline()
        if not data:
            self._line -= 1
            raise StopIteration
        try:
            line = data.decode("utf-8-sig" if self._line == 1 else "utf-8")
        except UnicodeDecodeError:
            if not self.is_asc:
                raise _Unreadable("not text") from None
            line = data.decode("latin-1")  # the encoding of comments by Windows tools
        if self.is_asc and any(ord(character) < ord(" ") for character in line.strip().replace("\t", " ")):
            raise _Unreadable("not text")
        content = line.strip()
        self.text = content[:_SHOWN]
        mark = content.lower() if self.is_asc else ""
        if not line.endswith("\n") and not mark.startswith(END):
            raise _Unreadable("the file ends in the middle of this line")
        if mark.startswith((BEGIN, END)):
            self._in_block = mark.startswith(BEGIN)
        return line

    def check_end(self) -> None:
        """Call after the last frame. Raises _Unreadable if the file is truncated."""
        if self._in_block:
            raise _Unreadable("the file ends here, without the end of its trigger block")

    def readline(self) -> str:
        return next(self, "")

    def close(self) -> None:
        self._raw.close()

    def read(self) -> str:
        """python-can takes an object with this method as a file. Its text readers read by lines."""
        return "".join(self)


class _Bytes:
    """A binary file for python-can's readers that detects a premature end and returns the data so far, because a
    truncated container still holds frames."""

    def __init__(self, raw: IO[bytes], size: int) -> None:
        self._raw = raw
        self._size = size
        self._at = 0  # offset of the last read
        self._cut: int | None = None
        self._frames_left = 0

    def place(self) -> str:
        return f"byte {self._at if self._cut is None else self._cut}"

    def read(self, length: int = -1) -> bytes:
        if length < 0:
            raise ValueError("an object of negative size")
        if self._cut is not None:
            return b""
        self._at = self._raw.tell()
        data = self._raw.read(length)
        # A file that ends at the start of an object is complete. Padding may be missing there.
        if 0 < len(data) < length or (not data and length > _PADDING and self._at != self._size):
            self._cut = self._at + len(data)
        if length > _PADDING:
            self._frames_left = len(data) * _MOST_INFLATED // _SMALLEST_FRAME
        return data

    def count_frame(self) -> None:
        """Raises ValueError for more frames than fit: python-can reads an object of size 0 again without end."""
        self._frames_left -= 1
        if self._frames_left < 0:
            raise ValueError("an object that ends where it begins")

    def check_end(self, announced: int) -> None:
        """Call after the last frame. announced: the file's size by its header; 0 if unknown."""
        if self._cut is not None:
            raise ValueError("the file ends in the middle of an object")
        if announced > self._size:
            self._at = self._size
            raise ValueError(f"the file ends here, its header announces {announced} bytes")

    def seek(self, offset: int, whence: int = 0) -> int:
        return self._raw.seek(offset, whence)

    def tell(self) -> int:
        return self._raw.tell()

    def close(self) -> None:
        self._raw.close()
