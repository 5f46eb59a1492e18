"""The quick harnesses of CBMC, and proofs that fail on a planted violation (tools/prove). All of them: make prove."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.needs("cbmc")]


def prove(*arguments: str | Path) -> tuple[int, str]:
    command = [sys.executable, ROOT / "tools" / "prove", *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def test_the_quick_proofs_pass_and_every_function_has_a_proof_or_a_reason() -> None:
    code, said = prove("--quick")
    assert code == 0, said


def planted(folder: Path, file: str, old: str, new: str) -> Path:
    """A copy of the firmware with one violation."""
    copy = folder / "firmware"
    shutil.copytree(ROOT / "firmware", copy)
    text = (copy / file).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (copy / file).write_text(text.replace(old, new), encoding="utf-8")
    return copy


@pytest.mark.parametrize(
    ("file", "old", "new", "harness", "says"),
    [
        ("core/num_fixed.c", "(int64_t)most * 4194304", "most * 4194304", "proof_num_narrow", "overflow"),
        ("guard/guard_rise.c", "i < joints;", "i <= joints;", "proof_rise", "bound"),
        ("guard/crc32.c", "crc & 0x0Fu];\n    }", "crc & 0x1Fu];\n    }", "proof_crc32", "bound"),
        ("guard/snapshot.c", "self->taken = true;", "", "proof_snapshot", "evaluated once"),
        (
            "core/soft.c",
            "x[i] = from[i];\n        along",
            "x[i] = from[i + 1u];\n        along",
            "proof_soft_reflect",
            "bound",
        ),
        ("core/jacobi.c", "at = c;", "at = c + 1u;", "proof_jacobi_sort", "bound"),
        ("core/bidiagonal.c", "4u);", "2u);", "proof_bidiagonal_negligible", "overflow"),
        ("guard/config_tasks.c", "; t < (uint32_t)TASK_COUNT;", "; t <= (uint32_t)TASK_COUNT;", "proof_tasks", "row"),
    ],
)
def test_a_planted_violation_turns_its_proof_red(
    tmp_path: Path, file: str, old: str, new: str, harness: str, says: str
) -> None:
    code, said = prove("--firmware", planted(tmp_path, file, old, new), harness)
    assert code == 1
    assert says in said


def test_a_function_without_a_proof_is_named(tmp_path: Path) -> None:
    old = "bool e2e_accepts(e2e_status_t status) {"
    copy = planted(tmp_path, "wire/e2e.c", old, f"void not_proved(void) {{}}\n{old}")
    code, said = prove("--firmware", copy, "--list")
    assert code == 1
    assert "wire/e2e.c:not_proved: in no harness" in said
