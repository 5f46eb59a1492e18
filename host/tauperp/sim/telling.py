"""What a guard that cannot be looked into tells of itself on the bus: GuardIndex and GuardStatus, a page a turn."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauperp.config import NUMERICS, Configuration
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


@dataclass(frozen=True)
class GuardIdentity:
    """Whose guard it is, in its own words; None for what it has not told."""

    firmware_version: str | None  # major.minor
    build_id: str | None  # four hex digits
    wire_version: int | None
    config_schema: int | None
    config_crc: str | None  # eight hex digits
    joints: int | None
    numeric: str | None

    def differences(self, configuration: Configuration) -> list[str]:
        """A line for each way in which it is not the guard that the configuration would make."""
        lines = []
        if self.joints is not None and self.joints != configuration.robot.n:
            lines.append(f"it guards {self.joints} joints, {configuration.robot.name} has {configuration.robot.n}")
        if self.wire_version is not None and self.wire_version != configuration.wire.version:
            lines.append(f"it speaks version {self.wire_version} of the wire, not {configuration.wire.version}")
        numerics = [numeric for numeric in NUMERICS if self.numeric in (None, numeric)]
        expected = [f"{configuration.crc(numeric):08x}" for numeric in numerics]
        if self.config_crc is None:
            lines.append("it has not told its configuration")
        elif self.config_crc not in expected:
            lines.append(f"its configuration is {self.config_crc}, the scenario's {' or '.join(expected)}")
        return lines


class Telling:
    """Collects what the guard tells. Torques (n,) Nm at the bus's resolution, as last told: each joint in its turn."""

    def __init__(self, n: int) -> None:
        self.residual, self.index = np.zeros(n), np.zeros(n)
        self.fresh: NDArray[np.bool_] = np.zeros(n, bool)  # told since `begin`
        self._n = n
        self._status: dict[str, float] = {}

    def begin(self) -> None:
        """A new cycle: values received from now on are fresh."""
        self.fresh = np.zeros(self._n, bool)

    def hear(self, received: Received) -> None:
        """One accepted frame, of any message."""
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
        """The guard says that its time is bus time."""
        return self._number("Variant") == LOCKSTEP

    @property
    def counters(self) -> dict[str, int | None]:
        """By the names of guard_counters_t, as last told."""
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
