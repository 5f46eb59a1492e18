"""Robots by shipped name or by file."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tauperp.errors import InputError
from tauperp.robot.model import Robot, Source
from tauperp.robot.spatial import Array, rotation_rpy

MODELS = Path(__file__).parent / "models"


def shipped() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    return tuple(sorted(path.stem for path in MODELS.iterdir() if path.suffix in (".xml", ".toml")))


def load(
    name_or_path: str | Path,
    *,
    base: str | None = None,
    tip: str | None = None,
    tool: Sequence[float] | Array | None = None,
    base_rpy: Sequence[float] | Array | None = None,
) -> Robot:
    """The robot of a shipped name, or of a URDF or MJCF file.

    base, tip: links (for tip also an MJCF site) between which the chain is taken; default: the root, the only end.
    tool: (3,) m, the end-effector point in the tip link's frame. base_rpy: (3,) rad, how the file's root frame stands
    in a world with z up, as URDF's roll, pitch, yaw; gravity in the base frame follows from it.
    Raises InputError, which names the file, joint or link, for whatever cannot be guarded.
    """
    offset = _three_numbers(tool, "tool")
    mounting = rotation_rpy(*_three_numbers(base_rpy, "base-rpy"))
    path = _find(name_or_path)
    if path.suffix == ".toml":
        from tauperp.robot.descriptor import read_descriptor

        if base is not None or tip is not None:
            raise InputError(f"robot '{path.stem}' is one chain: it has no other base or tip")
        robot = read_descriptor(path)
        return replace(robot, tip=robot.tip + robot.tip_rotation @ offset, gravity=mounting.T @ robot.gravity)

    root = _parse(path)
    if root.tag == "robot":
        from tauperp.robot.urdf import read_urdf

        tree, kind = read_urdf(path, root), "urdf"
    elif root.tag == "mujoco":
        from tauperp.robot.mjcf import read_mjcf

        tree, kind = read_mjcf(path), "mjcf"
    else:
        raise InputError(f"{path}: <{root.tag}> is neither URDF (<robot>) nor MJCF (<mujoco>)")
    robot, base_link, tip_link = tree.chain(base=base, tip=tip, tool=offset, mounting=mounting)
    return replace(
        robot, source=Source(path, kind, base_link, tip_link, offset, mounting), note=f"read from {path.name}"
    )


def _three_numbers(values: Sequence[float] | Array | None, what: str) -> Array:
    array = np.zeros(3) if values is None else np.asarray(values, dtype=float)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise InputError(f"{what}: three numbers are needed")
    return array


def _find(name_or_path: str | Path) -> Path:
    """The file of a shipped name or of a path; a shipped name wins, `./name` is always a file."""
    if str(name_or_path) in shipped():
        stem = str(name_or_path)
        return next(path for path in (MODELS / f"{stem}.toml", MODELS / f"{stem}.xml") if path.exists())
    path = Path(name_or_path)
    if path.is_dir():
        raise InputError(f"{path}: a folder, not a URDF or MJCF file")
    if not path.exists():
        raise InputError(f"{path}: no such file, and no shipped robot of that name ({', '.join(shipped())})")
    return path


def _parse(path: Path) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(path.read_bytes())
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: not well-formed XML ({error})") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
