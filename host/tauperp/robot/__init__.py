"""Robots: read from URDF, MJCF or the shipped models, converted to the firmware's table, and checked by other
readers."""

from tauperp.robot.load import load, shipped
from tauperp.robot.model import Capsule, Joint, Robot
from tauperp.robot.table import RobotTable, make_table

__all__ = ["Capsule", "Joint", "Robot", "RobotTable", "load", "make_table", "shipped"]
