"""The one runner: reports that come from the run inside tools/vcan."""

import json

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
