"""The simulated cell: an arm in MuJoCo, people who touch it, and the robot controller as a node of the CAN bus."""
