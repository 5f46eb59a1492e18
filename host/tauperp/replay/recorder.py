"""Writes a bus log during a run, with python-can's writers.

The file gets its name when it is complete: at the end of the run, or on Ctrl-C with every frame until then. A run that
ends with an error leaves no file.
"""

import errno
import os
import secrets
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import can
from can.io import MESSAGE_WRITERS

from tauperp.errors import InputError

_CARRY_FD = (".asc", ".blf", ".log", ".mf4", ".txt")  # python-can's other formats store a CAN FD frame as a classic one
_GZIP_SUFFIX = ".gz"
_UNPACKED = (".blf", ".db")  # which it does not write through gzip

Listener = Callable[[can.Message], None]


@contextmanager
def bus_recorder(name: str | Path | None, *, fd: bool) -> Iterator[Listener | None]:
    """The recorder of every frame of a run, in the order of the bus; None without a name.

    name    the file; its suffix is the format: .blf, .asc, candump's .log or another of python-can, also with .gz
    fd      the frames are CAN FD's

    Raises InputError, before anything is run, if the format is unknown or cannot hold the frames, the file exists
    already, or cannot be written. Frames keep their time stamps.
    """
    if name is None:
        yield None
        return
    path = Path(name)
    _check(path, fd)
    packed = path.suffix.lower() == _GZIP_SUFFIX
    format_suffix = "".join(path.suffixes[-2 if packed else -1 :])
    beside = path.with_name(f".{secrets.token_hex(8)}{format_suffix}")
    writer = _writer(path, beside)
    try:
        try:
            with _between_frames(writer.on_message_received) as listener:
                yield listener
        except KeyboardInterrupt:
            writer.stop()
            _name(beside, path)
            raise
        except BaseException:
            writer.stop()
            raise
        writer.stop()
        _name(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def _check(path: Path, fd: bool) -> None:
    suffixes = [suffix.lower() for suffix in path.suffixes]
    packed = suffixes[-1:] == [_GZIP_SUFFIX]
    suffix = "".join(suffixes[-2:-1] if packed else suffixes[-1:])
    if suffix not in MESSAGE_WRITERS:
        raise InputError(f"{path}: python-can writes no '{suffix}' (it writes {' '.join(sorted(MESSAGE_WRITERS))})")
    if packed and suffix in _UNPACKED:
        raise InputError(f"{path}: python-can does not pack {suffix}")
    if fd and suffix not in _CARRY_FD:
        raise InputError(f"{path}: {suffix} holds no CAN FD frames; use {', '.join(_CARRY_FD[:3])}")
    if path.exists():
        raise InputError(f"{path}: already exists; a recording never overwrites a file")


def _writer(path: Path, beside: Path) -> can.io.generic.MessageWriter:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return can.Logger(beside)
    except (ImportError, NotImplementedError) as error:  # .mf4 without the package that it needs
        raise InputError(f"{path}: {' '.join(str(error).split())}") from error
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error


def _name(beside: Path, path: Path) -> None:
    """Give the finished file its name, unless another process has used the name meanwhile."""
    try:
        os.link(beside, path)
    except FileExistsError:
        raise InputError(f"{path}: already exists; a recording never overwrites a file") from None
    except OSError as error:
        if error.errno not in (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS):  # no hard links here
            raise
        beside.replace(path)


@contextmanager
def _between_frames(write: Listener) -> Iterator[Listener]:
    """Ctrl-C waits for the frame that is being written, which would be cut otherwise; the second one does not."""
    if threading.current_thread() is not threading.main_thread():
        yield write
        return
    before = signal.getsignal(signal.SIGINT)
    asked = False

    def ask(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True

    def listener(message: can.Message) -> None:
        if asked:
            raise KeyboardInterrupt
        write(message)

    signal.signal(signal.SIGINT, ask)
    try:
        yield listener
    finally:
        signal.signal(signal.SIGINT, before)
