"""Mutants: small changes of the gateware's netlist, selected by an input of one compiled board."""

from __future__ import annotations

import dataclasses
import random
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

from contactfpga.skin import Skin
from contactfpga.skin.several import Several
from contactfpga_sim.model.board import compiled, native

Design = Skin | Several

STAGES = {
    "scan": ("scan",),
    "guard": ("scan",),
    "self-test": ("scan",),
    "debounce": ("debounce",),
    "label": ("label",),
    "closed": ("label",),
    "report": ("audit", "bitmap", "backlog", "divide"),
    "pack": ("packer",),
    "units": ("units",),
    "link": ("link",),
    "faults": ("link", "alive"),
    "serial": ("transmitter", "receiver", "request"),
    "several": ("grants",),
    "top": (),
}
"""Modules of Top, by stage."""

# Longest first: a file before its room. What several stages use is of the stage whose module holds it.
_FILES = {
    "scan/guard.py": "guard",
    "scan/reversal_guard.py": "guard",
    "scan/self_test.py": "self-test",
    "label/around.py": "closed",
    "link/faults.py": "faults",
    "link/alive.py": "faults",
    "link/pack.py": "pack",
    "link/pulses.py": "serial",
    "link/request.py": "serial",
    "link/uart.py": "serial",
    "scan/": "scan",
    "debounce/": "debounce",
    "label/": "label",
    "report/": "report",
    "units/": "units",
    "link/": "link",
    "several.py": "several",
    "probes.py": "top",
    "top.py": "top",
}
_MODULES = {module: stage for stage, modules in reversed(STAGES.items()) for module in modules}

# No test drives the reset: registers start from their initial values. Nor is there a restart without a flip: that none
# is asked for is proved. What does nothing is dropped, as a mutant of it would be none. Memories stay whole: what is in
# them is no logic.
PREPARE = (
    "delete -port w:rst; delete w:restarts w:*.restarts; setundef -undriven -zero; opt -full; wreduce; peepopt; "
    "opt -full; memory -nomap; opt -full"
)
# A fault at Q is one at D a clock later, one at a clock no change of the logic; no memory here has a reset.
_LEFT_OUT = ("Q", "CLK", "RD_CLK", "WR_CLK", "RD_ARST", "RD_SRST")
_ALL = 1_000_000
_SELECT_BITS = 16


@dataclasses.dataclass(frozen=True)
class Mutant:
    """One bit of a cell's port: inverted, held, or inverted by another bit."""

    stage: str
    place: str
    """File and line in the gateware's source."""
    change: str
    """Options of Yosys' ``mutate``."""

    def __str__(self) -> str:
        return f"{self.stage} {self.place}: {self.change}"


def plain(design: Design) -> native.Model:
    """The board without mutants."""
    return compiled.sheets_model(design) if isinstance(design, Several) else compiled.model_of(design)


def candidates(design: Design) -> list[Mutant]:
    """Every mutant of the stages of a board."""
    with tempfile.TemporaryDirectory(prefix="contactfpga-") as name:
        folder = Path(name)
        (folder / "model.il").write_text(_with_places(native.rtlil(plain(design).elaborate(), sources=True)))
        commands = ("read_rtlil model.il", native.FLATTEN, PREPARE, f"mutate -list {_ALL} -o list.txt")
        native.yosys("; ".join(commands), folder)
        lines = (folder / "list.txt").read_text().splitlines()
    return [mutant for line in lines if (mutant := parsed(line))]


def draw(mutants: Sequence[Mutant], count: int, seed: int = 0) -> list[Mutant]:
    """At most ``count`` random mutants; reproducible."""
    return random.Random(seed).sample(mutants, min(count, len(mutants)))


def model(design: Design, mutants: Sequence[Mutant]) -> native.Model:
    """The board in which ``restart(n)`` selects ``mutants[n - 1]``."""
    found = plain(design)
    return dataclasses.replace(
        found,
        title=f"{len(mutants)} mutants of {found.title}",
        passes="\n".join((PREPARE, *switches(mutants), "opt_expr; opt_merge; opt_clean")),
        quiet=True,
        defines={**found.defines, "MUTANTS": len(mutants)},
    )


def switches(mutants: Sequence[Mutant]) -> list[str]:
    """Yosys commands that insert the mutants, selected by the new input ``mutant``."""
    if len(mutants) >= 1 << _SELECT_BITS:
        raise ValueError(f"{len(mutants)} mutants in one board; at most {(1 << _SELECT_BITS) - 1}")
    return [f"mutate -ctrl mutant {_SELECT_BITS} {n} {mutant.change}" for n, mutant in enumerate(mutants, 1)]


def parsed(line: str) -> Mutant | None:
    """Mutant of a line of Yosys' list; None if excluded."""
    options = re.findall(r"-(\w+) (.+?)(?= -\w+ |\s*$)", line)  # a folder's name may have spaces
    values = dict(options)
    if values["port"] in _LEFT_OUT:
        return None
    places = [value for name, value in options if name == "src"]
    own = [place for place in places if "contactfpga_hdl/" in place] or places or ["unknown"]
    place = re.sub(r".*(contactfpga_hdl|site-packages)/", "", own[-1])
    stage = _stage(place, values["cell"], values.get("wire", ""))
    if stage is None:
        return None
    change = " ".join(f"-{name} {value}" for name, value in options if name not in ("wire", "wirebit", "src"))
    return Mutant(stage, place, change)


def _stage(place: str, *names: str) -> str | None:
    for file, stage in _FILES.items():
        if place.startswith(file):
            return stage
    return next((_MODULES[module] for name in names if (module := module_of(name)) in _MODULES), None)


def module_of(name: str) -> str:
    """Module of Top with this cell, wire or register, and a number if a signal of Top has its name."""
    inside = in_sheet(name.removeprefix("$flatten").replace("\\", ""))
    return re.sub(r"\$\d+$", "", inside.partition(".")[0])


def in_sheet(name: str) -> str:
    return re.sub(r"^sheet_\d+\.", "", name)


def _with_places(rtlil: str) -> str:
    lines, place, above = [], "", ""
    for line in rtlil.splitlines():
        word = line.split(maxsplit=1)[:1]
        if word == ["process"]:
            place = above
        elif word == ["switch"] and place:
            lines.append(place)
        elif line == "  end":
            place = ""
        above = line if line.lstrip().startswith("attribute \\src") else ""
        lines.append(line)
    return "\n".join(lines) + "\n"
