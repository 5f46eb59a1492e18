"""The one runner: reports that come from the run inside tools/vcan."""

import json
from types import SimpleNamespace

import bus_session
import pytest


def test_a_skip_inside_vcan_is_a_skip_outside_with_the_same_reason(pytestconfig: pytest.Config) -> None:
    location = ("tests/bus/test_start.py", 1, "test_unit")
    reason = ("tests/bus/test_start.py", 1, "Skipped: optional: no systemd")
    written = pytest.TestReport("tests/bus/test_start.py::test_unit", location, {}, "skipped", reason, "setup")
    hook = pytestconfig.hook
    line = json.dumps(hook.pytest_report_to_serializable(config=pytestconfig, report=written))
    data = bus_session.report_data(line)
    read = hook.pytest_report_from_serializable(config=pytestconfig, data=data)
    assert read.skipped
    assert read.longrepr == reason  # a tuple, which the JUnit file needs


def test_a_worker_without_the_bus_gives_way_once_if_the_run_has_tests_of_the_bus(
    monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    given: list[int] = []
    monkeypatch.setattr(bus_session.os, "nice", given.append)
    monkeypatch.setenv("PYTEST_XDIST_WORKER", "gw2")
    here = request.node

    class OnTheBus:
        def get_closest_marker(self, name: str) -> bool:
            return name == "bus"

    def runs(other: object) -> None:
        outside = bus_session.Outside()
        for _ in range(2):
            session = SimpleNamespace(items=[here, other])
            item = SimpleNamespace(get_closest_marker=here.get_closest_marker, session=session)
            assert outside.pytest_runtest_protocol(item) is None  # type: ignore[arg-type]

    runs(here)
    assert given == []
    runs(OnTheBus())
    assert given == [bus_session.NICE]
