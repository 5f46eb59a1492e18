"""Provenance of a result: the hashes in every report, which make the result reproducible."""

import importlib.metadata
from dataclasses import dataclass

from tauperp.config import NUMERICS, Configuration
from tauperp.firmware import Library

UNTOLD = "untold"


@dataclass(frozen=True)
class GuardIdentity:
    """Identity of a guard as it reports it; None for what it has not reported."""

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
            lines.append("it has not sent its configuration")
        elif self.config_crc not in expected:
            lines.append(f"its configuration is {self.config_crc}, the scenario's {' or '.join(expected)}")
        return lines


def provenance(library: Library, configuration: Configuration) -> dict[str, str]:
    """Hashes for a JSON report.

    firmware        first digits of the SHA-256 of the library file
    configuration   CRC-32 inside the block
    dbc             CRC-32 of the DBC file
    The firmware's version and numbers and MuJoCo's version are added.
    """
    return {
        "firmware": library.hash,
        "configuration": f"{configuration.crc(library.numeric):08x}",
        "dbc": configuration.wire.hash,
        "firmware_version": library.version,
        "numeric": library.numeric,
        "mujoco": _mujoco_version(),
    }


def provenance_of_bus(guard: GuardIdentity, configuration: Configuration) -> dict[str, str]:
    """The same for a guard that is known only by its frames; `firmware` is its build id."""
    return {
        "firmware": guard.build_id or UNTOLD,
        "configuration": guard.config_crc or UNTOLD,
        "dbc": configuration.wire.hash,
        "firmware_version": guard.firmware_version or UNTOLD,
        "numeric": guard.numeric or UNTOLD,
        "mujoco": _mujoco_version(),
    }


def provenance_line(hashes: dict[str, str]) -> str:
    """The same as one line for people."""
    return (
        f"firmware {hashes['firmware_version']} {hashes['numeric']} {hashes['firmware']}, "
        f"configuration {hashes['configuration']}, DBC {hashes['dbc']}, MuJoCo {hashes['mujoco']}"
    )


def _mujoco_version() -> str:
    """Of whichever of its two packages is installed."""
    for package in ("mujoco-core", "mujoco"):
        try:
            return importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return "not installed"
