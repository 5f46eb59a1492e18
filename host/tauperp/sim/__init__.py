"""The physics of a simulated cell: an arm in MuJoCo, its sensors and control, and people who touch it."""
