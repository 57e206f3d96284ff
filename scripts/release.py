"""What a release consists of, and the first minute of somebody who installs it.

    python scripts/release.py make [--tag v0.1.0]     everything, from the last commit, into build/release
    python scripts/release.py try build/release/dist  install it into a new environment and use it

``make release-check`` does both. ``make`` needs the extras boards, test and docs. ``try`` needs Python alone; with
``--offline`` the wheels of the dependencies lie in the folder ``wheels`` beside the distribution.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RELEASE = ROOT / "build" / "release"
CONSTRAINTS = ROOT / "pip-constraints.txt"
FIRST = "sim,view"
"""The extras of the first minute."""


def main() -> int:
    """The command; its status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    steps = parser.add_subparsers(dest="step", required=True)
    made = steps.add_parser("make", help="build everything from the last commit")
    made.add_argument("--tag", help="refuse a tag that is not the version's")
    tried = steps.add_parser("try", help="install a distribution and use it")
    tried.add_argument("dist", type=Path)
    tried.add_argument("--offline", action="store_true", help="take dependencies from the folder wheels beside it")
    args = parser.parse_args()
    if args.step == "make":
        make(args.tag)
    else:
        first_minute(args.dist, args.offline)
    return 0


def make(tag: str | None) -> None:
    """Write ``tree``, ``dist``, ``kits``, ``docs`` and ``wheels`` below :data:`RELEASE`."""
    shutil.rmtree(RELEASE, ignore_errors=True)
    tree = exported(RELEASE / "tree")
    if tag is not None and tag != (version := f"v{run('import contactfpga; print(contactfpga.__version__)', tree)}"):
        sys.exit(f"the tag is {tag}, the package's version {version}; change one of them")
    run("from contactfpga_sim import carried; carried.check()", tree)
    command("-m", "contactfpga_sim.lab", "--check", tree=tree, cwd=tree)
    bitstreams(tree, RELEASE / "kits")
    dist = RELEASE / "dist"
    wheels(tree, dist, needed=tag is not None)
    command("-m", "sphinx", "-W", "-q", "-b", "html", tree / "docs", RELEASE / "docs", tree=tree)
    (wheel,) = dist.glob("*-any.whl")
    pip = ("-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--constraint", CONSTRAINTS)
    command(*pip, "--dest", RELEASE / "wheels", f"{wheel}[{FIRST}]")
    (RELEASE / "wheels" / wheel.name).unlink()
    files = sorted([*dist.iterdir(), *(RELEASE / "kits").iterdir()])
    sums = "".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files)
    (RELEASE / "SHA256SUMS").write_text(sums)
    print(sums, end="")


def exported(folder: Path) -> Path:
    """The files of the last commit, and nothing that lies beside them."""
    folder.mkdir(parents=True)
    packed = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
    # Not by tarfile, whose filters came with Python 3.11.4; Debian 12 has 3.11.2.
    subprocess.run(["tar", "-xf", "-"], cwd=folder, input=packed, check=True)
    return folder


PLATFORMS = {
    "manylinux2014_x86_64": "x86_64-linux-gnu.2.17",
    "manylinux2014_aarch64": "aarch64-linux-gnu.2.17",
    "macosx_11_0_x86_64": "x86_64-macos.11.0",
    "macosx_11_0_arm64": "aarch64-macos.11.0",
}
"""Wheels with the reader in C, and what Zig calls their systems. On others the wheel is pure Python."""


def wheels(tree: Path, dist: Path, needed: bool) -> None:
    """The source distribution, a wheel for any system, and those of :data:`PLATFORMS`, which one compiler makes;
    without it they are left out unless they are ``needed``."""
    command("-m", "hatchling", "build", "--directory", dist, cwd=tree, CONTACTFPGA_CC="none")
    if importlib.util.find_spec("ziglang") is None:
        if needed:
            sys.exit("Zig compiles the reader in C for all systems; install the extra release")
        print("without Zig, of the extra release, there is only the wheel in pure Python")
        return
    for platform, target in PLATFORMS.items():
        compiler = f"{shlex.quote(sys.executable)} -m ziglang cc -target {target}"
        settings = {"CONTACTFPGA_CC": compiler, "CONTACTFPGA_PLATFORM": platform}
        command("-m", "hatchling", "build", "--target", "wheel", "--directory", dist, cwd=tree, **settings)
        if not list(dist.glob(f"*-{platform}.whl")):
            sys.exit(f"the reader in C could not be compiled for {platform}; what the compiler said is above")


def bitstreams(tree: Path, folder: Path) -> None:
    """Build that of each kit twice, compare, and put one where the wheel is built from. ``folder`` has copies."""
    folder.mkdir()
    for kit in run("from contactfpga.design import kits; print(*kits.names())", tree).split():
        built = [build(tree, kit, RELEASE / "built" / f"{kit}-{turn}") for turn in (1, 2)]
        one, other = (file.read_bytes() for file in built)
        if one != other:
            sys.exit(f"two builds of the kit {kit} gave two bitstreams: {built[0]} and {built[1]}")
        shutil.copy(built[0], tree / "examples" / "kits" / kit)
        shutil.copy(built[0], folder / f"contactfpga-{kit}{built[0].suffix}")


def build(tree: Path, kit: str, folder: Path) -> Path:
    """The bitstream of a kit, built in ``folder``."""
    text = command("-m", "contactfpga", "build", "--kit", kit, "--output", folder, "--json", tree=tree)
    return Path(json.loads(text)["bitstream"])


def first_minute(dist: Path, offline: bool) -> None:
    """Install the wheel into a new environment; with no compiler on the PATH, read zones from a virtual board."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scripts = environment(folder / "venv", dist.resolve(), offline)
        (folder / "bin").mkdir()
        clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "PIP_"))}
        alone = clean | {"PATH": str(folder / "bin"), "CONTACTFPGA_CACHE": str(folder / "cache")}
        started = time.monotonic()
        found = subprocess.run(
            [scripts / "contactfpga", "zones", "sim://", "--seconds", "0.3"],
            cwd=folder, env=alone, text=True, capture_output=True, timeout=120,
        )  # fmt: skip
        print(found.stdout[-2000:], found.stderr[-2000:], sep="\n")
        if found.returncode or "mm" not in found.stdout:
            sys.exit(f"contactfpga zones sim:// ended with status {found.returncode} and showed no zone")
        print(f"zones of a virtual board, with no compiler: {time.monotonic() - started:.1f} s")
        missing = "from contactfpga.driver import native; print(native.missing())"
        why = subprocess.run([scripts / "python", "-c", missing], env=clean, text=True, capture_output=True, check=True)
        print(f"reader in C: {why.stdout.strip() or 'yes'}")
        if why.stdout.strip() and os.name == "posix" and len(list(dist.glob("*.whl"))) > 1:
            sys.exit("no wheel had a reader in C that this system loads")


def environment(folder: Path, dist: Path, offline: bool) -> Path:
    """A new environment with the wheel of this system and the extras :data:`FIRST`; returns the folder of its
    commands."""
    venv.create(folder, with_pip=True)
    scripts = folder / ("Scripts" if os.name == "nt" else "bin")
    pip = [scripts / "python", "-m", "pip", "--isolated"]
    chosen = [*pip, "download", "--quiet", "--no-deps", "--no-index", "--find-links", dist, "--only-binary", ":all:"]
    subprocess.run([*chosen, "--dest", folder / "chosen", "contactfpga"], check=True)
    (wheel,) = (folder / "chosen").glob("*.whl")
    source = ["--no-index", "--find-links", dist.parent / "wheels"] if offline else []
    installed = [*pip, "install", "--quiet", "--constraint", CONSTRAINTS, *source]
    subprocess.run([*installed, f"{wheel}[{FIRST}]"], check=True)
    return scripts


def run(program: str, tree: Path) -> str:
    """What a Python program prints, with the packages of ``tree``."""
    return command("-c", program, tree=tree).strip()


def command(*words: object, tree: Path | None = None, cwd: Path | None = None, **more: str) -> str:
    """What this Python prints when it is called with these arguments, with the packages of ``tree`` if one is given.
    ``more``: in its environment."""
    paths = os.pathsep.join(str(tree / name) for name in ("py", "hdl", "sim")) if tree else ""
    env = os.environ | ({"PYTHONPATH": paths} if tree else {}) | more
    call = [sys.executable, *map(str, words)]
    return subprocess.run(call, cwd=cwd or ROOT, env=env, check=True, text=True, stdout=subprocess.PIPE).stdout


if __name__ == "__main__":
    sys.exit(main())
