"""The default preset with one first-order channel and the hard projector.

The index then has a closed form.
"""

from pathlib import Path

from tauperp.config import Configuration, load_configuration
from tauperp.robot import Robot

_TASK = {"threshold_nm": 1.0}


def plain(robot: str | Path | Robot) -> Configuration:
    return load_configuration(
        "default",
        robot=robot,
        overrides={
            "bank": {"channel": []},
            "subspace": {"projector": "hard"},
            "task": {"none": _TASK, "payload": _TASK, "contact": {**_TASK, "fast": []}},
        },
    )
