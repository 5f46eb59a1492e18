"""The default preset in simpler forms, in which the index has a closed form."""

from pathlib import Path
from typing import Any

from tauperp.config import Configuration, load_configuration
from tauperp.robot import Robot

_TASK = {"threshold_nm": 1.0}

# One first-order channel, and one threshold.
ONE_CHANNEL: dict[str, Any] = {
    "bank": {"channel": []},
    "task": {"none": _TASK, "payload": {"threshold_nm": 0.8}, "contact": {"threshold_nm": 0.5, "fast": []}},
}


def one_channel(robot: str | Path | Robot) -> Configuration:
    """The default preset with a single filter."""
    return load_configuration("default", robot=robot, overrides=ONE_CHANNEL)


def plain(robot: str | Path | Robot) -> Configuration:
    """That with the hard projector, and 1 Nm in every task."""
    return load_configuration(
        "default",
        robot=robot,
        overrides={
            "bank": {"channel": []},
            "subspace": {"projector": "hard"},
            "task": {"none": _TASK, "payload": _TASK, "contact": {**_TASK, "fast": []}},
        },
    )
