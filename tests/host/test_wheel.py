"""The package outside a checkout: source distribution, wheel, and the commands of an installed wheel."""

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from tauperp import __version__
from tauperp.cli import COMMANDS
from tauperp.files import repository_root

ROOT = repository_root()
OLDEST_GLIBC = (2, 17)  # of manylinux2014
FROM_PYPI = {
    "can": "python-can",
    "e2e": "autosar-e2e",
    "mujoco": "mujoco-core",
    "pinocchio": "pin",
    "OpenGL": "pyopengl",
}
FROM_PYPI |= {"rerun": "rerun-sdk", "dask": "distributed", "mpl_toolkits": "matplotlib", "PIL": "pillow"}
FROM_PYPI |= {"mcap_ros2": "mcap-ros2-support", "annotated_types": "annotated-types"}

STRUCK = """
robot = "ku_dex"
config = "paper"
start_rad = [0.29, 0.84, -1.06, 1.59, -0.19, 1.23, 0.03]
[[phase]]
name = "struck"
task = "contact"
do = [{ yield_s = 1.5 }]
[[phase.strike]]
after_s = 0.5
link = 4
direction = [0.0, 0.6, -0.8]
part = "forearm"
push_n = 100.0
"""


def _run(command: list[str | Path], folder: Path, **environment: str) -> str:
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "TAUPERP"))}
    tools = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        command, cwd=folder, env=clean | {"PATH": tools} | environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the source distribution: a file missing there is missing here."""
    folder = tmp_path_factory.mktemp("dist")
    hook = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
    _run([sys.executable, "-c", hook, folder], ROOT)
    (source,) = folder.glob("tauperp-*.tar.gz")
    options = ["--quiet", "--no-build-isolation", "--no-deps", "--wheel-dir", str(folder)]
    _run([sys.executable, "-m", "pip", "wheel", *options, source], folder)
    (built,) = folder.glob("tauperp-*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bin folder of a new environment that contains the wheel and uses the dependencies of this environment."""
    folder = tmp_path_factory.mktemp("elsewhere")
    _run([sys.executable, "-m", "venv", "--without-pip", folder / "env"], folder)
    python = folder / "env" / "bin" / "python"
    _run([sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", wheel], folder)
    return python.parent


@pytest.fixture
def dependencies() -> dict[str, str]:
    """A path entry brings packages, but not the .pth file of the editable installation."""
    return {"PYTHONPATH": os.pathsep.join(entry for entry in sys.path if "site-packages" in entry)}


def test_the_wheel_serves_every_python_and_has_the_right_version(wheel: Path) -> None:
    assert wheel.name.startswith(f"tauperp-{__version__}-py3-none-")


def test_the_libraries_in_the_wheel_run_on_old_systems(wheel: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        for name in ("tauperp/native/libtauperp.so", "tauperp/native/fixed/libtauperp.so"):
            needed = _run(["readelf", "--version-info", archive.extract(name, tmp_path)], tmp_path)
            for version in re.findall(r"GLIBC_(\d+)\.(\d+)", needed):
                assert tuple(map(int, version)) <= OLDEST_GLIBC, name


def test_the_installed_command_makes_a_robot_table(
    installed: Path, dependencies: dict[str, str], tmp_path: Path
) -> None:
    (model,) = installed.parent.rglob("tauperp/robot/models/ku_dex.xml")
    _run([installed / "tauperp", "robot", model, "-o", tmp_path / "ku_dex.c"], tmp_path, **dependencies)
    assert (tmp_path / "ku_dex.c").is_file()


def test_the_installed_command_simulates_a_collision(
    installed: Path, dependencies: dict[str, str], tmp_path: Path
) -> None:
    (tmp_path / "struck.toml").write_text(STRUCK)
    said = _run([installed / "tauperp", "run", "struck.toml", "--json"], tmp_path, **dependencies)
    assert json.loads(said)["hashes"]["firmware_version"] == __version__


@pytest.mark.parametrize("numeric", ["float32", "q9.22"])
def test_the_installed_core_computes_in_both_number_types(
    installed: Path, dependencies: dict[str, str], tmp_path: Path, numeric: str
) -> None:
    program = (
        "import sys, numpy, tauperp\n"
        "from tauperp.firmware import Core\n"
        f"core = Core('panda', numeric={numeric!r})\n"
        "print(tauperp.__file__, core.terms(numpy.zeros(7), numpy.zeros(7)).gravity.shape)\n"
    )
    said = _run([installed / "python", "-c", program], tmp_path, **dependencies)
    assert said.startswith(str(installed.parent)), "the package of the checkout was imported"
    assert said.strip().endswith("(7,)")


def test_the_message_for_a_missing_kernel_is_right_without_a_checkout(
    installed: Path, dependencies: dict[str, str], tmp_path: Path
) -> None:
    program = "from tauperp.kernel.bench import load_kernel; load_kernel()"
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "TAUPERP"))}
    command = [installed / "python", "-c", program]
    done = subprocess.run(command, cwd=tmp_path, env=clean | dependencies, capture_output=True, text=True, check=False)
    assert "not part of the installed package" in done.stderr


def test_every_third_party_import_is_a_declared_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [
        *project["dependencies"],
        *(line for extra in project["optional-dependencies"].values() for line in extra),
    ]
    declared = {re.split(r"[\[<>=~ ]", line)[0].lower() for line in wanted}
    for file in (ROOT / "host" / "tauperp").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            modules += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            for root in {module.partition(".")[0] for module in modules} - set(sys.stdlib_module_names) - {"tauperp"}:
                assert FROM_PYPI.get(root, root).lower() in declared, f"{file}: {root}"


def test_every_subcommand_is_in_the_package(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert [name for name in COMMANDS if f"tauperp/commands/{name}.py" not in names] == []
