"""Every unexpected exception of the processor ends in a stop: no permission, a record on the UART, no further frame."""

import time
from pathlib import Path

import pytest
from checkout import ROOT, make
from emulator import BUILD, Emulator, versal_image

from tauperp.config import load_configuration

pytestmark = pytest.mark.needs("qemu", "arm")
PROVOCATIONS = {
    "write_code": "data abort",
    "execute_data": "prefetch abort",
    "undefined_instruction": "undefined instruction",
    "supervisor_call": "supervisor call",
    "no_memory": "data abort",
    "stack_overflow": "data abort",
}


def image_of(provocation: str) -> Path:
    image = BUILD / f"{provocation}.elf"
    make(str(image.relative_to(ROOT)))
    return image


@pytest.mark.parametrize(("provocation", "kind"), PROVOCATIONS.items())
def test_an_exception_withdraws_the_permission_and_is_reported(provocation: str, kind: str) -> None:
    with Emulator(image_of(provocation)) as emulator:
        emulator.wait_for("provoked")
        fault = emulator.wait_for("fault:")
        time.sleep(0.5)
        lines = list(emulator.lines)
    assert fault.startswith(f"fault: {kind} at ")
    assert "no permission" in lines
    assert lines.index("permission") < lines.index("no permission")
    assert not any("and continued" in line for line in lines)


def test_a_fault_is_kept_over_the_reset_and_reported_once(tmp_path: Path) -> None:
    with Emulator(image_of("undefined_instruction"), monitor=tmp_path / "monitor") as emulator:
        fault = emulator.wait_for("fault:")
        assert not any("before this start" in line for line in emulator.lines)
        emulator.reset()
        told = emulator.wait_for("before this start:")
        assert told.removeprefix("before this start: ") == fault.removeprefix("fault: ")
        time.sleep(0.5)
        assert sum("before this start" in line for line in emulator.lines) == 1
        assert emulator.lines.count("permission") == 2


def test_restarts_are_recognised_counted_and_limited(tmp_path: Path) -> None:
    """A reset as by the watchdog leaves the memory; the count in it increases up to its limit."""
    block = load_configuration("default", robot="ku_dex").block()
    with Emulator(versal_image("restarts", block, lockstep=False), monitor=tmp_path / "monitor") as emulator:
        emulator.wait_for("start 1 restarts 0")
        for restart in range(1, 5):
            emulator.wait_for("state 2" if restart == 1 else f"restarts {restart - 1}")
            emulator.reset()
            emulator.wait_for(f"start 3 restarts {restart}")
        emulator.wait_for("state 5 reason 29")


def test_an_exception_is_the_cause_of_the_next_start(tmp_path: Path) -> None:
    with Emulator(image_of("restarted_by_exception"), monitor=tmp_path / "monitor") as emulator:
        emulator.wait_for("start 1")
        emulator.wait_for("fault:")
        emulator.reset()
        emulator.wait_for("start 4")


def test_a_stack_overflow_is_caught_in_the_guard_below_the_stack() -> None:
    with Emulator(image_of("stack_overflow")) as emulator:
        words = emulator.wait_for("fault:").split()
    address = int(words[words.index("address") + 1], 16)
    assert 0x20000 <= address < 0x20100


def test_a_tick_over_its_budget_by_the_boards_own_clock_is_a_fault() -> None:
    """Without a robot. Even an idle tick exceeds a budget of 1 us, and stays within one of 0.5 ms."""
    for budget_us, state in ((1, "state 5 reason 14"), (500, "state 2 reason 3")):
        overrides = {"deadline": {"tick_budget_us": budget_us}}
        block = load_configuration("default", robot="ku_dex", overrides=overrides).block()
        with Emulator(versal_image(f"budget-{budget_us}", block, lockstep=False)) as emulator:
            emulator.wait_for(state)
            time.sleep(0.5)
            lines = list(emulator.lines)
        assert lines[-1].startswith(state)
        assert "permission" not in lines
