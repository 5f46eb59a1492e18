"""A CAN bus by python-can, named on the command line as python-can's own tools name it (`--interface`, `--channel`)."""

import argparse
import logging
from collections import deque
from pathlib import Path
from typing import Any

import can
from can import cli
from can.interfaces.udp_multicast import UdpMulticastBus

from tauperp.errors import InputError

# python-can logs an error that it also raises: one line is enough.
logging.getLogger("can").addHandler(logging.NullHandler())

DEFAULT_INTERFACE = "virtual"
DEFAULT_CHANNEL = "tauperp"
SOCKETCAN = "socketcan"
ECHOES = 64
NETWORK = Path("/sys/class/net")
BITRATE = 1_000_000  # bit/s, classic frames and the arbitration phase of CAN FD
DATA_BITRATE = 5_000_000  # bit/s, the data phase of CAN FD
_HELP = {
    "channel": "channel of the interface, for example can0 or vcan0",
    "interface": "python-can's name of the interface, for example socketcan (default: its configuration files)",
    "bitrate": "bit rate in bit/s, for an interface whose bit rate python-can sets",
    "fd": "use CAN FD",
    "data_bitrate": "bit rate of the data phase of CAN FD in bit/s",
    "timing": "bit timing, for example f_clock=8_000_000 tseg1=5 tseg2=2 sjw=2 brp=2 nof_samples=1",
    "bus_kwargs": "further settings of the interface as KEY=VALUE; python-can's documentation lists them",
}


class OwnFrames:
    """Distinguishes a node's own frames from those of others.

    Without it a guard would take its own answers for those of another guard.

    Most drivers do not return sent frames, or mark them. python-can's multicast bus does neither. For it, the newest
    sent frames are remembered until they return, once each: the frames of two guards that started together have the
    same bits.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._sent: deque[tuple[int, bytes]] | None = deque(maxlen=ECHOES) if isinstance(bus, UdpMulticastBus) else None

    def note(self, frame: can.Message) -> None:
        """Remember a sent frame."""
        if self._sent is not None:
            self._sent.append((frame.arbitration_id, bytes(frame.data)))

    def has(self, frame: can.Message) -> bool:
        """Whether this node sent a received frame."""
        if self._sent is None:
            return not frame.is_rx
        sent = (frame.arbitration_id, bytes(frame.data))
        if sent not in self._sent:
            return False
        self._sent.remove(sent)
        return True


def add_bus_arguments(parser: argparse.ArgumentParser) -> None:
    """Add python-can's arguments that name a bus, with short help."""
    cli.add_bus_arguments(parser)
    for action in parser._actions:
        action.help = _HELP.get(action.dest, action.help)


def is_down(interface: str | None, channel: str | None) -> bool | None:
    """Whether a SocketCAN interface is down (IFF_UP is not set); None where the system does not say."""
    if interface != SOCKETCAN or not channel:
        return None
    try:
        return not int((NETWORK / channel / "flags").read_text(), 16) & 1
    except (OSError, ValueError):
        return None


def refuse_bit_rates(namespace: argparse.Namespace) -> None:
    """Raises InputError for a bit rate on SocketCAN, where it would have no effect: the system sets it there."""
    if getattr(namespace, "interface", None) != SOCKETCAN:
        return
    for name in ("bitrate", "data_bitrate", "timing"):
        if getattr(namespace, name, None) is not None:
            option = name.replace("_", "-")
            raise InputError(f"--{option} has no effect on {SOCKETCAN}: set it with ip link (type can bitrate ...)")


def open_bus(namespace: argparse.Namespace | None = None, **options: Any) -> can.BusABC:
    """Open the bus that the arguments select; by default python-can's virtual bus of this process.

    namespace   result of a parser with add_bus_arguments(); its values override `options`
    options     passed to python-can: interface, channel, fd, receive_own_messages, ...

    For a channel without an interface, python-can reads its configuration files. Raises InputError, one
    line with interface and channel, if there is no such bus, its driver is not installed or it cannot be opened.
    """
    named = {} if namespace is None else {key: value for key, value in vars(namespace).items() if value is not None}
    interface = named.get("interface", options.get("interface"))
    channel = named.get("channel", options.get("channel"))
    if interface is None and channel is None:
        interface = options["interface"] = DEFAULT_INTERFACE
    if interface == DEFAULT_INTERFACE and channel is None:
        channel = options["channel"] = DEFAULT_CHANNEL
    if (
        interface == SOCKETCAN
        and channel is None
        and not can.util.load_config(config={"interface": interface})["channel"]
    ):
        raise InputError(
            f"CAN bus {interface}: --channel is missing: the network interface"
        )  # python-can accepts them all
    try:
        return cli.create_bus_from_namespace(argparse.Namespace(**named), **options)
    except argparse.ArgumentError as error:  # python-can wraps any exception of a driver in it
        cause = error.__cause__
    where = " ".join(str(part) for part in (interface, channel) if part is not None)
    reason = "no interface is given, here or in python-can's configuration" if interface is None else _reason(cause)
    raise InputError(f"CAN bus {where}: {reason}") from cause


def _reason(error: BaseException | None) -> str:
    """A one-line reason for the user."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, can.CanError | OSError | ValueError | ImportError) and str(error):
        return " ".join(str(error).split())
    return f"its driver cannot be used here ({error})"
