"""LUT4, flip-flops, block RAM and clock of rivals and of ours, by the same runs of synthesis, place and route."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from amaranth.hdl import ClockSignal, Instance, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rivals.exactness import READ_VERILOG
from rivals.house import DESIGNS, FAMILIES, NO_COLLISIONS, Device, Netlists, Registered, Size, native, size, square
from rivals.rival import Sheet

PLAIN, OURS = SETTINGS = ("plain", "as in our builds")
"""``plain``: Yosys decides about memories and keeps every promise of the source. ``as in our builds``: what they add,
which is to put memories into block RAM on the UP5K, and, of designs of which it is true, that no word is read while it
is written."""


def before(device: Device, setting: str, collides: bool) -> tuple[str, ...]:
    """Commands of Yosys before synthesis; ``collides``: the design uses words that are read while they are written."""
    if setting == PLAIN:
        return ()
    family = next(family for name, family in FAMILIES.items() if device.fpga.startswith(name))
    return tuple(command for command in family.before if not (collides and command == NO_COLLISIONS))


def rival(verilog: str, sheet: Sheet) -> Netlists:
    """A converted rival, bare and between registers."""
    bare = _to_rtlil(verilog)
    inner = bare.replace("\\top\n", "\\labeller\n", 1)
    return Netlists(bare, native.rtlil(Registered(_Behind(sheet))) + inner)


def ours(labeller: str, lines: int) -> Netlists:
    """One of our labellers."""
    make: Callable[..., wiring.Component] = DESIGNS[f"labeller `{labeller}`"]
    return Netlists.of(lambda: make(square(lines)))


def measure(netlists: Netlists, device: Device, commands: tuple[str, ...], seeds: int) -> Size:
    """Some minutes at worst, unless kept from before."""
    return size.measure_netlists(netlists, device, seeds, commands)


def _to_rtlil(verilog: str) -> str:
    with tempfile.TemporaryDirectory(dir=Path.cwd(), prefix=".sizes-") as name:  # Yosys does not see /tmp
        folder = Path(name)
        (folder / "top.v").write_text(verilog, encoding="utf-8")
        native.yosys(f"{READ_VERILOG}; flatten; opt_clean; setattr -unset src */*; write_rtlil top.il", folder)
        return (folder / "top.il").read_text(encoding="utf-8")


class _Behind(wiring.Component):
    """The port of a rival, with the converted rival inside."""

    def __init__(self, sheet: Sheet):
        ports = {name: In(1) for name in ("rst", "pressed")}
        ports |= {name: In(sheet.place_bits) for name in ("x", "y")}
        super().__init__(ports | {"found": Out(1), "zone": Out(sum(sheet.moment_bits))})

    def elaborate(self, platform):
        m = Module()
        ports = {f"i_{name}": getattr(self, name) for name in ("rst", "pressed", "x", "y")}
        ports |= {f"o_{name}": getattr(self, name) for name in ("found", "zone")}
        m.submodules.labeller = Instance("labeller", i_clk=ClockSignal(), **ports)
        return m
