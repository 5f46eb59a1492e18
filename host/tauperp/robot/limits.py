"""A joint's limits: comparison with the range of JointState, and defaults for a file without limits."""

from dataclasses import dataclass

from tauperp.errors import InputError

# Limits of a file without limits: about the range of the wire. A joint that turns further reports its angle wrapped
# to +-pi, with some room for where it wraps.
DEFAULT_POSITION_RAD = 4.0
DEFAULT_VELOCITY_RAD_S = 8.0
DEFAULT_TORQUE_NM = 320.0

# The ranges of JointState in dbc/tauperp.dbc.
WIRE_POSITION_RAD = 4.095875
WIRE_VELOCITY_RAD_S = 8.19175
WIRE_TORQUE_NM = 327.67

# Limits between these cannot be radians of an arm: seven turns and more, but not the huge number that means no limit.
DEGREES_FROM, NO_LIMIT_FROM = 40.0, 1000.0


@dataclass(frozen=True)
class Limits:
    """rad, rad/s, Nm. None: not in the file."""

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    torque: float | None = None


@dataclass(frozen=True)
class Fitted:
    """Limits within the range of the wire; the names of those that are defaults; notes for the user."""

    position_min: float
    position_max: float
    velocity: float
    torque: float
    defaults: frozenset[str]
    warnings: tuple[str, ...]


def fitted(joint: str, limits: Limits) -> Fitted:
    """Raises InputError, with the joint's name, for limits that cannot be correct."""
    defaults: set[str] = set()
    warnings: list[str] = []
    lower, upper = _positions(joint, limits, defaults, warnings)

    def one(what: str, value: float | None, default: float, carried: float, unit: str) -> float:
        if value is None:
            defaults.add(what)
            return default
        if not value > 0.0:
            name = "effort" if what == "torque" else what
            raise InputError(f"joint '{joint}': {name} limit {value:g} is not positive")
        if value > carried:
            warnings.append(
                f"{what} limit {value:g} {unit} is beyond the {carried:g} {unit} that JointState "
                f"carries: {default:g} {unit} in the table"
            )
            return default
        return value

    velocity = one("velocity", limits.velocity, DEFAULT_VELOCITY_RAD_S, WIRE_VELOCITY_RAD_S, "rad/s")
    torque = one("torque", limits.torque, DEFAULT_TORQUE_NM, WIRE_TORQUE_NM, "Nm")
    return Fitted(lower, upper, velocity, torque, frozenset(defaults), tuple(warnings))


def _positions(joint: str, limits: Limits, defaults: set[str], warnings: list[str]) -> tuple[float, float]:
    lower, upper = limits.lower, limits.upper
    if lower is None or upper is None:
        defaults.add("position")
        return -DEFAULT_POSITION_RAD, DEFAULT_POSITION_RAD
    if not lower < upper:
        raise InputError(f"joint '{joint}': lower limit {lower:g} rad is not below upper limit {upper:g} rad")
    farthest = max(abs(lower), abs(upper))
    if farthest <= WIRE_POSITION_RAD:
        return lower, upper
    if DEGREES_FROM <= farthest < NO_LIMIT_FROM:
        raise InputError(
            f"joint '{joint}': position limits {lower:g} to {upper:g} rad are {farthest / 6.283185:.0f} turns, and "
            f"JointState carries +-{WIRE_POSITION_RAD:g} rad: are they in degrees?"
        )
    warnings.append(
        f"position limits {lower:g} to {upper:g} rad are beyond the +-{WIRE_POSITION_RAD:g} rad that JointState "
        "carries: the joint has to report its angle wrapped to +-pi (wrap = true in a map); "
        f"+-{DEFAULT_POSITION_RAD:g} rad in the table"
    )
    return -DEFAULT_POSITION_RAD, DEFAULT_POSITION_RAD
