"""`tauperp monitor`: robot and guard on a bus, live, as text or JSON."""

import argparse
import errno
import functools
import json
import sys
import time
from collections.abc import Callable

import can
from rich.console import Console, Group
from rich.live import Live

from tauperp.bus import BITRATE, DATA_BITRATE, DEFAULT_CHANNEL, DEFAULT_INTERFACE, add_bus_arguments, is_down, open_bus
from tauperp.errors import InputError
from tauperp.monitor import Monitor, Snapshot, compose, report
from tauperp.monitor.events import EventFolder
from tauperp.wire import Wire

HELP = """Show the guard and the robot on a bus: the permission and the reason if there is none, the torques of every
joint and their limits, the last stops, and missing or invalid frames. It only listens. Ctrl-C ends it. Exit code 0 if
a guard was present at the end, 1 if not, 130 after Ctrl-C."""

REDRAW_S = 0.1
ONCE_S = 1.0
PLAIN_WIDTH = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--duration", type=float, metavar="S", help="end after S seconds (with --once: 1)")
    parser.add_argument("--once", action="store_true", help="listen, print the state once, and end")
    parser.add_argument(
        "--json", action="store_true", help="print one line of JSON per second instead of the live view"
    )
    parser.add_argument("--every", type=float, default=1.0, metavar="S", help="seconds between lines of JSON (1)")
    parser.add_argument("--events", metavar="DIR", help="write and draw the trips that the guard has recorded to DIR")
    parser.add_argument(
        "--rate", type=float, metavar="HZ", help="expected cycles per second (classic frames: 500, CAN FD: 1000)"
    )
    add_bus_arguments(parser)
    parser.set_defaults(interface=None, channel=None, bitrate=None, data_bitrate=None)


def run(args: argparse.Namespace) -> int:
    for name in ("duration", "every", "rate"):
        value = getattr(args, name)
        if value is not None and not 0 < value < float("inf"):
            raise InputError(f"monitor: --{name} {value:g} is not a positive number")
    duration = args.duration if args.duration is not None else ONCE_S if args.once else float("inf")
    if not (args.once or args.json or sys.stdout.isatty()):
        raise InputError("monitor: the live view needs a terminal; use --once or --json")
    if not (args.once or args.json) and Console().is_dumb_terminal:
        raise InputError("monitor: this terminal (TERM) cannot show the live view; use --once or --json")
    source = f"{args.interface or DEFAULT_INTERFACE} {args.channel or DEFAULT_CHANNEL}"
    wire = Wire.read()
    events = None if args.events is None else EventFolder(wire, args.events)
    with _open(args) as bus:
        begin = time.monotonic()
        monitor = Monitor(
            wire,
            now_s=begin,
            epoch_s=time.time() - begin,
            rate_hz=args.rate,
            bitrate=args.bitrate or BITRATE,
            data_bitrate=args.data_bitrate or DATA_BITRATE,
        )
        down = functools.partial(is_down, args.interface, args.channel)
        try:
            if args.once:
                last = listen(bus, monitor, begin, duration, duration, lambda snapshot: None, events, down)
                _print(last, source, as_json=args.json)
            elif args.json:
                last = listen(bus, monitor, begin, duration, args.every, _print_line, events, down)
            else:
                last = _watch(bus, monitor, begin, duration, source, events, down)
        except can.CanError as error:  # the bus disappeared: unplugged, shut down
            raise InputError(f"CAN bus {source}: {' '.join(str(error).split())}") from error
    return 0 if last.heard else 1


def _open(args: argparse.Namespace) -> can.BusABC:
    """A bus to listen on. A SocketCAN socket receives CAN FD only on request, and classic frames in any case."""
    return open_bus(args, fd=True) if args.interface == "socketcan" else open_bus(args)


def listen(
    bus: can.BusABC,
    monitor: Monitor,
    begin_s: float,
    duration_s: float,
    every_s: float,
    show: Callable[[Snapshot], None],
    events: EventFolder | None = None,
    down: Callable[[], bool | None] = lambda: None,
) -> Snapshot:
    """Receive frames for `duration_s` and show a snapshot every `every_s`. Returns the last one, shown or not. Recorded
    trips go to `events`. down: whether the interface is down, as far as the system reports it.

    Raises can.CanError if the bus disappears permanently.
    """

    def look(now_s: float) -> Snapshot:
        state = down()
        if state is not None:
            monitor.note_interface(state)
        return monitor.snapshot(now_s)

    end_s, next_s = begin_s + duration_s, begin_s + every_s
    while (now_s := time.monotonic()) < end_s:
        if now_s >= next_s:
            show(look(now_s))
            next_s = max(next_s + every_s, time.monotonic())
        try:
            frame = bus.recv(timeout=max(0.0, min(next_s, end_s) - now_s))
        except can.CanOperationError as error:
            if error.error_code != errno.ENETDOWN:
                raise
            monitor.note_bus_error()  # the interface is down, reported once; when it is up again, its frames return
            continue
        if frame is not None:
            monitor.hear(frame, time.monotonic())
            if events is not None:
                events.hear(frame)
    return look(time.monotonic())


def _watch(
    bus: can.BusABC,
    monitor: Monitor,
    begin_s: float,
    duration_s: float,
    source: str,
    events: EventFolder | None,
    down: Callable[[], bool | None],
) -> Snapshot:
    """The live view, on the terminal's alternate screen, until time or the user ends it."""
    console = Console(highlight=False)

    def picture(snapshot: Snapshot) -> Group:
        width, height = console.size
        return Group(*compose(snapshot, source, width, height))

    first = picture(monitor.snapshot(begin_s))
    with Live(first, console=console, screen=True, auto_refresh=False) as live:
        return listen(
            bus,
            monitor,
            begin_s,
            duration_s,
            REDRAW_S,
            lambda snapshot: live.update(picture(snapshot), refresh=True),
            events,
            down,
        )


def _print(snapshot: Snapshot, source: str, *, as_json: bool) -> None:
    if as_json:
        _print_line(snapshot)
        return
    console = Console(highlight=False)
    width = console.width if console.is_terminal else PLAIN_WIDTH
    for line in compose(snapshot, source, width):
        line.rstrip()
        console.print(line, soft_wrap=True)


def _print_line(snapshot: Snapshot) -> None:
    print(json.dumps(report(snapshot)), flush=True)
