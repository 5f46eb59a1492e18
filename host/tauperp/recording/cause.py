"""Why an input stopped the guard: the quantity, its value, and the limit that it exceeds."""

from tauperp.firmware import Reason, Verdict
from tauperp.recording.recording import FloatArray
from tauperp.robot import Robot


def cause_of(verdict: Verdict, robot: Robot, samples: FloatArray) -> str:
    """Cause of a trip for an input of a joint, from the readings (n, 3) rad, rad/s, Nm that were sent. "" for any other
    trip."""
    if verdict.reason != Reason.INPUT_RANGE or not 1 <= verdict.joint <= robot.n:
        return ""
    joint = robot.joints[verdict.joint - 1]
    position, velocity, torque = samples[verdict.joint - 1].tolist()
    for quantity, value, unit, low, high in (
        ("position", position, "rad", joint.position_min, joint.position_max),
        ("velocity", velocity, "rad/s", -joint.velocity_max, joint.velocity_max),
        ("torque", torque, "Nm", -joint.torque_max, joint.torque_max),
    ):
        if not low < value < high:
            limit = high if value >= high else low
            side = "above" if value >= high else "below"
            return (
                f"joint {verdict.joint} ({joint.name}): {quantity} {value:.4g} {unit} is {side} its limit of "
                f"{limit:.4g} {unit}"
            )
    return ""
