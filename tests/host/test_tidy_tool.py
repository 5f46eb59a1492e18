"""`make tidy`: a NOLINT must name its check and say why, and every C file of the firmware is checked."""

import sys
from pathlib import Path

import pytest
from checkout import ROOT

sys.path.insert(0, str(ROOT / "tools" / "tidy"))

import tidy


@pytest.mark.parametrize(
    "comment",
    [
        "/* NOLINTNEXTLINE(misc-use-internal-linkage): the startup code calls this function */",
        "/* NOLINTBEGIN(misc-use-internal-linkage): the startup code calls this function */\n"
        "/* NOLINTEND(misc-use-internal-linkage) */",
    ],
)
def test_a_nolint_with_a_check_and_a_reason_passes(
    comment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert verdict(comment, tmp_path, monkeypatch) == []


@pytest.mark.parametrize(
    "comment",
    [
        "/* NOLINT */",
        "/* NOLINT: the startup code calls this function */",
        "/* NOLINTNEXTLINE(misc-use-internal-linkage) */",
        "/* NOLINTBEGIN(misc-use-internal-linkage): because */",
    ],
)
def test_a_nolint_without_a_check_or_a_reason_is_named(
    comment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert verdict(comment, tmp_path, monkeypatch) == ["one.c:2: NOLINT needs a check in brackets and a reason"]


def verdict(comment: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    source = folder / "one.c"
    source.write_text(f"int one;\n{comment}\nint two;\n")
    monkeypatch.setattr(tidy, "ROOT", folder)
    return tidy.without_reason([source])


def test_every_c_file_of_the_boards_is_checked() -> None:
    checked = {Path(str(command["file"])) for command in tidy.of_the_boards()}
    assert checked == set((ROOT / "firmware" / "boards").rglob("*.c"))
