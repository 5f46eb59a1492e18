"""The structs of host/kernel/kernel.h as numpy types: same order, same alignment. Their sizes are compared at load
time."""

import numpy as np

ABI = 6
JOINTS, GUARDS, DETECTORS, SECTIONS, WAVES, CHANNELS, COLUMNS = 8, 8, 16, 4, 3, 4, 6

NO_PUSH, PULSE, CONTACT, TOUCH, CLAMP = 0, 1, 2, 3, 4
PUSHES = {"pulse": PULSE, "contact": CONTACT, "touch": TOUCH, "clamp": CLAMP}
REST, MOVE, WAVE = 0, 1, 2
RESIDUAL, INDEX, OWN = 0, 1, 2

STATUSES = (
    "undone",
    "done",
    "not permitted",
    "false stop",
    "obstructed",
    "not touched",
    "diverged",
    "off the wire",
)  # kernel_status_t
UNDONE, DONE, NOT_PERMITTED, FALSE_STOP, OBSTRUCTED, NOT_TOUCHED, DIVERGED, OFF_WIRE = range(len(STATUSES))

F8, U8, U4, I4 = "f8", "u8", "u4", "i4"

SIGNAL = np.dtype([("per_unit", F8), ("shift", U4), ("mask", U4), ("min", I4), ("max", I4)], align=True)

MESSAGE = np.dtype(
    [
        ("signal", SIGNAL, 4),
        ("id", U4),
        ("length", U4),
        ("counter_is_cycle", U4),
        ("reserved", U4),
        ("data_ids", "u1", 16),
    ],
    align=True,
)

DETECTOR = np.dtype(
    [
        ("section", F8, (SECTIONS, 6)),
        ("threshold", F8, JOINTS),
        ("sections", U4),
        ("guard", U4),
        ("source", U4),
        ("debounce", U4),
    ],
    align=True,
)

SETUP = np.dtype(
    [
        ("plant", U8),
        ("nominal", U8),
        ("contact", U8),
        ("config", U8, GUARDS),
        ("mass", F8, JOINTS),
        ("inertia", F8, (JOINTS, 3)),
        ("torque_max", F8, JOINTS),
        ("capsule", F8, (JOINTS, 7)),
        ("bandwidth_rad_s", F8),
        ("deceleration_rad_s2", F8),
        ("config_size", U8),
        ("period_us", U4),
        ("substeps", U4),
        ("joints", U4),
        ("guards", U4),
        ("detectors", U4),
        ("fd", U4),
        ("channels", U4),
        ("reserved", U4),
        ("body", I4, JOINTS),
        ("payload", I4),
        ("tip", I4),
        ("hand_geom", I4),
        ("hand_body", I4),
        ("hand_position", I4),
        ("hand_speed", I4),
        ("link_geom", I4, JOINTS),
        ("pair", I4, JOINTS),
        ("sync", MESSAGE),
        ("task", MESSAGE),
        ("reset", MESSAGE),
        ("joint", MESSAGE, JOINTS),
        ("detector", DETECTOR, DETECTORS),
    ],
    align=True,
)

SENSORS = np.dtype(
    [
        ("offset", F8, JOINTS),
        ("gain", F8, JOINTS),
        ("ripple", F8, JOINTS),
        ("phase", F8, JOINTS),
        ("friction", F8, JOINTS),
        ("torque_noise", F8),
        ("velocity_noise", F8),
        ("position_noise", F8),
        ("torque_quantum", F8),
        ("velocity_quantum", F8),
        ("position_quantum", F8),
        ("ripple_per_turn", F8),
        ("delay", U4),
        ("reserved", U4),
    ],
    align=True,
)

RUN = np.dtype(
    [
        ("start", F8, JOINTS),
        ("goal", F8, JOINTS),
        ("amplitude", F8, (WAVES, JOINTS)),
        ("frequency", F8, WAVES),
        ("phase", F8, WAVES),
        ("move_s", F8),
        ("duration_s", F8),
        ("payload_mass", F8),
        ("payload_com", F8, 3),
        ("payload_inertia", F8, 3),
        ("mass_scale", F8, JOINTS),
        ("guide_force", F8, 3),
        ("guide_moment", F8, 3),
        ("guide_start_s", F8),
        ("guide_rise_s", F8),
        ("guide_hold_s", F8),
        ("point", F8, 3),
        ("direction", F8, 3),
        ("force_n", F8),
        ("push_s", F8),
        ("onset_s", F8),
        ("along", F8),
        ("angle", F8),
        ("part_mass", F8),
        ("part_stiffness", F8),
        ("part_radius", F8),
        ("speed_m_s", F8),
        ("sensors", SENSORS),
        ("seed", U8),
        ("number", U8),
        ("task", U4),
        ("motion", U4),
        ("push", U4),
        ("link", U4),
        ("obeys", U4),
        ("reserved", U4),
    ],
    align=True,
)

RESULT = np.dtype(
    [
        ("onset_s", F8),
        ("release_s", F8),
        ("stop_s", F8),
        ("force_at_stop_n", F8),
        ("peak_force_n", F8),
        ("peak_force_after_stop_n", F8),
        ("mean_force_after_stop_n", F8),
        ("tip_speed_m_s", F8),
        ("free_s", F8),
        ("simulated_s", F8),
        ("stop_value_nm", F8),
        ("stop_threshold_nm", F8),
        ("contact_force", F8, 3),
        ("true_force", F8, 3),
        ("before", F8, DETECTORS),
        ("during", F8, DETECTORS),
        ("delay_s", F8, DETECTORS),
        ("early_s", F8, DETECTORS),
        ("free_max", F8, (DETECTORS, JOINTS)),
        ("channel_max", F8, (CHANNELS, JOINTS)),
        ("number", U8),
        ("status", U4),
        ("reason", U4),
        ("joint", U4),
        ("link", U4),
        ("stops", U4),
        ("contact_link", U4),
        ("contact_class", U4),
        ("input_stops", U4),
    ],
    align=True,
)

RECORDING = np.dtype(
    [("position", U8), ("velocity", U8), ("torque", U8), ("cycle", U8), ("rows", U4), ("task", U4)], align=True
)

INJECTION = np.dtype(
    [
        ("point", F8, 3),
        ("direction", F8, 3),
        ("force_n", F8),
        ("push_s", F8),
        ("number", U8),
        ("row", U4),
        ("link", U4),
    ],
    align=True,
)
