"""A touch as a waveform of every signal."""

from __future__ import annotations

import dataclasses
import re
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import write_text
from contactfpga.skin import Skin
from contactfpga.wire import protocol
from contactfpga.zones.zone import Zones
from contactfpga_sim.model import golden
from contactfpga_sim.model.golden.trace import Timeline, Trace
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.record import LEVELS, PAYLOADS, ports

MOST_CLOCKS = 400_000
"""Most clocks: some minutes in Amaranth's simulator."""
SHEET = ("rows", "columns", "contact")
"""Pins shown first."""
STAGES = ("row", "record", "item", "byte")
FS = 10**15
"""Femtoseconds per second; the file counts in fs."""


class WaveError(ContactFPGAError):
    """There is no such waveform; the message gives the reason."""


@dataclasses.dataclass(frozen=True)
class SimulatedTouch:
    """A simulated touch; clocks count from power-up."""

    begins: int
    """Start of the waveform."""
    touched: int
    ends: int
    """One bit after the last byte of the frame."""
    zones: Zones
    """Zones received by the host."""
    trace: Trace


def finger(skin: Skin) -> np.ndarray:
    """(rows, columns) bool: up to 2x2 unmasked cells in the middle of the sheet."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    row, column = max(skin.rows // 2 - 1, 0), max(skin.columns // 2 - 1, 0)
    cells[row : row + 2, column : column + 2] = True
    for masked in skin.mask:
        cells[masked] = False
    return cells


def simulate(skin: Skin, cells: np.ndarray, vcd: Path) -> SimulatedTouch:
    """Press (rows, columns) bool cells in the middle of a scan after the hello, and write the waveform.

    Raises :class:`WaveError` without a frame of these within :data:`MOST_CLOCKS`, and
    :class:`~contactfpga_sim.verify.cosim.compare.Mismatch` if the gateware differs from the golden model.
    """
    if cells.shape != (skin.rows, skin.columns) or not cells.any():
        rows, columns = cells.shape
        said = f"the frame has {rows}x{columns} cells, {int(cells.sum())} of them pressed"
        raise WaveError(f"{said}; the sheet has {skin.rows}x{skin.columns} cells, and one at least must be pressed")
    scan = skin.derived.frame_clocks
    touched = _hello(skin) + scan + scan // 2
    timeline = Timeline([(touched, cells, None)])
    ends, zones = _sent(skin, timeline, touched)
    with tempfile.TemporaryDirectory(prefix="contactfpga-") as folder:
        whole = Path(folder) / "whole.vcd"
        trace = bench_amaranth.run(skin, timeline, ends, limit_s=3600.0, vcd=str(whole))
        compare(golden.predict(skin, timeline, ends), trace)
        begins = touched - scan - scan // 2
        with whole.open(encoding="ascii") as lines:
            write_text(vcd, "".join(cut(lines, begins * FS // skin.clock_hz)))
    return SimulatedTouch(begins, touched, ends, zones, trace)


def _hello(skin: Skin) -> int:
    scan, size = skin.derived.frame_clocks, len(protocol.encode_hello(skin))
    return 2 * scan + 10 * size * skin.derived.bit_clocks


def _sent(skin: Skin, timeline: Timeline, touched: int) -> tuple[int, Zones]:
    bits, cycles = skin.derived.bit_clocks, 2 * touched
    while cycles <= MOST_CLOCKS:
        conversation = Conversation("the golden model")
        for cycle, byte in golden.predict(skin, timeline, cycles).bytes:
            for zones in frames_in(conversation.receive(bytes([byte]), cycle / skin.clock_hz)):
                if zones.pressed:
                    return cycle + 12 * bits, zones
        cycles *= 2
    said = f"no frame with the touch comes within {MOST_CLOCKS:,} clocks"
    raise WaveError(f"{said}; a smaller sheet or a faster baud rate takes fewer, and masked cells make none")


def cut(lines: Iterable[str], begin: int) -> Iterator[str]:
    """The lines of a VCD file from a time on, which becomes 0. Each signal begins with its value then."""
    lines, last = iter(lines), dict[str, str]()
    for line in lines:
        yield re.sub(r"^(\$var \w+ \d+ \S+ )\$", r"\1", line)  # readers take no name that begins so
        if line.startswith("$enddefinitions"):
            break
    for line in lines:
        if line.startswith("#") and int(line[1:]) >= begin:
            yield "#0\n$dumpvars\n"
            yield from last.values()
            yield f"$end\n#{int(line[1:]) - begin}\n"
            break
        if line[0] not in "#$":
            last[_name(line)] = line
    for line in lines:
        yield f"#{int(line[1:]) - begin}\n" if line.startswith("#") else line


def _name(change: str) -> str:
    return change.split()[1] if change[0] in "bBrRsS" else change[1:].strip()


def shown(skin: Skin) -> list[str]:
    """Ports to show in a viewer: sheet, transfers between stages, line."""
    stages = [name for stage in STAGES for name in (*LEVELS, *PAYLOADS) if name.startswith(stage)]
    return [*SHEET, *ports(tuple(stages), skin), "tx"]


def layouts(skin: Skin, vcd: Path) -> list[Path]:
    """Write viewer settings beside the waveform: a GTKWave save file, and commands for Surfer."""
    gtkw, surfer = vcd.with_suffix(".gtkw"), vcd.with_suffix(".sucl")
    with vcd.open(encoding="ascii") as lines:
        bits = _ports(lines)
    names = {name: f"bench.top.{name}" for name in shown(skin) if name in bits}
    vectors = [f"{path}[{bits[name] - 1}:0]" if bits[name] > 1 else path for name, path in names.items()]
    write_text(gtkw, "\n".join([f'[dumpfile] "{vcd.resolve()}"', "@22", *vectors, ""]))
    write_text(surfer, "\n".join([*(f"variable_add {path}" for path in names.values()), "zoom_fit", ""]))
    return [gtkw, surfer]


def _ports(lines: Iterable[str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for line in lines:
        match line.split():
            case ["$var", _, bits, _, name, "$end"]:
                found.setdefault(name, int(bits))
            case ["$enddefinitions", *_]:
                break
    return found
