"""Robots: read from URDF, MJCF or the shipped models, made into the firmware's table, checked by other readers."""

from .load import load, shipped
from .model import Capsule, Joint, Robot
from .table import RobotTable

__all__ = ["Capsule", "Joint", "Robot", "RobotTable", "load", "shipped"]
