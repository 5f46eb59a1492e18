"""`tauperp guard`: the firmware as a node on a CAN bus."""

import argparse
import json
import os
import signal
import sys
import time
from typing import NoReturn

import can

from tauperp.bus import OwnFrames, add_bus_arguments, open_bus, refuse_bit_rates
from tauperp.config import Configuration, load_configuration
from tauperp.errors import InputError
from tauperp.files import build_dir, how_to_build
from tauperp.firmware import Guard, Reason, Schedule, Start, Variant, Verdict
from tauperp.monitor.events import EventFolder
from tauperp.robot.options import add_robot_arguments, chain_of, say_warnings

HELP = """Run the guard on a CAN bus. On SocketCAN this is the native process (build/tauperp-guard). On any other
interface of python-can it is the firmware's library in real time, as fast as Python allows. On SIGTERM or Ctrl-C it
sends a last StopCommand without permission and ends."""

NATIVE = "socketcan"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("config", metavar="CONFIG", nargs="?", default="default", help="TOML file or shipped preset")
    add_robot_arguments(parser, "the configuration's")
    parser.add_argument("--lockstep", action="store_true", help="guard time is bus time (for simulated robots)")
    parser.add_argument(
        "--channels", type=int, choices=(1, 2), default=2, help="independent computations that must agree (default: 2)"
    )
    parser.add_argument("--priority", metavar="N", help="SCHED_FIFO priority, 0: none (SocketCAN only)")
    parser.add_argument(
        "--verbose", action="store_true", help="also print a line of counters per second (SocketCAN only)"
    )
    parser.add_argument("--events", metavar="DIR", help="write and draw each recorded trip to DIR (real time only)")
    parser.add_argument("--json", action="store_true", help="print one JSON object per line instead of text")
    add_bus_arguments(parser)


def run(args: argparse.Namespace) -> int:
    refuse_bit_rates(args)
    configuration = load_configuration(args.config, robot=args.robot, chain=chain_of(args))
    say_warnings(configuration.robot)
    _check_bus(args)
    if args.events is not None and args.lockstep:
        raise InputError("--events: trips are recorded in real time only, without --lockstep")
    if getattr(args, "interface", None) == NATIVE:
        _become_native(args, configuration)
    for option in ("priority", "verbose"):
        if getattr(args, option):
            raise InputError(f"--{option} needs the native process: --interface {NATIVE}")
    with open_bus(args, fd=configuration.settings.wire.format == "fd") as bus:
        _Node(bus, configuration, args.channels, args.json, args.lockstep, args.events).run()
    return 0


def _check_bus(args: argparse.Namespace) -> None:
    """Raises InputError without a bus: no other node could reach a virtual bus of this process."""
    if getattr(args, "interface", None) or getattr(args, "channel", None):
        return
    command = f"tauperp guard {args.config}" + (f" --robot {args.robot}" if args.robot else "")
    raise InputError(
        f"guard: name the bus, for example: {command} --interface {NATIVE} --channel can0"
        f" (between processes without a bus: --interface udp_multicast)"
    )


def _become_native(args: argparse.Namespace, configuration: Configuration) -> NoReturn:
    """This process becomes build/tauperp-guard, with the block in memory instead of in a file."""
    program = build_dir() / "tauperp-guard"
    channel = getattr(args, "channel", None)
    if not channel:
        raise InputError(f"--channel is missing: the network interface, with --interface {NATIVE}")
    if not program.is_file():
        raise InputError(f"{program} is missing; {how_to_build('guard')}")
    if args.events is not None:
        _listen_for_events(channel, configuration, args.events)
    memory = os.memfd_create("block", 0)  # without close-on-exec: the program reads it
    os.write(memory, configuration.block() + (configuration.second_block(args.channels) or b""))
    command = [str(program), "--channel", channel, "--robot", configuration.robot.name]
    command += ["--config", f"/proc/self/fd/{memory}"]
    command += [f"--{option}" for option in ("lockstep", "verbose", "json") if getattr(args, option)]
    if args.priority is not None:
        command += ["--priority", args.priority]
    os.execv(program, command)


def _listen_for_events(channel: str, configuration: Configuration, folder: str) -> None:
    """A child process that receives the bus and writes the events of the native process until that process ends."""
    parent = os.getpid()
    if os.fork() != 0:
        return
    code = 0
    try:
        events = EventFolder(configuration.wire, folder)
        with can.Bus(interface=NATIVE, channel=channel, fd=True) as bus:
            while os.getppid() == parent:
                frame = bus.recv(timeout=0.5)
                if frame is not None:
                    events.hear(frame)
    except (can.CanError, OSError) as error:
        print(f"tauperp: --events: {error}", file=sys.stderr)
        code = 1
    except KeyboardInterrupt:
        code = 0
    os._exit(code)


class _Node:
    """The library's guard, ticked by this machine's monotonic clock as firmware/schedule determines."""

    def __init__(
        self,
        bus: can.BusABC,
        configuration: Configuration,
        channels: int,
        as_json: bool,
        in_lockstep: bool,
        events: str | None,
    ) -> None:
        self._bus = bus
        variant = Variant.LOCKSTEP if in_lockstep else Variant.PRODUCT
        self._guard = Guard(
            configuration.block(),
            start=Start.COMMANDED,
            variant=variant,
            with_events=not in_lockstep,
            second=configuration.second_block(channels),
        )
        self._events = None if events is None else EventFolder(configuration.wire, events)
        self._schedule = Schedule(self._guard, in_lockstep=in_lockstep, now_us=_now_us())
        self._configuration = configuration
        self._json = as_json
        self._told: tuple[int, int, int] | None = None
        self._ended = False
        self._own = OwnFrames(bus)

    def run(self) -> None:
        """Until SIGTERM or SIGINT."""
        before = {number: signal.signal(number, self._end) for number in (signal.SIGTERM, signal.SIGINT)}
        try:
            self._tell_start()
            while not self._ended:
                self._hear()
            self._guard.trip(Reason.SHUTDOWN)
            self._answer([self._schedule.tick(_now_us())])
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _end(self, *_: object) -> None:
        self._ended = True

    def _hear(self) -> None:
        """One frame, or a tick that is due without one."""
        left_us = self._schedule.due_us - _now_us()
        frame = self._bus.recv(timeout=left_us * 1e-6) if left_us > 0 else None
        begin_us = _now_us()
        if frame is None:
            verdicts = self._schedule.look(begin_us)
        elif self._own.has(frame):
            return
        else:
            verdicts = self._schedule.receive(frame, begin_us)
        if verdicts and not self._schedule.in_lockstep:  # in lockstep a tick takes no time
            self._guard.note_tick_time(_now_us() - begin_us)
        self._answer(verdicts)

    def _answer(self, verdicts: list[Verdict]) -> None:
        for verdict in verdicts:
            try:
                for frame in verdict.frames:
                    self._bus.send(frame)
                    self._own.note(frame)
                    if self._events is not None:
                        self._events.hear(frame)
            except can.CanOperationError:
                self._guard.trip(Reason.BUS_DOWN)
            self._tell(verdict)

    def _tell_start(self) -> None:
        block, robot = f"{self._configuration.crc():08x}", self._configuration.robot.name
        wire = f"{self._configuration.wire.crc:08x}"
        if self._json:
            print(json.dumps({"event": "start", "config_crc": block, "wire_crc": wire, "robot": robot}), flush=True)
        else:
            print(f"configuration {block}, wire {wire}, {robot}, on {self._bus.channel_info}", flush=True)

    def _tell(self, verdict: Verdict) -> None:
        """Changes of state."""
        told = (verdict.state, verdict.reason if verdict.state.name != "WAITING" else 0, verdict.trip_number)
        if told == self._told:
            return
        self._told = told
        state, reason = verdict.state.name, verdict.reason.name
        if self._json:
            line = {"event": "state", "state": state, "reason": reason, "permitted": verdict.permitted}
            print(json.dumps({**line, "trip": verdict.trip_number, "joint": verdict.joint}), flush=True)
        else:
            joint = f", joint {verdict.joint}" if verdict.joint and not verdict.permitted else ""
            print(f"{state}{'' if verdict.permitted else f': {reason}{joint}'}, trip {verdict.trip_number}", flush=True)


def _now_us() -> int:
    return time.monotonic_ns() // 1000
