"""The guard's recorded trips, assembled from GuardEvent frames: r, index, channel and task around each trip."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import numpy as np
import numpy.typing as npt

from tauperp.files import write_atomically
from tauperp.wire import Receiver, Wire

MESSAGE = "GuardEvent"
AFTER = 20  # samples after the trip's own: EVENT_AFTER of event_log.h
FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Event:
    """One trip. Samples are `step_s` apart; the trip's own is number `before`."""

    trip: int
    reason: int  # as in StopCommand
    joint: int  # 1 to n; 0 none
    before: int
    step_s: float
    residual: FloatArray  # (m, n) Nm
    index: FloatArray  # (m, n) Nm
    task: npt.NDArray[np.int64]  # (m,)
    channel: npt.NDArray[np.int64]  # (m,)

    @property
    def time_s(self) -> FloatArray:
        """(m,) from the trip on."""
        result: FloatArray = (np.arange(len(self.task), dtype=np.float64) - self.before) * self.step_s
        return result

    def report(self, reasons: dict[int, str]) -> dict[str, Any]:
        """For JSON."""
        return {
            "trip": self.trip,
            "reason": reasons.get(self.reason, str(self.reason)),
            "joint": self.joint,
            "time_s": self.time_s.round(6).tolist(),
            "residual_nm": self.residual.round(2).tolist(),
            "index_nm": self.index.round(2).tolist(),
            "task": self.task.tolist(),
            "channel": self.channel.tolist(),
        }


class EventReader:
    """Pass every frame of a bus to `hear`. It returns each event once, when its last frame has arrived."""

    def __init__(self, wire: Wire) -> None:
        self._receiver = Receiver(wire)
        self._id = wire.message(MESSAGE).id
        self._headers: dict[int, dict[str, float]] = {}  # by slot
        self._samples: dict[int, dict[tuple[int, int], dict[str, float]]] = {}
        self._done: set[tuple[int, int]] = set()  # slot, trip

    def hear(self, frame: can.Message) -> Event | None:
        """Process any frame. A frame that fails its check is ignored; it will be repeated."""
        if frame.arbitration_id != self._id or frame.is_error_frame:
            return None
        received = self._receiver.receive(frame)
        if received is None or not received.signals or received.invalid:
            return None
        signals = received.signals
        slot = int(signals["EventSlot"])
        if int(signals["EventPart"]) == 0:
            if self._headers.get(slot, {}).get("EventTrip") != signals["EventTrip"]:
                self._samples[slot] = {}
                self._done = {one for one in self._done if one[0] != slot}
            self._headers[slot] = dict(signals)
            return None
        if slot not in self._headers:
            return None
        self._samples[slot][int(signals["EventSample"]), int(signals["SampleJoint"])] = dict(signals)
        return self._complete(slot)

    def _complete(self, slot: int) -> Event | None:
        header, samples = self._headers[slot], self._samples[slot]
        joints, before = int(header["EventJoints"]), int(header["EventBefore"])
        rows = before + 1 + AFTER
        key = (slot, int(header["EventTrip"]))
        if key in self._done or len(samples) < rows * joints:
            return None
        self._done.add(key)

        def column(name: str) -> FloatArray:
            return np.array([[samples[row, joint][name] for joint in range(joints)] for row in range(rows)])

        return Event(
            trip=int(header["EventTrip"]),
            reason=int(header["EventReason"]),
            joint=int(header["EventJoint"]),
            before=before,
            step_s=header["EventStep"] * 1e-6,
            residual=column("SampleResidual"),
            index=column("SampleIndex"),
            task=column("SampleTask")[:, 0].astype(np.int64),
            channel=column("SampleChannel")[:, 0].astype(np.int64),
        )


class EventFolder:
    """Writes every received event: trip-NNN.json and trip-NNN.png."""

    def __init__(self, wire: Wire, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.written: list[Path] = []
        self._reader = EventReader(wire)
        choices: Mapping[int, Any] = wire.message("StopCommand").definition.get_signal_by_name("Reason").choices or {}
        self._reasons = {int(number): str(name) for number, name in choices.items()}

    def hear(self, frame: can.Message) -> Path | None:
        """Process one frame of the bus. Returns the JSON file if it completed an event. Raises OSError if it cannot
        write."""
        event = self._reader.hear(frame)
        if event is None:
            return None
        from tauperp.monitor.event_figure import event_figure

        report = event.report(self._reasons)
        path = self.folder / f"trip-{event.trip:03d}.json"
        write_atomically(path.with_suffix(".png"), event_figure(event, str(report["reason"])))
        write_atomically(path, json.dumps(report, indent=2) + "\n")
        self.written.append(path)
        return path
