"""The explained part of a motion without touches, and proposed limits that are a margin above it.

The sizes are those that firmware/core/explained.c compares with the task's limits. Payload and regressor: the force is
the weight (of either sign) and what acts sideways, the moment that of the weight; without a payload both are the error
of model and sensors, which the slacks are for. Contact: length of the force and of the moment.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tauperp.config import Configuration
from tauperp.config.indexes import COMPONENTS, components_of
from tauperp.config.settings import Task

FloatArray = npt.NDArray[np.float64]

MARGIN = 1.5  # of a proposed limit over the largest size seen
FORCE_N, MOMENT_NM = 5.0, 1.0  # no proposal is below
G_M_S2 = 9.81
WEIGHT = 3  # column of the weight of the payload index, after its moments
# One unit of a regressor's coefficient, as force in N and as moment in Nm (firmware/core/regressor.h).
MASS_N, MOMENT_UNIT_NM, INERTIA_NM = 3.0 * G_M_S2, 0.3 * G_M_S2, 0.03 * 10.0
KEYS = {"payload": ("force_slack_n", "moment_slack_nm"), "contact": ("force_max_n", "moment_max_nm")}


@dataclass(frozen=True)
class Explained:
    """Of one task: the largest explained force N and moment Nm, and the limits that are proposed for them."""

    force_n: float
    moment_nm: float
    proposed: dict[str, float]  # by the keys of [task.NAME.limits]; never above those in force
    beyond: tuple[str, ...]  # keys of the limits in force that the motion itself nearly reaches or exceeds

    def report(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "force_n": round(self.force_n, 2),
            "moment_nm": round(self.moment_nm, 2),
            "margin": MARGIN,
            "proposed_limits": self.proposed,
            "not_held": list(self.beyond),
        }


def sizes(coefficients: FloatArray, task: Task, lever_m: float) -> tuple[FloatArray, FloatArray] | None:
    """Explained force N and moment Nm of each row, (m,) each, from the coefficients (m, 6); None: nothing is."""
    if task.index == "d_p":
        force = np.abs(coefficients[:, WEIGHT : WEIGHT + 2]).max(axis=1)
        return force, lever_m * np.linalg.norm(coefficients[:, :WEIGHT], axis=1)
    if task.index == "d_r":
        moment = MOMENT_UNIT_NM * np.linalg.norm(coefficients[:, 1:4], axis=1)
        return MASS_N * np.abs(coefficients[:, 0]), np.maximum(moment, INERTIA_NM * np.abs(coefficients[:, 4]))
    components = sorted(
        components_of(task.index, task.components), key=lambda name: (name not in task.fast, COMPONENTS[name])
    )
    if not components:
        return None
    forces = [column for column, name in enumerate(components) if name.startswith("f")]
    moments = [column for column, name in enumerate(components) if name.startswith("m")]
    return (
        np.linalg.norm(coefficients[:, forces], axis=1),
        lever_m * np.linalg.norm(coefficients[:, moments], axis=1),
    )


def explained(coefficients: FloatArray, configuration: Configuration, name: str) -> Explained | None:
    """Over all rows (m, 6) of motions without touches; None for a task that explains nothing."""
    task = configuration.settings.task[name]
    found = sizes(coefficients, task, configuration.settings.subspace.lever_m)
    if found is None:
        return None
    peaks = [float(values.max(initial=0.0)) for values in found]
    keys = KEYS["payload" if task.index in ("d_p", "d_r") else "contact"]
    limits = [getattr(task.limits, key) for key in keys]
    wanted = [max(MARGIN * peak, least) for peak, least in zip(peaks, (FORCE_N, MOMENT_NM), strict=True)]
    proposed = {key: round(min(value, limit), 1) for key, value, limit in zip(keys, wanted, limits, strict=True)}
    beyond = tuple(key for key, value, limit in zip(keys, wanted, limits, strict=True) if value > limit)
    return Explained(peaks[0], peaks[1], proposed, beyond)


def lines(name: str, one: Explained, *, written: bool) -> list[str]:
    """For a terminal."""
    values = ", ".join(f"{key} = {value:g}" for key, value in one.proposed.items())
    what = "written" if written else "proposed, not written (--limits writes them)"
    text = [
        f"task {name}: untouched motion is explained as up to {one.force_n:.1f} N and {one.moment_nm:.1f} Nm; "
        f"limits with a margin of {MARGIN:g}: {values}: {what}"
    ]
    if one.beyond:
        text.append(
            f"task {name}: {' and '.join(one.beyond)} in force leave less than that margin: expect stops of "
            "EXPLAINED_FORCE or EXPLAINED_MOMENT"
        )
    return text
