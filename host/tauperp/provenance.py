"""What a result was made with: the hashes that every report carries, so that it can be made again."""

import importlib.metadata

from tauperp.config import Configuration
from tauperp.firmware import Library
from tauperp.sim.telling import GuardIdentity

UNTOLD = "untold"


def provenance(library: Library, configuration: Configuration) -> dict[str, str]:
    """Hashes for a JSON report.

    firmware        first digits of the SHA-256 of the library file
    configuration   CRC-32 inside the block
    dbc             CRC-32 of the DBC file
    The firmware's version and numbers and MuJoCo's version are beside them.
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
    """The same of a guard that only its frames tell of; `firmware` is its build id."""
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
