"""The range of the wire for an arm. A simulated joint stays within it, as a real one with this guard must."""

from dataclasses import dataclass, replace

from tauperp.robot import Robot
from tauperp.wire import Wire

MARGIN = 0.99  # of the wire's range: tracking error and sensor noise must not carry a reading beyond it


@dataclass(frozen=True)
class WireRange:
    """Largest size of a joint's readings on the wire: rad, rad/s, Nm."""

    position: float
    velocity: float
    torque: float


def wire_range(wire: Wire) -> WireRange:
    """Of every JointState."""
    largest = {}
    for signal in wire.message("JointState1").definition.signals:
        if signal.name in ("Position", "Velocity", "Torque"):
            assert signal.minimum is not None
            assert signal.maximum is not None
            largest[signal.name] = min(-float(signal.minimum), float(signal.maximum))
    return WireRange(largest["Position"], largest["Velocity"], largest["Torque"])


def within_wire(robot: Robot, wire: Wire) -> Robot:
    """The robot with joint ranges and speeds cut to what the wire carries. Raises ValueError if a range is empty then.

    Its joints may be able to go further; the guard cannot follow them there.
    """
    limit = wire_range(wire)
    largest, fastest = MARGIN * limit.position, MARGIN * limit.velocity
    joints = []
    for joint in robot.joints:
        low, high = max(joint.position_min, -largest), min(joint.position_max, largest)
        if low >= high:
            raise ValueError(
                f"{joint.name} moves from {joint.position_min:.3g} to {joint.position_max:.3g} rad, and the wire"
                f" carries {limit.position:.4g} rad at most"
            )
        joints.append(
            replace(joint, position_min=low, position_max=high, velocity_max=min(joint.velocity_max, fastest))
        )
    return replace(robot, joints=tuple(joints))
