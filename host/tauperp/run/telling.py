"""The state of an external guard from its frames: GuardIndex and GuardStatus, one page after the other."""

import numpy as np
from numpy.typing import NDArray

from tauperp.config import NUMERICS
from tauperp.provenance import GuardIdentity
from tauperp.wire import Received

LOCKSTEP = 1  # GuardStatus.Variant
COUNTERS = {
    "CrcErrors": "crc_errors",
    "SequenceErrors": "sequence_errors",
    "LostFrames": "lost_frames",
    "RangeErrors": "range_errors",
    "FormatErrors": "format_errors",
    "LateFrames": "late_frames",
    "ResetsRefused": "resets_refused",
    "TripCount": "trips",
}


class Telling:
    """Collects the guard's reports. Torques (n,) Nm at the bus's resolution, as last reported: one joint after the
    other."""

    def __init__(self, n: int) -> None:
        self.residual, self.index = np.zeros(n), np.zeros(n)
        self.fresh: NDArray[np.bool_] = np.zeros(n, bool)  # reported since `begin`
        self._n = n
        self._status: dict[str, float] = {}

    def begin(self) -> None:
        """A new cycle: values received from now on are fresh."""
        self.fresh = np.zeros(self._n, bool)

    def hear(self, received: Received) -> None:
        """Process one accepted frame, of any message."""
        signals = received.signals
        if received.message.name == "GuardIndex":
            joint = int(signals["Joint"])
            if joint < self._n:
                self.residual[joint] = signals[f"Residual{joint + 1}"]
                self.index[joint] = signals[f"Index{joint + 1}"]
                self.fresh[joint] = True
        elif received.message.name == "GuardStatus":
            self._status.update(signals)

    @property
    def in_lockstep(self) -> bool:
        """Whether the guard reports lockstep."""
        return self._number("Variant") == LOCKSTEP

    @property
    def counters(self) -> dict[str, int | None]:
        """By the names of guard_counters_t, as last reported."""
        return {name: self._number(signal) for signal, name in COUNTERS.items()}

    @property
    def identity(self) -> GuardIdentity:
        version, build, crc = (self._number(name) for name in ("FirmwareVersion", "BuildId", "ConfigCrc"))
        names = {number: name for name, number in NUMERICS.items()}
        return GuardIdentity(
            firmware_version=None if version is None else f"{version >> 8}.{version & 0xFF}",
            build_id=None if build is None else f"{build:04x}",
            wire_version=self._number("WireVersion"),
            config_schema=self._number("ConfigSchema"),
            config_crc=None if crc is None else f"{crc:08x}",
            joints=self._number("RobotJoints"),
            numeric=names.get(self._number("Numeric") or 0),
        )

    def _number(self, signal: str) -> int | None:
        return int(self._status[signal]) if signal in self._status else None
