"""Tests that need vcan0 run in a second pytest inside tools/vcan. Its reports become those of this run.

Each group of tests has its own vcan0, so that two workers can share the groups. They mostly wait: `make test` has two
more workers than processors, and the others let the bus go first. The inner run of a group gets the names of the
selected tests in a file, and appends each of its reports as a line of JSON to another. The outer run reads that file as
it grows. In the inner run, where vcan0 exists, this module only writes.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Literal, TextIO

import pytest
from bus_groups import group_of, is_bus_test
from checkout import BUILD, REFUSED, ROOT, ci_accepts, lacking, make

REPORTS = "TAUPERP_BUS_REPORTS"
# Longer than the slowest test of the bus: only a session that hangs ends in this way.
SILENCE_S = 900
NICE = 10  # of the workers that do not run tests of the bus
PROGRAMS = (
    "library",
    "library-fixed",
    "guard",
    "guard-sanitized",
    "build/bus-peer",
    "build/bus-soak",
    "build/controller",
)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if is_bus_test(item.nodeid):
            item.add_marker("bus")
            item.add_marker(pytest.mark.needs("can"))


def report_data(line: str) -> dict[str, Any]:
    """A report as the inner run wrote it. The reason of a skip is a tuple for pytest, for which JSON has a list."""
    data: dict[str, Any] = json.loads(line)
    if isinstance(data["longrepr"], list):
        data["longrepr"] = tuple(data["longrepr"])
    return data


class Inner:
    """The run inside tools/vcan."""

    def __init__(self, config: pytest.Config, nodeids: list[str]) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="bus-", dir=BUILD)
        folder = Path(self._folder.name)
        (folder / "names").write_text("\n".join(nodeids) + "\n", encoding="utf-8")
        (folder / "reports").touch()
        self.log = folder / "log"
        command = [
            str(ROOT / "tools" / "vcan"),
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:xdist",
            "-p",
            "no:cacheprovider",
        ]
        command += [f"--seed={config.getoption('seed')}", f"@{folder / 'names'}"]
        environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST_", "MAKE"))}
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=ROOT,
                env=environment | {REPORTS: str(folder / "reports")},
            )
        self._reports: TextIO = open(folder / "reports", encoding="utf-8")  # noqa: SIM115 closed by `close`
        self._waiting: list[dict[str, Any]] = []
        self._rest = ""

    def reports_of(self, nodeid: str) -> list[dict[str, Any]] | None:
        """The reports of this test, including its teardown's; None if the run ended without them."""
        found: list[dict[str, Any]] = []
        end = time.monotonic() + SILENCE_S
        while time.monotonic() < end:
            ended = self.process.poll() is not None
            self._read()
            found += [report for report in self._waiting if report["nodeid"] == nodeid]
            self._waiting = [report for report in self._waiting if report["nodeid"] != nodeid]
            if any(report["when"] == "teardown" for report in found):
                return found
            if ended:
                return None
            time.sleep(0.1)
        self.process.terminate()
        return None

    def _read(self) -> None:
        *lines, self._rest = (self._rest + self._reports.read()).split("\n")
        self._waiting += [report_data(line) for line in lines]

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait(60)
        self._reports.close()
        self._folder.cleanup()


def report_of(item: pytest.Item, outcome: Literal["failed", "skipped"], text: Any) -> pytest.TestReport:
    return pytest.TestReport(item.nodeid, item.location, dict.fromkeys(item.keywords, 1), outcome, text, "setup")


def skipped(item: pytest.Item, reason: str) -> pytest.TestReport:
    """A skip, or a failure where CI=true forbids it. The same place for all tests, so pytest prints one line."""
    if ci_accepts(reason):
        return report_of(item, "skipped", (__file__, 0, f"Skipped: {reason}"))
    return report_of(item, "failed", REFUSED.format(reason))


class Outside:
    """The outer run, where vcan0 is missing."""

    def __init__(self) -> None:
        self._inner: Inner | None = None
        self._group = ""
        self._in_the_way = True

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> bool | None:
        if item.get_closest_marker("bus") is None:
            self._give_way(item.session.items)
            return None
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in self._reports(item):
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def _give_way(self, items: list[pytest.Item]) -> None:
        """Tests of the bus have deadlines: a worker that runs none leaves them the processors."""
        if self._in_the_way and "PYTEST_XDIST_WORKER" in os.environ:
            if any(item.get_closest_marker("bus") for item in items):
                os.nice(NICE)
            self._in_the_way = False

    def _reports(self, item: pytest.Item) -> list[pytest.TestReport]:
        reason = lacking(item)
        if reason:
            return [skipped(item, reason)]
        if self._inner is None or self._group != group_of(item.nodeid):
            self._inner = self._begin(item)
        found = self._inner.reports_of(item.nodeid)
        if found is None:
            return [self._without(item, self._inner)]
        hook = item.config.hook.pytest_report_from_serializable
        return [hook(config=item.config, data=report) for report in found]

    def _begin(self, item: pytest.Item) -> Inner:
        """The inner run of this test's group."""
        self.pytest_sessionfinish()
        make("-j2", *PROGRAMS, check=False)  # a program that does not build fails its tests in the inner run
        self._group = group_of(item.nodeid)
        others = [other.nodeid for other in item.session.items if other.get_closest_marker("bus")]
        return Inner(item.config, [nodeid for nodeid in others if group_of(nodeid) == self._group])

    @staticmethod
    def _without(item: pytest.Item, inner: Inner) -> pytest.TestReport:
        """The report of a test for which the inner run left none."""
        log = inner.log.read_text(encoding="utf-8", errors="replace")
        text = f"the run inside tools/vcan ended with {inner.process.wait(60)} before this test:\n{log[-4000:]}"
        if inner.process.returncode == 125:
            return skipped(item, f"no vcan0: {(log.strip().splitlines() or [''])[-1]}")
        return report_of(item, "failed", text)

    def pytest_sessionfinish(self) -> None:
        if self._inner is not None:
            self._inner.close()


class Inside:
    """The inner run, inside tools/vcan."""

    def __init__(self, path: str, config: pytest.Config) -> None:
        self._path, self._config = path, config

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        data = self._config.hook.pytest_report_to_serializable(config=self._config, report=report)
        with open(self._path, "a", encoding="utf-8") as file:
            file.write(json.dumps(data) + "\n")
            file.flush()
            os.fsync(file.fileno())  # the reader is outside this kernel


def pytest_configure(config: pytest.Config) -> None:
    if os.environ.get(REPORTS):
        config.pluginmanager.register(Inside(os.environ[REPORTS], config))
    elif not Path("/sys/class/net/vcan0").exists():
        config.pluginmanager.register(Outside())
