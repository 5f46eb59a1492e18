"""No source file has more than 400 lines. A longer one is split by idea."""

import subprocess
from pathlib import Path

from checkout import ROOT

MOST_LINES = 400
SUFFIXES = {".c", ".h", ".py", ".cmake", ".ld", ".S", ".sh", ".js", ".css"}
# Generated files are the exceptions, as .gitattributes lists them.
LISTING = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
WRITTEN_BY_HAND = ":(exclude,attr:linguist-generated)"


def is_source(file: Path) -> bool:
    """By its suffix, or a script of tools."""
    return file.suffix in SUFFIXES or (file.suffix == "" and file.read_bytes()[:2] == b"#!")


def test_no_source_file_is_too_long() -> None:
    listed = subprocess.run([*LISTING, "--", WRITTEN_BY_HAND], cwd=ROOT, capture_output=True, text=True, check=True)
    sources = [ROOT / name for name in listed.stdout.split("\0") if name]
    sources = [file for file in sources if file.is_file() and is_source(file)]
    assert len(sources) > 300  # or the listing is none
    lines = {str(file.relative_to(ROOT)): file.read_bytes().count(b"\n") for file in sources}
    too_long = [f"{name}: {count} lines" for name, count in sorted(lines.items()) if count > MOST_LINES]
    assert too_long == []
