"""Violations that the gates must find, each planted in a copy of the checkout, and the copies themselves."""

import os
import shutil
import subprocess
import sys
import sysconfig
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from checkout import ROOT

LINT = "tests/gates/test_gates.py::test_lint"
DOCS = "tests/host/test_docs.py::test_"
LINKS = f"{DOCS}every_link_between_pages_leads_to_a_page_and_a_heading"
LAYERS = "tests/host/test_layers.py::test_"
SYMBOLS = "tests/target/test_core_symbols.py::test_"
BANK = "firmware/core/bank.c"
FUTURE_S = 4e9  # a modification time of files
# The compiled sources. A copy in which all but one of these sources are empty compiles in seconds.
COMPILED = ("firmware/**/*.c", "host/kernel/*.c")


@dataclass(frozen=True)
class Plant:
    """One violation.

    gate    the test that must fail: its node id, or that of a function with all its parameters
    file    the file that changes
    old     the text that is replaced; empty: `new` is appended, or is a new file
    says    text that the failure must contain
    alone   all other C sources of the firmware are empty in the copy
    needs   the tool of tools/toolbox that the gate needs
    """

    gate: str
    file: str
    old: str
    new: str
    says: str
    alone: bool = False
    needs: str = ""

    @property
    def edit(self) -> tuple[str, str, str]:
        return self.file, self.old, self.new


C_VIOLATION = "\nint bank_planted(long value);\nint bank_planted(long value) {\n    return value;\n}\n"

GOTO = """
void soft_planted(int *value);
void soft_planted(int *value) {
    goto end;
end:
    *value = 0;
}
"""

HEAP = """
#include <stdlib.h>
void *bank_planted(void);
void *bank_planted(void) {
    bank_t *const bank = malloc(sizeof *bank);
    *bank = (bank_t){0};
    return bank;
}
"""

SAME_BRANCHES = """
int detector_planted(int value);
int detector_planted(int value) {
    if (value == 1) {
        return value;
    } else {
        return value;
    }
}
"""

PLANTS = [
    Plant(f"{LINT}_gcc", BANK, "", C_VIOLATION, "-Werror=conversion", alone=True),
    Plant(f"{LINT}_clang", BANK, "", C_VIOLATION, "-Wshorten-64-to-32", alone=True, needs="clang"),
    Plant(f"{LINT}_misra", "firmware/core/soft.c", "", GOTO, r"soft\.c:\d+: 15\.1", alone=True),
    Plant(
        f"{LINT}_tidy",
        "firmware/core/detector.c",
        "",
        SAME_BRANCHES,
        r"detector\.c:\d+: .*bugprone-branch-clone",
        alone=True,
    ),
    Plant(f"{LINT}_types", "host/tauperp/errors.py", "", "\nPLANTED: int = 'text'\n", "Incompatible types"),
    Plant(f"{LINT}[format]", BANK, "", "\nint  planted ;\n", "bank.c:.*clang-format"),
    Plant(f"{LINT}[format]", "tests/checkout.py", "", "PLANTED  =  1\n", r"-PLANTED  =  1"),
    Plant(f"{LINT}[python]", "tests/checkout.py", "import functools", "import functools, shlex", "F401"),
    Plant(f"{LINT}[python]", "docs/guide.md", "", "\nThe guard starts anew.\n", "docs/guide.md:.*'anew'"),
    Plant(f"{LINT}[python]", "docs/guide.md", "", "\nThe guard recieves it.\n", "recieves ==> receives"),
    Plant(
        "tests/gates/test_gates.py::test_generated_files_are_current[dbc2c]",
        "firmware/wire/generated/protocol.h",
        "",
        "\n/* by hand */\n",
        r"protocol\.h",
    ),
    Plant(
        "tests/gates/test_gates.py::test_generated_files_are_current[robot2c]",
        "tests/robots/robot_panda.c",
        "",
        "\n/* by hand */\n",
        r"robot_panda\.c",
    ),
    Plant(
        "tests/gates/test_gates.py::test_generated_files_are_current[names2c]",
        "firmware/core/bank.h",
        "void bank_init(",
        "void bank_planted(void);\nvoid bank_init(",
        r"names\.h is not current",
    ),
    Plant(
        "tests/gates/test_file_size.py::test_no_source_file_is_too_long",
        "tests/target/planted.py",
        "",
        "# planted\n" * 401,
        "tests/target/planted.py: 401 lines",
    ),
    Plant(
        f"{LAYERS}no_include_goes_to_a_higher_layer",
        "firmware/wire/e2e.c",
        "",
        '\n#include "bank.h"\n',
        "wire/e2e.c -> core",
    ),
    Plant(
        f"{LAYERS}no_import_of_the_host_goes_to_a_higher_layer",
        "host/tauperp/sim/arm.py",
        "",
        "\nfrom tauperp.config import Settings\n",
        "sim/arm.py -> config",
    ),
    Plant(
        f"{LAYERS}a_lower_layer_builds_alone[wire-float]",
        "firmware/wire/e2e.c",
        "",
        '\n#include "scale.h"\n',
        "scale.h: No such file",
    ),
    Plant(
        f"{DOCS}every_link_between_pages_leads_to_a_page_and_a_heading",
        "docs/guide.md",
        "",
        "\n[gone](glossary.md#gone)\n",
        "glossary.md#gone",
    ),
    Plant(
        f"{DOCS}every_link_between_pages_leads_to_a_page_and_a_heading",
        "docs/porting.md",
        "",
        "\n[gone](gone.md)\n",
        "gone.md does not exist",
    ),
    Plant(f"{DOCS}links_of_the_readme_are_valid", "SECURITY.md", "", "\n[gone](gone.md)\n", "SECURITY.md: gone.md"),
    Plant(f"{DOCS}every_page_is_in_the_navigation", "mkdocs.yml", "  - Concepts: concepts.md\n", "", "concepts.md"),
    Plant(
        f"{DOCS}every_reason_has_advice_and_a_class",
        "docs/reasons.toml",
        "",
        "\n[Planted]\nmeans = ''\nlook = ''\n",
        "Planted",
    ),
    Plant(
        f"{DOCS}every_group_of_keys_is_explained_on_the_page_of_the_configuration",
        "docs/configuration.md",
        "`preset",
        "`",
        "preset",
    ),
    Plant(f"{DOCS}the_decisions_are_listed", "docs/decisions/new.md", "", "# New\n", "new.md"),
    Plant(
        "tests/host/test_front_door.py::test_every_macro_of_the_public_header_has_the_prefix",
        "firmware/api/tauperp.h",
        "#define TAUPERP_",
        "#define PLANTED 1\n#define TAUPERP_",
        "PLANTED",
    ),
    Plant(
        "tests/host/test_release.py::test_the_version_is_defined_once_and_the_citation_agrees",
        "CITATION.cff",
        "\nversion: ",
        "\nversion: 9",
        "'90",
    ),
    Plant(
        "tests/host/test_release.py::test_the_lock_pins_every_direct_dependency",
        "requirements.lock",
        "numpy==",
        "notnumpy==",
        "numpy",
    ),
    Plant(
        f"{SYMBOLS}the_firmware_needs_nothing_of_libm_and_no_double[m4f-float]",
        BANK,
        "",
        HEAP,
        "malloc",
        alone=True,
        needs="arm",
    ),
    Plant(
        "tests/target/test_worst_case.py::test_the_limits_agree_with_the_document",
        "docs/guard.md",
        "| cycle, float | ",
        "| cycle, float | 1",
        "cycle, float",
    ),
]


def copy_of_the_checkout(folder: Path) -> None:
    """All files that git tracks or would add, the built libraries, and a .venv that imports the copy's package."""
    listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listing, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    built = [str(file.relative_to(ROOT)) for file in ROOT.glob("build/**/libtauperp.so")]
    built += [str(file.relative_to(ROOT)) for file in ROOT.glob("build/**/tauperp.cdef.h")]
    # Results of mypy for unchanged files: it compares a hash of each file.
    cache = ROOT / ".mypy_cache"
    built += [str(file.relative_to(ROOT)) for file in cache.rglob("*")]
    for name in [name for name in names + built if name and (ROOT / name).is_file()]:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, folder / name)
    subprocess.run(["git", "init", "-q"], cwd=folder, check=True)  # tools/prose asks git for the files
    tools = folder / ".venv"
    packages = Path(*Path(sysconfig.get_path("purelib")).parts[-3:])  # lib/python3.x/site-packages
    (tools / packages).mkdir(parents=True)
    for part in (ROOT / ".venv" / packages).iterdir():
        if "editable" not in part.name and not part.name.startswith(
            "pip"
        ):  # the editable package would be that of the checkout
            (tools / packages / part.name).symlink_to(part)
    (tools / packages / "copy.pth").write_text(f"{folder / 'host'}\n")
    for name in ("bin", "pyvenv.cfg"):
        (tools / name).symlink_to(ROOT / ".venv" / name)
    stamp = subprocess.run("pwd -P | cksum | cut -d ' ' -f 1", shell=True, cwd=folder, capture_output=True, text=True)
    installed = tools / f"installed-{stamp.stdout.strip()}"
    installed.touch()
    os.utime(installed, (FUTURE_S, FUTURE_S))  # .venv stays current whatever is planted


def plant(folder: Path, group: list[Plant]) -> None:
    """The violations of one round."""
    for name, old, new in {violation.edit for violation in group}:
        file = folder / name
        text = file.read_text() if file.exists() else ""
        assert old in text, f"{name} has no {old!r} any more: choose another violation"
        file.write_text(text.replace(old, new, 1) if old else text + new)
    if group[0].alone:
        kept = {folder / violation.file for violation in group}
        for source in {file for pattern in COMPILED for file in folder.glob(pattern)} - kept:
            source.write_text("")


def rounds(plants: Iterable[Plant]) -> list[list[Plant]]:
    """Groups of violations that fit into one copy: one per gate, one per file, and all or none with `alone`."""
    result: list[list[Plant]] = []
    for new in plants:
        for group in result:
            apart = [old for old in group if old.gate == new.gate or old.alone != new.alone]
            if not apart and all(old.file != new.file or old.edit == new.edit for old in group):
                group.append(new)
                break
        else:
            result.append([new])
    return result


def failures(folder: Path, gates: list[str]) -> dict[str, str]:
    """The failure message of each of these tests that fails in the copy."""
    report = folder / "gates.xml"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    options = ["-vv", "-n0", "-p", "no:cacheprovider", f"--junitxml={report}"]
    command = [folder / ".venv" / "bin" / Path(sys.executable).name, "-m", "pytest", *options, *gates]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1, f"pytest ended with {done.returncode}:\n{done.stdout[-4000:]}{done.stderr[-4000:]}"
    found = {}
    for case in ElementTree.parse(report).iter("testcase"):
        file = case.get("classname", "").replace(".", "/") + ".py"
        said = [
            part.get("message", "") + (part.text or "") for kind in ("failure", "error") for part in case.iter(kind)
        ]
        if said:
            found[f"{file}::{case.get('name')}"] = "\n".join(said)
    return found
