"""A scenario and its session: the robot and the guard as nodes of a bus, the pace of the cycles, the trace."""
