"""Fixtures that several files of tests share."""

import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from bus_logs import scenario

from tauperp.cli import main


@pytest.fixture(scope="session")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario of one collision, run once in each frame format and recorded as candump does.

    The workers of one run share it.
    """
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "logs"
    folder.mkdir(exist_ok=True)
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for form in ("fd", "classic"):
            log, whole = folder / f"{form}.log", folder / f"{form}.whole"
            if not whole.exists():
                assert main(["run", str(scenario(folder, form)), "--record", str(log), "--json"]) == 0
                whole.touch()
    return folder


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    """write(text) makes a file with this text; the text decides between URDF and MJCF."""

    def writer(text: str) -> Path:
        path = tmp_path / ("robot.urdf" if "<robot" in text else "robot.xml")
        path.write_text(text)
        return path

    return writer
