"""The shared library, loaded by cffi in ABI mode: declarations from the firmware's own headers, no compiler needed."""

import dataclasses
import functools
import hashlib
import os
from pathlib import Path
from typing import Any

import cffi
import numpy as np
import numpy.typing as npt

from tauperp.config import NUMERICS, Numeric
from tauperp.config.block import block_dtype
from tauperp.errors import InputError
from tauperp.files import build_dir, how_to_build

ENVIRONMENT = "TAUPERP_LIBRARY"  # path of a library to load instead of the built one

_FOLDERS: dict[Numeric, str] = {"float32": "", "q9.22": "fixed"}
_TARGETS: dict[Numeric, str] = {"float32": "library", "q9.22": "library-fixed"}
_FRACTION = 2.0**22  # of Q9.22

FloatArray = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Library:
    """One build of the firmware. `ffi` and `lib` are cffi's; structs are made by `new` and read through `view`."""

    path: Path
    numeric: Numeric
    ffi: Any
    lib: Any

    @property
    def version(self) -> str:
        """Release of the firmware, major.minor.patch."""
        number = self.lib.tauperp_version()
        return f"{number >> 16}.{number >> 8 & 0xFF}.{number & 0xFF}"

    @functools.cached_property
    def hash(self) -> str:
        """First 12 hex digits of the library file's SHA-256."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest()[:12]

    @property
    def scalar(self) -> np.dtype[Any]:
        """num_t as a numpy type."""
        return np.dtype(np.float32 if self.numeric == "float32" else np.int32)

    def new(self, declaration: str) -> Any:
        """A zeroed C object, e.g. new("motion_t *"). It is valid as long as the returned object exists."""
        return self.ffi.new(declaration)

    def view(self, member: Any) -> npt.NDArray[Any]:
        """An array of num_t in C as a flat numpy array on the same memory. The caller keeps the C object alive."""
        return np.frombuffer(self.ffi.buffer(member), self.scalar)

    def to_num(self, values: FloatArray) -> npt.NDArray[Any]:
        """Convert physical units to num_t, rounded once. Raises ValueError for a value that does not fit."""
        if self.numeric == "float32":
            return values.astype(np.float32)
        scaled = np.rint(values * _FRACTION)
        if not (np.abs(scaled) < 2.0**31).all():
            raise ValueError("a value is outside the +-512 of Q9.22")
        return scaled.astype(np.int32)

    def from_num(self, values: npt.NDArray[Any]) -> FloatArray:
        """Convert num_t to physical units; always a copy."""
        result = values.astype(np.float64)
        return result if self.numeric == "float32" else result / _FRACTION

    def load_block(self, block: bytes) -> Any:
        """A guard_config_t of these bytes. Raises InputError if they are not as many as this firmware's block has."""
        config = self.new("guard_config_t *")
        size = self.ffi.sizeof("guard_config_t")
        if len(block) != size:
            raise InputError(f"configuration block: {len(block)} bytes, and this firmware's has {size}")
        self.ffi.memmove(config, block, size)
        return config


@functools.cache
def load_library(numeric: Numeric = "float32") -> Library:
    """The built firmware for these numbers, or the library that the environment's TAUPERP_LIBRARY names.

    Raises InputError if it is missing, is not Tauperp's, or is not the requested build.
    """
    if numeric not in NUMERICS:
        raise InputError(f"numeric: {numeric!r} is unknown (there are {', '.join(NUMERICS)})")
    given = os.environ.get(ENVIRONMENT)
    path = Path(given) if given else build_dir() / _FOLDERS[numeric] / "libtauperp.so"
    declarations = path.with_name("tauperp.cdef.h")
    for file in (path, declarations):
        if not file.is_file():
            raise InputError(f"{file}: the firmware's library is missing; {how_to_build(_TARGETS[numeric])}")
    ffi = cffi.FFI()
    try:
        ffi.cdef(declarations.read_text(encoding="utf-8"))
        lib = ffi.dlopen(str(path.resolve()))
        library = Library(path, numeric, ffi, lib)
        found, size = lib.tauperp_numeric(), lib.tauperp_config_size()
    except (OSError, AttributeError, cffi.CDefError) as error:
        raise InputError(f"{path}: not a library of the Tauperp firmware: {error}") from error
    if found != NUMERICS[numeric]:
        other = next((name for name, number in NUMERICS.items() if number == found), "unknown numbers")
        raise InputError(f"{path}: built for {other}, not {numeric}")
    if size != block_dtype(numeric).itemsize or size != ffi.sizeof("guard_config_t"):
        raise InputError(f"{path}: older than the sources; {how_to_build(_TARGETS[numeric])}")
    return library
