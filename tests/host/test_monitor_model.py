"""The monitor's results for the frames that it receives: pure values, no bus, no clock, no terminal."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import can
import pytest
from monitor_feed import CONFIG_CRC, MOVING, TRIPPED, Feed, Script

from tauperp import bus
from tauperp.busload import worst_case_load
from tauperp.monitor import Monitor, Snapshot, report
from tauperp.monitor.advice import advice
from tauperp.monitor.rates import WINDOW_S, Rates
from tauperp.monitor.screen import compose
from tauperp.monitor.snapshot import SILENT_S, STALE_S, Traffic, spoken
from tauperp.wire import Sender, Wire

WIRE = Wire.read()
EPOCH_S = 1_700_000_000.0
PERIOD_S = 0.002


class Listening:
    """A monitor and a feed in the same simulated time; 500 cycles a second."""

    def __init__(self, *, fd: bool = False, **options: float) -> None:
        self.monitor = Monitor(WIRE, now_s=0.0, epoch_s=EPOCH_S, **options)
        self.feed = Feed(WIRE, fd=fd)
        self.now_s = 0.0

    def hear(self, script: Script, seconds: float = 0.1, period_s: float = PERIOD_S) -> "Listening":
        for _ in range(round(seconds / period_s)):
            for frame in self.feed.frames(script):
                self.monitor.hear(frame, self.now_s)
            self.now_s += period_s
        return self

    def one(self, frame: can.Message) -> "Listening":
        self.monitor.hear(frame, self.now_s)
        return self

    def see(self, later_s: float = 0.0) -> Snapshot:
        self.now_s += later_s
        return self.monitor.snapshot(self.now_s)


def test_a_bus_without_a_guard_permits_nothing() -> None:
    snapshot = Listening().see(later_s=5.0)
    assert not snapshot.heard
    assert not snapshot.permitted
    assert snapshot.stops == ()  # there was no permission that could have ended


def test_a_permission_lasts_while_it_is_renewed() -> None:
    listening = Listening().hear(MOVING)
    assert listening.see().permitted
    assert listening.see(later_s=0.9 * SILENT_S).permitted
    silent = listening.see(later_s=0.2 * SILENT_S)
    assert not silent.permitted
    assert not silent.heard


@pytest.mark.parametrize("pair", [(0, 15), (1, 15), (0, 14)])
def test_every_other_pair_of_permission_bits_is_a_stop(pair: tuple[int, int]) -> None:
    listening = Listening().hear(MOVING)
    signals = {"Joint": 0, "StopCategory": 0, "Cycle": 0, "Reason": 1, "TripNumber": 0, "IndexValue": 0.0}
    signals |= {"Channel": 0, "FullSpeed": 1}
    sender = Sender(WIRE, fd=False)
    for _ in range(51 % 16):  # as many as the feed has sent, so that this one is next
        frame = sender.frame("StopCommand", {**signals, "Permission": pair[0], "PermissionInverted": pair[1]})
    snapshot = listening.one(frame).see()
    assert snapshot.heard
    assert not snapshot.permitted


def test_a_frame_that_fails_its_check_changes_nothing_but_a_count() -> None:
    listening = Listening().hear(TRIPPED)
    broken = next(frame for frame in listening.feed.frames(MOVING) if frame.arbitration_id == 0x10)
    broken.data[0] ^= 0xFF
    snapshot = listening.one(broken).see()
    assert not snapshot.permitted
    assert traffic(snapshot, "StopCommand").crc_errors == snapshot.total("crc_errors") == 1


def test_a_frame_with_an_impossible_value_is_discarded() -> None:
    message = WIRE.message("StopCommand")
    listening = Listening().hear(TRIPPED)
    moving = next(frame for frame in listening.feed.frames(MOVING) if frame.arbitration_id == message.id)
    moving.data[4] = 200  # an unknown reason
    message.seal(moving.data, moving.data[1])
    snapshot = listening.one(moving).see()
    assert snapshot.total("crc_errors") == 0
    assert traffic(snapshot, "StopCommand").range_errors == 1
    assert not snapshot.permitted


def test_every_status_value_is_kept_with_its_name_in_the_dbc() -> None:
    snapshot = Listening().hear(TRIPPED).see()
    told = {name: reading.value for name, reading in snapshot.status.items()}
    assert told["State"] == "Stopped"
    assert told["Task"] == "Payload"
    assert told["Reason"] == "Collision"
    assert told["SmallestSingular"] == pytest.approx(0.1234)
    assert (told["TickTime"], told["WorstTickTime"], told["DeadlineMargin"]) == (45, 61, 7210)
    assert [told[name] for name in ("CrcErrors", "SequenceErrors", "LostFrames")] == [11, 12, 13]
    assert [told[name] for name in ("RangeErrors", "FormatErrors", "LateFrames", "ResetsRefused")] == [14, 15, 16, 17]
    assert told["ConfigCrc"] == CONFIG_CRC
    assert told["RobotJoints"] == 7
    assert snapshot.verdict is not None
    verdict = snapshot.verdict.value
    assert (verdict.reason, verdict.joint, verdict.trip_number) == ("Collision", 3, 7)
    assert verdict.category == "StopAndHold"
    assert verdict.index_nm == pytest.approx(4.21)


def test_every_joint_has_its_own_torques() -> None:
    snapshot = Listening().hear(MOVING).see()
    assert list(snapshot.joints) == [1, 2, 3, 4, 5, 6, 7]
    for joint, reading in snapshot.joints.items():
        assert reading.value.residual_nm == pytest.approx(MOVING.residual[joint - 1])
        assert reading.value.index_nm == pytest.approx(MOVING.index[joint - 1])
        assert reading.value.threshold_nm == pytest.approx(2.0)


def test_each_value_has_its_own_age() -> None:
    listening = Listening().hear(MOVING)
    quiet = dataclasses.replace(MOVING, guard=False)
    assert all(reading.live for reading in listening.see().status.values())
    old = listening.hear(quiet, 1.1 * STALE_S).see()
    assert not any(reading.live for reading in [*old.status.values(), *old.joints.values()])
    assert old.live("State") is None


def traffic(snapshot: Snapshot, name: str) -> Traffic:
    return next(one for one in snapshot.traffic if one.name == name)


def test_rates_are_counted_and_compared_with_the_dbc() -> None:
    stray = Sender(WIRE, fd=False).frame(
        "JointState8", {"SensorStatus": 0, "Position": 0.0, "Velocity": 0.0, "Torque": 0.0}, cycle=0
    )
    snapshot = Listening().hear(MOVING, 2.2).one(stray).see()
    for name, rate_hz in [("Sync", 500), ("StopCommand", 500), ("JointState7", 500), ("GuardIndex", 250)]:
        one = traffic(snapshot, name)
        assert one.rate_hz == pytest.approx(rate_hz, rel=0.02)
        assert one.expected_hz == pytest.approx(rate_hz, rel=0.02)
        assert not one.missing
    assert traffic(snapshot, "GuardReset").expected_hz is None
    assert traffic(snapshot, "JointState8").expected_hz is None  # this robot has seven


@pytest.mark.parametrize("joint", [5, 7])  # only the guard reports that there is a seventh
def test_a_joint_that_is_silent_is_missing_and_no_other_message_is(joint: int) -> None:
    script = dataclasses.replace(MOVING, silent_joints=(joint,))
    snapshot = Listening().hear(script, 2.2).see()
    assert [one.name for one in snapshot.traffic if one.missing] == [f"JointState{joint}"]


def test_a_slow_bus_is_a_slow_sync_and_nothing_else() -> None:
    snapshot = Listening().hear(MOVING, 2.2, period_s=0.01).see()
    assert [one.name for one in snapshot.traffic if one.missing] == ["Sync"]
    assert traffic(snapshot, "Sync").expected_hz == 500
    assert traffic(snapshot, "GuardStatus").expected_hz == pytest.approx(50, rel=0.05)


def test_the_expected_rate_is_1000_cycles_on_can_fd_or_the_given_one() -> None:
    assert traffic(Listening(fd=True).hear(MOVING, 1.0, 0.001).see(), "Sync").expected_hz == 1000
    assert traffic(Listening(rate_hz=250.0).hear(MOVING).see(), "Sync").expected_hz == 250


@pytest.mark.parametrize(("fd", "period_s"), [(False, 0.002), (True, 0.001)])
def test_the_bus_load_is_the_worst_case_of_the_frames_sent(fd: bool, period_s: float) -> None:
    snapshot = Listening(fd=fd).hear(MOVING, 2.2, period_s).see()
    load = worst_case_load(WIRE, joints=7, rate_hz=1 / period_s, fd=fd)
    resets = worst_case_load(WIRE, joints=7, rate_hz=1 / period_s, fd=fd) - snapshot.load
    assert 0 < resets < 0.06  # worst_case_load counts a GuardReset in every cycle; the feed sends none
    assert snapshot.load == pytest.approx(load, abs=0.06)
    slower = Listening(fd=fd, bitrate=500_000.0).hear(MOVING, 2.2, period_s).see()
    assert slower.load > 1.3 * snapshot.load


def test_lost_repeated_foreign_and_malformed_frames_are_counted_separately() -> None:
    listening = Listening().hear(MOVING)
    frames = list(listening.feed.frames(MOVING))
    frames = list(listening.feed.frames(MOVING))  # the previous cycle was lost
    listening.one(frames[0]).one(frames[0])
    listening.one(can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b"\1"))
    listening.one(can.Message(arbitration_id=0x101, is_extended_id=False, data=b"\1"))
    listening.one(can.Message(is_error_frame=True, arbitration_id=0x20))
    snapshot = listening.see()
    assert traffic(snapshot, "Sync").lost_frames == 1
    assert traffic(snapshot, "Sync").sequence_errors == 1
    assert (snapshot.foreign_frames, snapshot.format_errors, snapshot.error_frames) == (1, 1, 1)


def test_an_interface_that_is_down_is_reported_until_a_frame_arrives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    listening = Listening()
    assert not listening.see().interface_down
    listening.monitor.note_bus_error()
    assert listening.see().interface_down
    assert "the interface is down" in "\n".join(line.plain for line in compose(listening.see(), "socketcan can0", 100))
    assert not listening.hear(MOVING).see().interface_down
    monkeypatch.setattr(bus, "NETWORK", tmp_path)
    (tmp_path / "can0").mkdir()
    for flags, state in (("0x40080", True), ("0x40081", False), ("?", None)):
        (tmp_path / "can0" / "flags").write_text(flags)
        assert bus.is_down("socketcan", "can0") is state
    assert bus.is_down("virtual", "can0") is None


def test_a_trip_is_remembered_with_its_time_cause_and_length() -> None:
    listening = Listening().hear(MOVING, 1.0).hear(TRIPPED, 0.5)
    (stop,) = listening.see().stops
    assert stop.time_s == pytest.approx(EPOCH_S + 1.0, abs=0.01)
    assert (stop.trip_number, stop.reason, stop.joint, stop.earlier) == (7, "Collision", 3, False)
    assert stop.index_nm == pytest.approx(4.21)
    assert stop.lasted_s is None
    (stop,) = listening.hear(dataclasses.replace(MOVING, trip=7), 0.1).see().stops
    assert stop.lasted_s == pytest.approx(0.5, abs=0.01)


def test_a_trip_right_after_a_trip_counts_as_a_second_one() -> None:
    listening = Listening().hear(MOVING).hear(TRIPPED)
    fault = dataclasses.replace(TRIPPED, state=5, reason=13, joint=0, trip=8)
    newest, before = listening.hear(fault).see().stops
    assert (newest.trip_number, newest.reason, newest.index_nm) == (8, "TickLate", None)
    assert before.lasted_s == pytest.approx(0.1, abs=0.01)


def test_a_trip_latched_before_the_start_is_marked_as_earlier() -> None:
    (stop,) = Listening().hear(TRIPPED).see().stops
    assert stop.earlier


def test_the_start_of_a_guard_is_not_a_stop() -> None:
    waiting = dataclasses.replace(MOVING, permitted=False, state=2, reason=4)
    assert Listening().hear(waiting).hear(MOVING).see().stops == ()


def test_a_guard_that_is_restarted_while_stopped_has_no_trip_of_number_0() -> None:
    waiting = dataclasses.replace(MOVING, permitted=False, state=2, reason=4, trip=0)
    (stop,) = Listening().hear(TRIPPED).hear(waiting).see().stops
    assert stop.trip_number == 7


def test_a_permission_that_ends_without_a_trip_is_a_stop_too() -> None:
    waiting = dataclasses.replace(MOVING, permitted=False, state=2, reason=4)
    (stop,) = Listening().hear(MOVING).hear(waiting).see().stops
    assert (stop.trip_number, stop.reason) == (None, "WaitingJoint")


def test_silence_is_a_stop_that_ends_with_the_next_permission() -> None:
    listening = Listening().hear(MOVING, 1.0)
    (stop,) = listening.see(later_s=1.0).stops
    assert (stop.reason, stop.trip_number) == ("Silence", None)
    assert stop.time_s == pytest.approx(EPOCH_S + 1.0, abs=0.01)
    (stop,) = listening.hear(MOVING).see().stops
    assert stop.lasted_s == pytest.approx(1.0, abs=0.02)


def test_consecutive_silences_are_one_line_and_the_earlier_trip_stays() -> None:
    listening = Listening().hear(MOVING).hear(TRIPPED).hear(dataclasses.replace(MOVING, trip=7))
    for _ in range(4):
        listening.see(later_s=1.0)
        listening.hear(dataclasses.replace(MOVING, trip=7))
    silence, trip = listening.see().stops
    assert (silence.reason, silence.times, trip.trip_number) == ("Silence", 4, 7)


def test_a_simulation_that_is_slower_than_real_time_is_not_silent() -> None:
    slow = dataclasses.replace(MOVING, variant=1)
    for script, heard in ((MOVING, False), (slow, True)):
        snapshot = Listening().hear(script, 1.0).see(later_s=1.0)
        assert snapshot.heard == heard
        assert (snapshot.live("State") is not None) == heard
        assert len(snapshot.stops) == (0 if heard else 1)


@pytest.mark.parametrize(
    ("changes", "reset", "said"),
    [
        ({}, None, "index of joint 3 is above its threshold; then GuardReset of trip 7"),
        ({"index": (0.0,) * 7}, None, "next: GuardReset of trip 7, Request from 0 to 1"),
        ({"index": (0.0,) * 7}, 3, "(the last reset named trip 3)"),
        ({"index": (0.0,) * 7}, 7, "(the last reset came before everything was good for long enough)"),
        ({"index": (0.0,) * 7, "silent_joints": (2,)}, None, "frames of joint 2 are missing; then GuardReset"),
        ({"state": 5, "reason": 15}, None, "remove the cause and restart the guard"),
    ],
)
def test_advice_is_given_while_the_robot_is_stopped(changes: dict[str, Any], reset: int | None, said: str) -> None:
    listening = Listening().hear(dataclasses.replace(TRIPPED, **changes), 1.2)
    if reset is not None:
        sender = Sender(WIRE, fd=False)
        for request in (0, 1):
            listening.one(sender.frame("GuardReset", {"Request": request, "TripNumber": reset}))
    assert said in advice(listening.see())


def test_no_advice_is_given_while_motion_is_permitted() -> None:
    assert advice(Listening().hear(MOVING).see()) == ""


def test_the_history_is_bounded() -> None:
    listening = Listening()
    for trip in range(1, 256):
        listening.hear(dataclasses.replace(TRIPPED, trip=trip), 2 * PERIOD_S)
    stops = listening.see().stops
    assert len(stops) == 100
    assert stops[0].trip_number == 255


def test_json_holds_every_value_and_is_valid() -> None:
    listening = Listening().hear(MOVING, 1.0).hear(TRIPPED)
    line = json.loads(json.dumps(report(listening.see()), allow_nan=False))
    assert line["permitted"] is False
    assert line["heard"] is True
    assert line["verdict"]["value"]["reason"] == "Collision"
    assert line["status"]["DeadlineMargin"]["value"] == 7210
    assert line["joints"]["3"]["value"]["index_nm"] == pytest.approx(4.21)
    assert line["stops"][0]["trip_number"] == 7
    assert {one["name"] for one in line["traffic"]} == set(WIRE.messages)
    assert json.loads(json.dumps(report(Listening().see()), allow_nan=False))["verdict"] is None


def test_rates_cover_only_their_window_and_are_right_after_a_long_silence() -> None:
    rates = Rates(0.0)
    for step in range(100):
        rates.add("a", step * 0.01)
    rates.advance(1.0)
    assert rates.rate("a") == pytest.approx(100, rel=0.02)
    assert rates.rate("b") == 0
    rates.advance(1.0 + WINDOW_S)
    assert rates.rate("a") == 0
    rates.advance(1e6)
    rates.add("a", 1e6 + 0.05)
    rates.advance(1e6 + 0.2)
    assert rates.rate("a") == pytest.approx(1 / WINDOW_S)


def test_names_of_the_dbc_are_shown_as_words() -> None:
    assert [spoken(name) for name in ("TickOverBudget", "None", "RxOverflow")] == [
        "tick over budget",
        "none",
        "rx overflow",
    ]
