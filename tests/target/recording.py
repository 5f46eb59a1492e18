"""Recordings of the library's guard, for images that must produce the same bits (playback.c has the format)."""

import fcntl
import hashlib
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import numpy as np
from emulator import BUILD

from tauperp.config import TASKS, Configuration, Numeric, load_configuration
from tauperp.experiment import load_experiment
from tauperp.files import build_dir, dbc_path, write_atomically
from tauperp.firmware import Core, Guard, Reason, State, Verdict
from tauperp.judge.judge import DETECTIONS
from tauperp.robot import Robot
from tauperp.robot import shipped as robots
from tauperp.robot.table import make_table
from tauperp.run.lockstep import Lockstep
from tauperp.run.scenario import shipped
from tauperp.run.virtual import LockstepBus
from tauperp.wire import Sender

_START, _AT, _FRAME, TICK, _TICK_TIME, _TRIP, _END = range(1, 8)
_RECORD = struct.Struct("<BBBxI8s")
NOTHING = bytes(8)
SYNC = 0x020


class Recorder:
    """A guard of the library that records all calls and results."""

    def __init__(self) -> None:
        self.records: list[bytes] = []  # every record and every block
        self._crc = 0
        self.ticks = 0
        self.states: Counter[State] = Counter()
        self.reasons: Counter[Reason] = Counter()
        self.resumed = 0  # number of permissions after a stop
        self.changes = 0  # changes of the task
        self.ranks: Counter[tuple[int, int]] = Counter()  # by task and rank, of ticks with a new snapshot
        self._last: Verdict | None = None

    def start(self, block: bytes) -> None:
        """Begin with a new guard."""
        self._add(_START, len(block))
        padded = block.ljust(-(-len(block) // _RECORD.size) * _RECORD.size, b"\0")
        self.records.append(padded)
        self._guard = Guard(block)
        self._last = None

    def at(self, now_us: int) -> None:
        self._now_us = now_us
        self._add(_AT, data=now_us.to_bytes(8, "little"))

    def receive(self, frame: can.Message) -> None:
        flags = frame.is_fd | frame.bitrate_switch << 1 | frame.is_extended_id << 2 | frame.is_remote_frame << 3
        data = bytes(frame.data[:8]).ljust(8, b"\0")
        self.records.append(_RECORD.pack(_FRAME, flags, frame.dlc, frame.arbitration_id, data))
        self._guard.receive(frame, self._now_us)

    def tick(self) -> Verdict:
        verdict = self._guard.tick(self._now_us)
        self._crc = zlib.crc32(words_of(self._guard), self._crc)
        self._add(TICK, self._crc)
        self.ticks += 1
        self.states[verdict.state] += 1
        self.reasons[verdict.reason] += 1
        if verdict.fresh:
            self.ranks[verdict.task, verdict.rank] += 1
        if self._last is not None:
            self.resumed += verdict.permitted and self._last.state == State.STOPPED
            self.changes += verdict.fresh and verdict.task != self._last.task != 0
        self._last = verdict
        return verdict

    def index_of_last(self, message_id: int, before: int) -> int:
        """Index of the last record of such a frame among the first `before` records."""
        head = struct.pack("<I", message_id)
        return max(i for i, record in enumerate(self.records[:before]) if record[0] == _FRAME and record[4:8] == head)

    def check_variety(self, *, singular: bool) -> None:
        """Fails unless the recording contains every state, many reasons and, with `singular`, bases of less than full
        rank."""
        assert set(self.states) == set(State) - {State.UNINITIALISED}, self.states
        assert self.states[State.MONITORING] > 0.01 * self.ticks, self.states
        assert len(self.reasons) >= 12, self.reasons
        assert self.resumed > 3, self.resumed
        for task, full in ((2, 5), (3, 6)):
            ranks = {rank: count for (of, rank), count in self.ranks.items() if of == task}
            assert not ranks or self.changes > 10
            deficient = sum(count for rank, count in ranks.items() if rank < full)
            assert not singular or deficient >= 5, ranks

    def note_tick_time(self, tick_us: int) -> None:
        self._add(_TICK_TIME, tick_us)
        self._guard.note_tick_time(tick_us)

    def trip(self, reason: Reason) -> None:
        self._add(_TRIP, int(reason))
        self._guard.trip(reason)

    def content(self) -> bytes:
        return b"".join(self.records) + _RECORD.pack(_END, 0, 0, self.ticks, NOTHING)

    def _add(self, kind: int, word: int = 0, data: bytes = NOTHING) -> None:
        self.records.append(_RECORD.pack(kind, 0, 0, word, data))


def words_of(guard: Guard) -> bytes:
    """The output of the last tick, as playback.c collects it."""
    out, view = guard._output, guard.library.view
    flags = out.permitted | out.fresh << 1 | out.task << 8 | out.stop_category << 16 | out.joint << 24
    numbers = guard.library.ffi.new("num_t[3]", [out.value_nm, out.threshold_nm, out.smallest_singular])
    words = struct.pack(
        "<6I", out.state, out.reason, flags, out.cycle | out.trip_number << 16, out.rank, out.frame_count
    )
    words += view(numbers).tobytes() + view(out.residual).tobytes() + view(out.index).tobytes()
    for frame in out.frame:
        words += struct.pack("<2I", frame.id, frame.length | frame.flags << 8) + bytes(frame.data)
    return words


def _kept(name: str, made_of: bytes, numeric: Numeric, make: Callable[[], Recorder]) -> Path:
    """The file of a recording. It is made again only if the library or its inputs have changed."""
    library = build_dir() / ("" if numeric == "float32" else "fixed") / "libtauperp.so"
    key = hashlib.sha256(library.read_bytes() + dbc_path().read_bytes() + made_of + Path(__file__).read_bytes())
    path = BUILD / f"{name}-{numeric}-{key.hexdigest()[:16]}.rec"
    with _locked(BUILD / f"{name}-{numeric}.lock"):
        if not path.is_file():
            for old in BUILD.glob(f"{name}-{numeric}-*.rec"):
                old.unlink()
            write_atomically(path, make().content())
    return path


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Only one test process at a time runs the body."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


# --- experiments ------------------------------------------------------------------------------------------------------


class _RecordedPeer:
    """The guard of a simulated robot, recorded."""

    remote = False
    verdict: Verdict | None = None

    def __init__(self, bus: can.BusABC, recorder: Recorder) -> None:
        self._bus = bus
        self._recorder = recorder

    def turn(self, now_us: int) -> None:
        self._recorder.at(now_us)
        while (frame := self._bus.recv(timeout=0.0)) is not None:
            self._recorder.receive(frame)
        self.verdict = self._recorder.tick()
        for frame in self.verdict.frames:
            self._bus.send(frame)


def record_experiment(name: str, numeric: Numeric, robot: str) -> Path:
    """One of the paper's experiments in full, where a guard of this numeric type controls the robot."""
    scenario = load_experiment(name, robot=robot)
    block = scenario.configuration.block(numeric)

    def make() -> Recorder:
        recorder = Recorder()
        recorder.start(block)
        channel = f"{name}-{numeric}-{robot}"
        with LockstepBus(channel) as robot_bus, LockstepBus(channel) as guard_bus:
            trace = Lockstep(scenario, robot_bus, _RecordedPeer(guard_bus, recorder)).run()
        assert trace.finished
        assert sum(stop.reason in DETECTIONS for stop in trace.stops) == len(trace.contacts) > 0
        return recorder

    return _kept(f"{name}-{robot}", block + shipped(name).read_bytes(), numeric, make)


# --- random ticks -----------------------------------------------------------------------------------------------------


def record_random(robot: Robot, numeric: Numeric, ticks: int, seed: int) -> Path:
    """Ticks of new guards with random arm states, many of them singular, and with random faults."""
    made_of = f"{robot.name} {ticks} {seed}".encode() + configurations_of(robot)[0].block(numeric)

    def make() -> Recorder:
        recorder = Recorder()
        source = RandomTicks(robot, numeric, recorder, np.random.default_rng(seed))
        while recorder.ticks < ticks:
            source.episode(ticks - recorder.ticks)
        recorder.check_variety(singular=robot.name in robots())
        return recorder

    return _kept(f"random-{robot.name}-{robot.n}", made_of, numeric, make)


def configurations_of(robot: Robot) -> list[Configuration]:
    """Both presets, wire formats, orders and torque samples, and a bank. All settle quickly."""
    fd = {"wire": {"rate_hz": 1000, "format": "fd"}, "observer": {"gain_per_s": 500.0}}
    classic = {
        "wire": {"rate_hz": 250, "format": "classic"},
        "observer": {"torque_sample": "instant", "gain_per_s": 240.0},
        "bank": {
            "channel": [
                {"low_pass_per_s": 120.0, "order": 2},
                {"low_pass_per_s": 240.0, "order": 2, "high_pass_hz": 3.0},
            ]
        },
        "task": {
            "none": {"threshold_nm": [[1.2], [0.65]]},
            "payload": {"threshold_nm": [[0.75], [0.65]]},
            "contact": {"threshold_nm": [[0.5], [0.25]], "fast": []},
        },
    }
    return [
        load_configuration("default", robot=robot, overrides=fd),
        load_configuration("paper", robot=robot, overrides=fd),
        load_configuration("default", robot=robot, overrides=classic),
    ]


class RandomTicks:
    """One robot on a bus where any fault occurs from time to time."""

    def __init__(self, robot: Robot, numeric: Numeric, recorder: Recorder, random: np.random.Generator) -> None:
        self._robot = robot
        self._numeric = numeric
        self._recorder = recorder
        self._random = random
        self._core = Core(robot)
        self._low = np.array([joint.position_min for joint in robot.joints])
        self._high = np.array([joint.position_max for joint in robot.joints])
        self._speed = np.array([joint.velocity_max for joint in robot.joints])
        self._effort = np.minimum([joint.torque_max for joint in robot.joints], 320.0)
        self._zero = np.array([float(joint.zero_rad) for joint in make_table(robot).joint[: robot.n]])

    def episode(self, most: int) -> None:
        """About 40 to 900 ticks from guard_init on; the first permission comes after about 200."""
        random, recorder = self._random, self._recorder
        configuration = configurations_of(self._robot)[random.integers(3)]
        recorder.start(configuration.block(self._numeric))
        self._sender = Sender(configuration.wire, fd=configuration.settings.wire.format == "fd")
        self._tasks = [number for name, number in TASKS.items() if configuration.settings.task[name].index != "off"]
        self._period_us = configuration.period_us
        self._budget_us = configuration.tick_budget_us
        self._bad = random.choice([0.0, 0.01, 0.15])
        self._wild = random.random() < 0.3
        self._cycle = int(random.integers(65536))
        self._task = int(random.choice(self._tasks))
        self._request = False
        self._push = np.zeros(self._robot.n)
        self._earlier: list[can.Message] = []
        now_us = int(random.integers(10**9))
        self._jump()
        self._momentum = self._core.terms(self._q, self._qd).momentum
        after_fault = 0
        for _ in range(min(most, int(random.integers(40, 400) if self._wild else random.integers(200, 900)))):
            now_us += self._period_us
            if self._happens(0.02 * self._bad):
                now_us += int(random.integers(5 * self._period_us))
            recorder.at(now_us)
            for frame in self._frames():
                recorder.receive(frame)
            verdict = recorder.tick()
            recorder.note_tick_time(self._budget_us + (1 if self._happens(0.02 * self._bad) else -1))
            if self._happens(0.05 * self._bad):
                recorder.trip(Reason(random.integers(Reason.BUS_OFF, Reason.SHUTDOWN + 1)))
            self._trip = verdict.trip_number
            self._move()
            after_fault += verdict.state == State.FAULT
            if after_fault > 8:
                break

    _trip = 0

    def _happens(self, share: float) -> bool:
        return bool(self._random.random() < share)

    def _jump(self) -> None:
        """A state anywhere within the limits; two in three with joints at quarter turns, where arms are singular."""
        random, n = self._random, self._robot.n
        self._q = random.uniform(self._low, self._high)
        if self._happens(2 / 3):
            at = random.random(n) < 0.5
            zero = np.where(self._happens(0.5), self._zero, 0.0)
            quarters = random.integers(-1, 2, n) * (np.pi / 2) - zero
            self._q[at] = quarters[at] + (1e-3 * random.normal(size=n) * self._happens(0.5))[at]
        self._q = np.clip(self._q, self._low, self._high)
        self._qd = self._speed * random.uniform(-1, 1, n) * random.choice([0.0, 0.1, 1.0])
        self._acceleration = random.uniform(-8, 8, 3) * random.choice([0.0, 1.0], 3)

    def _move(self) -> None:
        if self._wild:
            self._jump()
        next_q = self._q + self._qd * self._period_us * 1e-6
        self._qd = np.where((next_q > self._low) & (next_q < self._high), self._qd, -self._qd)
        self._q = np.clip(next_q, self._low, self._high)
        self._cycle += 1
        if self._happens(0.02):
            self._task = int(self._random.choice(self._tasks))
        if self._happens(0.03):
            self._push = self._random.choice([0.0, 3.0, 60.0]) * self._random.normal(size=self._robot.n)

    def _torque(self) -> np.ndarray:
        """The torque of this motion without an external force."""
        terms = self._core.terms(self._q, self._qd)
        change = 0.0 if self._wild else (terms.momentum - self._momentum) / (self._period_us * 1e-6)
        self._momentum = terms.momentum
        torque = change - terms.coriolis + terms.gravity + self._push + 0.05 * self._random.normal(size=self._robot.n)
        return np.clip(torque, -self._effort, self._effort)

    def _frames(self) -> list[can.Message]:
        """The frames of one cycle, with random faults of the bus."""
        random, cycle, torque = self._random, self._cycle, self._torque()
        spoilt = self._happens(self._bad)
        status = int(random.integers(1, 4)) if self._happens(0.2 * self._bad) else 0
        fast = 3.0 if self._happens(0.2 * self._bad) else 1.0
        acceleration = dict(zip(("AccelX", "AccelY", "AccelZ"), self._acceleration, strict=True))
        task = int(random.integers(4)) if self._happens(0.2 * self._bad) else self._task
        frame = self._sender.frame
        frames = [
            frame("Sync", {"Cycle": cycle & 0xFFFF}, cycle=cycle),
            frame("TaskCommand", {"Task": task, **acceleration}, cycle=cycle),
        ]
        for i in range(self._robot.n):
            speed = np.clip(fast * self._qd[i], -8, 8)
            signals = {"SensorStatus": status, "Position": self._q[i], "Velocity": speed, "Torque": torque[i]}
            frames.append(frame(f"JointState{i + 1}", signals, cycle=cycle))
        if self._happens(0.3):
            self._request = not self._request
            number = self._trip if not self._happens(0.1) else int(random.integers(256))
            frames.append(frame("GuardReset", {"TripNumber": number, "Request": int(self._request)}, cycle=cycle))
        if self._happens(0.1):
            frames[2:] = [frames[i] for i in 2 + random.permutation(len(frames) - 2)]
        if spoilt:
            self._damaged(frames)
        self._earlier = frames
        return frames

    def _damaged(self, frames: list[can.Message]) -> None:
        """One of the faults of a bus: lost, repeated, delayed, damaged, or of another node."""
        random = self._random
        at = int(random.integers(len(frames)))
        victim = frames[at]
        match int(random.integers(7)):
            case 0:
                del frames[at]
            case 1:
                frames.insert(at, victim)
            case 2 if self._earlier:
                frames[at] = self._earlier[int(random.integers(len(self._earlier)))]
            case 3:
                data = bytearray(victim.data)
                data[int(random.integers(len(data)))] ^= 1 << int(random.integers(8))
                frames[at] = changed(victim, data=data)
            case 4:
                frames[at] = changed(victim, data=random.bytes(int(random.integers(9))))
            case 5:
                frames[at] = changed(victim, arbitration_id=int(random.integers(0x800)))
            case _:
                frames[at] = changed(victim, is_extended_id=True)


def changed(frame: can.Message, **fields: object) -> can.Message:
    """The frame with some of its fields replaced."""
    names = ("arbitration_id", "data", "is_extended_id", "is_fd", "bitrate_switch")
    return can.Message(**{**{name: getattr(frame, name) for name in names}, **fields})  # type: ignore[arg-type]
