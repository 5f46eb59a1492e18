"""What a viewer shows of a guard that is in this process."""

import numpy as np

from tauperp.firmware import State, Verdict
from tauperp.sim.moment import Moment, Puppet


def moment_of(
    stage: Puppet,
    verdict: Verdict,
    threshold_nm: np.ndarray,
    torque_nm: np.ndarray | None = None,
    unusable: np.ndarray | None = None,
) -> Moment:
    """The current state of the stage with the guard's answer; contacts are not known."""
    tripped = verdict.joint if verdict.state == State.STOPPED else 0
    torques = (verdict.residual, verdict.index, threshold_nm)
    return Moment(
        stage.data.time,
        stage.model,
        stage.data,
        verdict.permitted,
        tripped,
        *torques,
        contact_n=0.0,
        torque=torque_nm,
        unusable=unusable,
    )
