"""Offset and friction of the joints' torque sensors, and the source of these numbers.

    calibration  from the configuration (`[sensor]`, by `tauperp calibrate`): the firmware subtracts it
    rest         mean of measured minus gravity torque where the arm first rests for a second, untouched
    regression   offsets, friction and an unknown payload together, by least squares over the file's own motion
    FILE         a configuration with [sensor], or a recording of the arm at rest, unloaded
    zero         none

The default is the calibration's if there is one, else those of a rest, else zero. The mean over a rest also removes the
model's error in that pose, including a payload in the gripper. Such offsets are wrong in every other pose: on a real
arm the index of the payload task was then above its threshold for 77 % of the time instead of 7 %. A rest whose torque
looks like a payload is therefore refused.
"""

import dataclasses
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tauperp.config import Configuration, load_configuration
from tauperp.errors import InputError
from tauperp.recording.recording import FloatArray, Recording
from tauperp.recording.tables import read_recording
from tauperp.robot import Robot
from tauperp.sim.dynamics import Dynamics

CALIBRATION, REST, REGRESSION, ZERO = "calibration", "rest", "regression", "zero"
CHOICES = (CALIBRATION, REST, REGRESSION, ZERO)

REST_S = 1.0
REST_RAD_S = 0.05
STEADY_NM = 0.5  # largest change of the mean torque between two windows of WINDOW_S in an untouched rest
WINDOW_S = 0.25
FRICTION_RAD_S = 0.05  # from this speed on, Coulomb friction has its full value
PAYLOAD_KG = 0.3  # an apparent payload from which a rest is refused
PAYLOAD_SHARE = 0.8  # share of the offsets' squares that it explains
PAYLOAD_NM = 1.5  # and the largest offset; any sensor may read less than this
REGRESSION_ROWS = 600
REGRESSION_S = 5.0  # of motion
LARGEST_CONDITION = 30.0  # condition of the scaled regressors; above it payload and offsets cannot be separated
SMOOTHING_S = 0.03


@dataclasses.dataclass(frozen=True, eq=False)
class Offsets:
    """(n,) Nm, subtracted from the measured torque before it is sent, and the text for the report."""

    nm: FloatArray
    source: str  # one of CHOICES, or the file's name
    told: str

    def report(self) -> dict[str, object]:
        """For JSON."""
        return {"from": self.source, "told": self.told, "offset_nm": [round(value, 3) for value in self.nm.tolist()]}


def find_offsets(recording: Recording, configuration: Configuration, choice: str | None = None) -> Offsets:
    """The offsets of a recording by one of CHOICES, a file, or None for the first available one.

    Raises InputError if the choice gives none, and for a rest that looks like a payload.
    """
    n = configuration.robot.n
    nothing = np.zeros(n)
    has_calibration = any(configuration.settings.sensor.offset_nm)
    if choice == CALIBRATION or (choice is None and has_calibration):
        if not has_calibration:
            raise InputError(f"--offsets {CALIBRATION}: {configuration.source} has no [sensor] offset_nm")
        return Offsets(nothing, CALIBRATION, f"[sensor] of {configuration.source}, subtracted by the firmware")
    if choice == ZERO:
        return Offsets(nothing, ZERO, "none, as requested")
    if choice == REGRESSION:
        return _by_regression(recording, configuration.robot)
    if choice not in (None, REST):
        return _from_file(Path(choice), configuration)
    rest = find_rest(recording)
    if rest is None:
        if choice == REST:
            raise InputError(f"{recording.path}: the arm never rests untouched for {REST_S:g} s, to give the offsets")
        return Offsets(nothing, ZERO, f"none: the arm never rests untouched for {REST_S:g} s")
    values = _at_rest(recording, rest, configuration.robot)
    span = f"{recording.time_s[rest.start]:.2f} to {recording.time_s[rest.stop - 1]:.2f} s"
    return Offsets(values, REST, f"measured minus gravity torque at rest, {span}")


def find_rest(recording: Recording) -> slice | None:
    """The rows of the first REST_S in which no joint moves, nobody touches the arm and its torque is steady."""
    rows = round(REST_S * 1e6 / recording.period_us)
    still = np.abs(recording.qd).max(axis=1) <= REST_RAD_S
    if recording.touched is not None:
        still &= ~recording.touched
    still[1:] &= np.diff(recording.time_s) <= max(0.02, 2e-6 * recording.period_us)
    edges = np.flatnonzero(np.diff(still.astype(int), prepend=0, append=0)).reshape(-1, 2)
    window = max(1, round(WINDOW_S * 1e6 / recording.period_us))
    for first, last in edges:
        for begin in range(int(first), int(last) - rows + 1, window):
            end = begin + rows
            if recording.time_s[min(end, len(recording.time_s) - 1)] - recording.time_s[begin] < 0.98 * REST_S:
                continue
            blocks = [recording.tau[at : at + window].mean(axis=0) for at in range(begin, end - window + 1, window)]
            if np.ptp(np.array(blocks), axis=0).max() <= STEADY_NM:
                return slice(begin, end)
    return None


def _at_rest(recording: Recording, rest: slice, robot: Robot) -> FloatArray:
    """Raises InputError if the remaining torque looks like a payload, or not like a sensor's."""
    posture = recording.q[rest].mean(axis=0)
    dynamics = Dynamics(robot)
    gravity = dynamics.bias(posture, np.zeros(robot.n))
    offset: FloatArray = recording.tau[rest].mean(axis=0) - gravity
    _refuse_what_is_no_sensors(recording, offset, gravity, robot)
    refuse_payload(str(recording.path), offset, posture, robot)
    return offset


def refuse_payload(where: str, offset: FloatArray, posture: FloatArray, robot: Robot) -> None:
    """Raises InputError if offsets (n,) Nm from a rest in one posture (n,) rad look like a payload's weight.

    where   names the recording in the message
    """
    columns = weights(Dynamics(robot), posture, robot.gravity)
    priors = np.diag([0.1, 0.5, 0.5, 0.5])  # Nm per kg and per kg m: keeps the moments of a small payload small
    stacked = np.vstack([columns, priors])
    found = np.linalg.lstsq(stacked, np.append(offset, np.zeros(4)), rcond=None)[0]
    explained = 1 - float(((offset - columns @ found) ** 2).sum()) / max(float(offset @ offset), 1e-12)
    if abs(found[0]) > PAYLOAD_KG and explained > PAYLOAD_SHARE and np.abs(offset).max() > PAYLOAD_NM:
        raise InputError(
            f"{where}: at rest the torque differs by {np.abs(offset).max():.1f} Nm, as a payload of "
            f"{found[0]:+.2f} kg would: no offsets from it; name unloaded ones with --offsets, or another --robot"
        )


def _refuse_what_is_no_sensors(recording: Recording, offset: FloatArray, gravity: FloatArray, robot: Robot) -> None:
    for joint, (value, limits) in enumerate(zip(offset.tolist(), robot.joints, strict=True)):
        if abs(value) > limits.torque_max / 4:  # what the firmware's configuration may have
            sign = "; is its sign wrong?" if abs(value + 2 * gravity[joint]) < 0.3 * abs(value) else ""
            raise InputError(
                f"{recording.path}: joint {joint + 1} ({limits.name}) is {value:+.1f} Nm off the model's "
                f"{gravity[joint]:+.1f} Nm at rest, too much for a sensor's offset{sign}"
            )


def _from_file(path: Path, configuration: Configuration) -> Offsets:
    if path.suffix == ".toml":
        values = load_configuration(path, robot=configuration.robot).settings.sensor.offset_nm
        return Offsets(np.broadcast_to(np.array(values, float), configuration.robot.n).copy(), path.name, str(path))
    still = read_recording(path, configuration.robot.n)
    rest = find_rest(still)
    if rest is None:
        raise InputError(f"{path}: the arm never rests untouched for {REST_S:g} s, to give the offsets")
    return Offsets(_at_rest(still, rest, configuration.robot), path.name, f"at rest in {path}")


def _by_regression(recording: Recording, robot: Robot) -> Offsets:
    """Raises InputError if the motion is too short, or has too few postures to distinguish offsets from a payload."""
    dynamics, n = Dynamics(robot), robot.n
    good = np.ones(len(recording.time_s), bool) if recording.touched is None else ~recording.touched
    moving = good & (np.abs(recording.qd).max(axis=1) > FRICTION_RAD_S)
    moving_s = float(moving.sum()) * recording.period_us * 1e-6
    if moving_s < REGRESSION_S:
        raise InputError(
            f"{recording.path}: moves for {moving_s:.1f} s; --offsets {REGRESSION} needs {REGRESSION_S:g} s"
        )
    window = max(1, round(SMOOTHING_S * 1e6 / recording.period_us))
    speed, torque = _smooth(recording.qd, window), _smooth(recording.tau, window)
    acceleration = np.gradient(speed, recording.period_us * 1e-6, axis=0)
    rotor = np.array([joint.rotor_inertia for joint in robot.joints])
    inner = np.flatnonzero(good[window : len(good) - window]) + window
    columns, target = [], []
    for row in inner[np.linspace(0, len(inner) - 1, min(REGRESSION_ROWS, len(inner))).astype(int)]:
        direction = np.diag(np.clip(recording.qd[row] / FRICTION_RAD_S, -1.0, 1.0))
        columns.append(np.hstack([np.eye(n), direction, weights(dynamics, recording.q[row], robot.gravity)]))
        model = dynamics.inverse(recording.q[row], recording.qd[row], acceleration[row]) - rotor * acceleration[row]
        target.append(torque[row] - model)
    x, y = np.concatenate(columns), np.concatenate(target)
    used = _used(x)
    if not conditioned(x):
        raise InputError(
            f"{recording.path}: its postures are too similar to find offsets and a payload; give --offsets"
        )
    found = np.zeros(x.shape[1])
    found[used] = np.linalg.lstsq(x[:, used], y, rcond=None)[0]
    offset: FloatArray = found[:n]
    _refuse_what_is_no_sensors(recording, offset, np.zeros(n), robot)
    told = f"least squares over {moving_s:.0f} s of the file's own motion, with a payload of {found[2 * n]:+.2f} kg"
    return Offsets(offset, REGRESSION, told)


def conditioned(columns: FloatArray) -> bool:
    """Whether the regressors (k, columns) differ enough to separate offsets from a payload."""
    used = columns[:, _used(columns)]
    return float(np.linalg.cond(used / np.linalg.norm(used, axis=0))) <= LARGEST_CONDITION


def _used(columns: FloatArray) -> npt.NDArray[np.bool_]:
    """All but those of joints that never move: their friction cannot be found."""
    size = np.linalg.norm(columns, axis=0)
    result: npt.NDArray[np.bool_] = size > 0.02 * size.max()
    return result


def _smooth(values: FloatArray, window: int) -> FloatArray:
    if window < 2:
        return values
    kernel = np.ones(window) / window
    return np.stack([np.convolve(column, kernel, mode="same") for column in values.T], axis=1)


def weights(dynamics: Dynamics, posture: npt.NDArray[np.float64], gravity: FloatArray) -> FloatArray:
    """Torque (n, 4) for 1 kg, and for 1 kg m along each axis of the last link, at the end-effector point."""
    jacobian = dynamics.jacobian(posture)
    rotation = dynamics.tip(posture)[1]
    moments = [np.cross(rotation[:, axis], gravity) for axis in range(3)]
    return -np.stack([jacobian[:3].T @ gravity, *(jacobian[3:].T @ moment for moment in moments)], axis=1)
