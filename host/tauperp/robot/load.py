"""Robots by shipped name or by file."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tauperp.errors import InputError
from tauperp.robot.document import first_element, parse, read_bytes, text_of
from tauperp.robot.inertia import LENGTH_MAX_M
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
    accept_inertia: bool = False,
) -> Robot:
    """The robot of a shipped name, or of a URDF or MJCF file, which may be a pipe.

    base, tip: links (for tip also an MJCF site) between which the chain is taken; default: the root, the only end.
    tool: (3,) m, the end-effector point in the tip link's frame. base_rpy: (3,) rad, how the file's root frame stands
    in a world with z up, as URDF's roll, pitch, yaw; gravity in the base frame follows from it. accept_inertia: an
    inertia that no body can have becomes the nearest possible one, with a warning.
    Raises InputError, which names the file, joint or link, for every robot that cannot be guarded.
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

    data = read_bytes(path)
    text = text_of(data, path)
    kind = first_element(text, path)
    if kind == "robot":
        from tauperp.robot.urdf import essence, frame_warnings, read_urdf

        root = parse(text, path)
        chain = read_urdf(path, root).chain(
            base=base, tip=tip, tool=offset, mounting=mounting, accept_inertia=accept_inertia
        )
        warnings = (*frame_warnings(root), *chain.robot.warnings)
        document = essence(root, chain.changed)
    elif kind == "mujoco":
        from tauperp.robot.mjcf import read_mjcf

        tree, changes = read_mjcf(path, data, accept_inertia)
        chain = tree.chain(base=base, tip=tip, tool=offset, mounting=mounting)
        warnings, document = (*changes, *chain.robot.warnings), data
    else:
        raise InputError(f"{path}: <{kind}> is neither URDF (<robot>) nor MJCF (<mujoco>)")
    format_name = "urdf" if kind == "robot" else "mjcf"
    return replace(
        chain.robot,
        source=Source(path, format_name, document, chain.base, chain.tip, offset, mounting, accept_inertia),
        note=f"read from {path.name}",
        warnings=warnings,
    )


def _three_numbers(values: Sequence[float] | Array | None, what: str) -> Array:
    array = np.zeros(3) if values is None else np.asarray(values, dtype=float)
    if array.shape != (3,) or not np.all(np.abs(array) < LENGTH_MAX_M):
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
