"""Compiles the thread in C that reads ports (c/reader.c), where there is a C compiler; without one the package is pure
Python and says so (`contactfpga doctor`).

CONTACTFPGA_CC names the compiler and its first arguments, ``none`` for no library; CONTACTFPGA_PLATFORM the platform
tag of a wheel that it compiles for. ``python hatch_build.py`` compiles into the source tree, as an editable install
does.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # a compiler is all that the source tree needs
    BuildHookInterface = object

ROOT = Path(__file__).resolve().parent
PLACE = "contactfpga/driver/_reader.so"
"""In the wheel, and below ``py`` in the source tree."""
OPTIONS = ["-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-pthread", "-fvisibility=default"]
"""Contracted products would round otherwise than Python's."""


def compiler() -> list[str]:
    """Command of a C compiler with its first arguments; empty without a compiler."""
    named = shlex.split(os.environ.get("CONTACTFPGA_CC", ""))
    if named:
        return [] if named == ["none"] else named
    if os.name != "posix":
        return []
    for name in ("cc", "gcc", "clang"):
        if found := shutil.which(name):
            return [found]
    return [found, "-x", "c"] if (found := shutil.which("g++")) else []


def built(output: Path) -> bool:
    """Whether the library could be compiled to this file."""
    if not (command := compiler()):
        return False
    with tempfile.TemporaryDirectory(dir=output.parent) as folder:
        made = Path(folder, "made.so")
        command += [*OPTIONS, f"-I{ROOT / 'c'}", str(ROOT / "c" / "reader.c"), "-lm", "-o", str(made)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            print(f"without a reader in C: {shlex.join(command)}\n{done.stderr}", file=sys.stderr)
            return False
        os.replace(made, output)  # whoever has it loaded keeps the old one
    return True


class CustomBuildHook(BuildHookInterface):
    """Called by hatchling before it makes a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the library to the wheel, or to the source tree of an editable install."""
        if version == "editable":
            built(ROOT / "py" / PLACE)
            return
        self._folder = tempfile.TemporaryDirectory()
        library = Path(self._folder.name, "reader.so")
        if built(library):
            platform = os.environ.get("CONTACTFPGA_PLATFORM") or sysconfig.get_platform()
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{platform.replace('-', '_').replace('.', '_')}"
            build_data["force_include"][str(library)] = PLACE

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """The wheel is made."""
        if version != "editable":
            self._folder.cleanup()


if __name__ == "__main__":
    sys.exit(0 if built(ROOT / "py" / PLACE) else "no library was compiled")
