"""Which columns of a table are the joints' readings, in which units and signs: defaults, or a TOML file (`--map`).

    [file]                  # of a .csv; detected by default
    separator = ";"
    decimal = ","

    [time]
    column = "t"            # default: time
    unit = "ms"             # s, ms, us, ns
    columns = ["stamp.sec", "stamp.nanosec"]    # or seconds and the nanoseconds to be added

    [position]
    column = "axis{}_deg"   # {} is the joint's number; default q{}
    first = 1               # the number of the first joint; default 0
    unit = "deg"            # rad, mrad, deg
    sign = [1, 1, -1, 1, 1, 1, 1]    # or one for all
    wrap = true             # angles become those within +-pi

    [velocity]              # dq{};    rad/s, mrad/s, deg/s
    [torque]                # tau_J{}; Nm, cNm, mNm
    columns = ["A1", "A2", "A3", "A4", "A5", "A6", "A7"]    # or every joint's own name, instead of a pattern
    sign = -1
    factor = [11.2, 11.2, 8.1, 8.1, 4.0, 4.0, 4.0]    # times the value: motor currents, Nm per ampere; default 1

    [acceleration]          # of the end-effector as commanded, base frame; default: none
    columns = ["ax", "ay", "az"]
    unit = "m/s2"           # m/s2, g

    [label]
    column = "touched"      # default label; optional

A column without {} holds a list with one value per joint, where the format has lists (.npz, .parquet, .mcap). In an
.mcap file a column is "topic:field", with dots into objects; time may be "log_time" or "publish_time", both in ns. Of a
message with a list `name`, as ROS' JointState, the values are picked by the robot's joint names, or by

    joints = ["joint_a", "joint_b", "joint_c"]    # at the top of the file
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from tauperp.errors import InputError
from tauperp.toml import Table, read_toml, validate

_DEGREE = float(np.deg2rad(1.0))
TIME_S: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLE_RAD: Mapping[str, float] = {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE}
SPEED_RAD_S: Mapping[str, float] = {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": _DEGREE}
TORQUE_NM: Mapping[str, float] = {"Nm": 1.0, "cNm": 1e-2, "mNm": 1e-3}
ACCELERATION_M_S2: Mapping[str, float] = {"m/s2": 1.0, "g": 9.80665}


class _Joints(Table):
    """One quantity of every joint."""

    column: str | None = Field(default=None, min_length=1)
    columns: list[str] | None = Field(default=None, min_length=1)
    first: int = Field(default=0, ge=0)
    sign: Literal[1, -1] | list[Literal[1, -1]] = 1
    factor: float | list[float] = 1.0

    @field_validator("column")
    @classmethod
    def _one_place(cls, column: str | None) -> str | None:
        if column is not None and column.count("{}") > 1:
            raise ValueError("has room for one joint number only, '{}'")
        return column

    @model_validator(mode="after")
    def _one_way(self) -> "_Joints":
        if self.column is not None and self.columns is not None:
            raise ValueError("must have either column or columns")
        return self


class _File(Table):
    separator: str | None = Field(default=None, min_length=1, max_length=1)
    decimal: Literal[",", "."] | None = None


class _Time(Table):
    column: str | None = Field(default=None, min_length=1)
    columns: list[str] | None = Field(default=None, min_length=2, max_length=2)
    unit: Literal["s", "ms", "us", "ns"] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> "_Time":
        if self.columns is not None and (self.column is not None or self.unit is not None):
            raise ValueError("columns are seconds and nanoseconds: without column and unit")
        return self


class _Position(_Joints):
    wrap: bool = False
    unit: Literal["rad", "mrad", "deg"] = "rad"


class _Velocity(_Joints):
    unit: Literal["rad/s", "mrad/s", "deg/s"] = "rad/s"


class _Torque(_Joints):
    unit: Literal["Nm", "cNm", "mNm"] = "Nm"


class _Acceleration(Table):
    columns: list[str] = Field(min_length=3, max_length=3)
    unit: Literal["m/s2", "g"] = "m/s2"


class _Label(Table):
    column: str = Field(default="label", min_length=1)


class _MapFile(Table):
    joints: list[str] | None = None
    file: _File = _File()
    time: _Time = _Time()
    position: _Position = _Position()
    velocity: _Velocity = _Velocity()
    torque: _Torque = _Torque()
    acceleration: _Acceleration | None = None
    label: _Label = _Label()


@dataclass(frozen=True)
class Column:
    """One column, or one that holds a list: `factors` turn its values into s, rad, rad/s or Nm, one for each."""

    name: str
    factors: tuple[float, ...]

    @property
    def width(self) -> int:
        return len(self.factors)


@dataclass(frozen=True)
class ColumnMap:
    """The columns for an arm with n joints. Widths add up to n, those of the acceleration to 3 or 0."""

    time: tuple[Column, ...]  # one, or two to be added
    position: tuple[Column, ...]
    velocity: tuple[Column, ...]
    torque: tuple[Column, ...]
    acceleration: tuple[Column, ...]
    label: Column
    label_needed: bool
    separator: str | None = None  # of a .csv; None: detected
    decimal: str | None = None
    wrap: bool = False
    names: tuple[str, ...] = ()  # of the joints, by which the values of a message with names are picked

    @property
    def readings(self) -> tuple[Column, ...]:
        """All but the label, in this order: time, position, velocity, torque, acceleration."""
        return (*self.time, *self.position, *self.velocity, *self.torque, *self.acceleration)


def column_map(joints: int, path: str | Path | None = None, names: Sequence[str] = ()) -> ColumnMap:
    """The default columns, or those of a map file. names: of the robot's joints, if the map has none.

    Raises InputError, with the file and the key's place, for an unknown key or one that does not fit the number of
    joints.
    """
    source = "map" if path is None else str(path)
    file = _MapFile() if path is None else validate(_MapFile, read_toml(path), source)

    def quantity(place: str, table: _Joints, unit: float, default: str) -> tuple[Column, ...]:
        signs = table.sign if isinstance(table.sign, list) else [table.sign] * joints
        own = table.factor if isinstance(table.factor, list) else [table.factor] * joints
        for key, values in (("sign", signs), ("factor", own)):
            if len(values) != joints:
                raise InputError(f"{source}: {place}.{key}: {len(values)} {key}s for {joints} joints")
        if 0.0 in own:
            raise InputError(f"{source}: {place}.factor: must not be 0, as for joint {own.index(0.0) + 1}")
        factors = [sign * factor * unit for sign, factor in zip(signs, own, strict=True)]
        columns = table.columns
        if columns is None:
            pattern = table.column or default
            if "{}" not in pattern:
                return (Column(pattern, tuple(factors)),)
            columns = [pattern.replace("{}", str(table.first + joint)) for joint in range(joints)]
        if len(columns) != joints:
            raise InputError(f"{source}: {place}.columns: {len(columns)} names for {joints} joints")
        return tuple(Column(name, (factor,)) for name, factor in zip(columns, factors, strict=True))

    if file.joints is not None and len(file.joints) != joints:
        raise InputError(f"{source}: joints: {len(file.joints)} names for {joints} joints")
    stamp: tuple[Column, ...] = (Column(file.time.column or "time", (TIME_S[file.time.unit or "s"],)),)
    if file.time.columns is not None:
        stamp = tuple(Column(name, (TIME_S[unit],)) for name, unit in zip(file.time.columns, ("s", "ns"), strict=True))
    acceleration: tuple[Column, ...] = ()
    if file.acceleration is not None:
        unit = ACCELERATION_M_S2[file.acceleration.unit]
        acceleration = tuple(Column(name, (unit,)) for name in file.acceleration.columns)
    return ColumnMap(
        time=stamp,
        position=quantity("position", file.position, ANGLE_RAD[file.position.unit], "q{}"),
        velocity=quantity("velocity", file.velocity, SPEED_RAD_S[file.velocity.unit], "dq{}"),
        torque=quantity("torque", file.torque, TORQUE_NM[file.torque.unit], "tau_J{}"),
        acceleration=acceleration,
        label=Column(file.label.column, (1.0,)),
        label_needed="label" in file.model_fields_set,
        separator=file.file.separator,
        decimal=file.file.decimal,
        wrap=file.position.wrap,
        names=tuple(file.joints or names),
    )
