"""Simulated sensors with the errors of real ones, in Python and in the campaign's kernel."""

import numpy as np
import pytest

from tauperp.campaign.draw import draw_sensors
from tauperp.kernel import layout
from tauperp.sim.arm import JointSample
from tauperp.sim.sensors import SENSOR_PRESETS, SensorModel, Sensors


def test_friction_has_the_sign_of_the_velocity() -> None:
    sensors = Sensors(SensorModel(torque_friction_nm=0.4), 3, np.random.default_rng(1))
    velocity = np.array([1.0, -1.0, 0.0])
    torque = sensors.read(JointSample(np.zeros(3), velocity, np.zeros(3)), 0.0).torque
    assert 0.2 <= torque[0] <= 0.4
    assert -0.4 <= torque[1] <= -0.2
    assert torque[2] == 0.0


def test_readings_come_in_steps() -> None:
    model = SensorModel(
        torque_noise_nm=0.3, torque_quantum_nm=0.05, velocity_quantum_rad_s=0.01, velocity_noise_rad_s=1
    )
    sensors = Sensors(model, 7, np.random.default_rng(1))
    reading = sensors.read(JointSample(np.zeros(7), np.zeros(7), np.zeros(7)), 0.0)
    assert reading.torque / 0.05 == pytest.approx(np.rint(reading.torque / 0.05), abs=1e-9)
    assert reading.velocity / 0.01 == pytest.approx(np.rint(reading.velocity / 0.01), abs=1e-9)


@pytest.mark.parametrize("name", list(SENSOR_PRESETS))
def test_the_kernel_gets_every_error_of_a_preset(name: str) -> None:
    model, drawn = SENSOR_PRESETS[name], np.zeros(1, layout.SENSORS)[0]
    draw_sensors(model, 7, np.random.default_rng(2), drawn)
    assert np.abs(drawn["offset"]).max() <= model.torque_offset_nm
    assert np.abs(drawn["gain"][:7] - 1).max() <= model.torque_gain_error
    assert (drawn["friction"][:7] >= 0.5 * model.torque_friction_nm).all()
    assert (drawn["friction"] <= model.torque_friction_nm).all()
    for field, value in (
        ("torque_noise", model.torque_noise_nm),
        ("velocity_noise", model.velocity_noise_rad_s),
        ("position_noise", model.position_noise_rad),
        ("torque_quantum", model.torque_quantum_nm),
        ("velocity_quantum", model.velocity_quantum_rad_s),
        ("delay", model.delay_cycles),
    ):
        assert drawn[field] == value
