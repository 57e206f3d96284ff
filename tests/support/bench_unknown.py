"""The gateware in Icarus Verilog with unknowns: from a power-up at which no register and no memory is known.

A simulation of the source would hide unknowns, as ``if`` takes one for false. So all of it, memories included, is
turned into registers and selections of bits first: there a selection by an unknown is unknown unless both sides agree.
So is a word that was read in the clock in which it was written, as :data:`NO_COLLISIONS` has it.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga_hdl.board.synthesis import NO_COLLISIONS
from contactfpga_sim.model.board import native
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.trace import Timeline, Trace
from contactfpga_sim.model.sheet.matrix import Contention, Matrix
from contactfpga_sim.verify.cosim.bench_cocotb import SimulatorFailed
from contactfpga_sim.verify.cosim.record import InputDriver, OutOfTime

if TYPE_CHECKING:
    from contactfpga.skin import Skin
from contactfpga_hdl.link.link import hello_words

RESET_CLOCKS = 4
"""Clocks of reset after power-up. The iCE40 boards give 181, an ECP5 as many as its global reset takes."""

_GATES = (
    f"read_rtlil model.il; delete w:$verilog_initial_trigger; {NO_COLLISIONS}; proc; pmuxtree; flatten; memory -nomap; "
    "memory_map; dffunmap; opt_clean; write_verilog -noattr gates.v"
)


class Unknown(AssertionError):
    """An output is unknown after the first clock of the reset."""


def initialized(skin: Skin) -> tuple[str, ...]:
    """Patterns of the memory words that the design needs at power-up and the bitstream brings.

    These are the hello's bytes, and of the memory of the labeller `serial` the half that stays zero.

    They are put there after the first clock: until then unknown registers may write anywhere. In an FPGA they hold zero
    or their initial value, and the reset keeps them there.
    """
    words = (rf"link\.store\[({'|'.join(map(str, hello_words(skin)))})\]",)
    if skin.labeller != "serial" or skin.report == "cells":
        return words
    places = skin.columns if skin.connectivity == 4 else -(-skin.columns // 2)
    half = 1 << (places - 1).bit_length()
    return (*words, rf"label\.groups\[({'|'.join(map(str, range(half, 2 * half)))})\]")


def available() -> bool:
    """Whether Icarus Verilog is installed."""
    return shutil.which("iverilog") is not None


def run(
    skin: Skin, timeline: Timeline, cycles: int, known_words: Sequence[str] | None = None, limit_s: float = 200.0
) -> Trace:
    """What the transmit, the contact and the alive pin do in cycles 0 to ``cycles`` - 1, counted from the end of the
    reset.

    ``known_words``: patterns of what is known at power-up, :func:`initialized` if left out. Raises :class:`Unknown`
    when a row, a line's output enable, the transmit or the contact pin is not known, :class:`Contention`, and
    :class:`OutOfTime`.
    """
    from contactfpga_hdl.top import Top

    with tempfile.TemporaryDirectory(prefix="contactfpga-") as name:
        folder = Path(name)
        (folder / "model.il").write_text(native.rtlil(Top(skin)))
        native.yosys(_GATES, folder)
        patterns = initialized(skin) if known_words is None else known_words
        gates, known = forget((folder / "gates.v").read_text(), patterns)
        (folder / "gates.v").write_text(gates)
        (folder / "bench.v").write_text(_bench(skin, timeline, cycles, known))
        _run(folder, limit_s, "iverilog", "-g2005", "-o", "bench", "bench.v", "gates.v")
        output = _run(folder, limit_s, "vvp", "-n", "bench")
    return _trace(output, cycles)


def _run(folder: Path, limit_s: float, *command: str) -> str:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=limit_s)
    except subprocess.TimeoutExpired:
        raise OutOfTime(f"{command[0]} was not done in {limit_s:g} s") from None
    if done.returncode:
        raise SimulatorFailed(f"{command[0]} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return done.stdout


def forget(gates: str, initialized: Sequence[str]) -> tuple[str, dict[str, str]]:
    """The Verilog without initial values, and those by the register's name whose declaration matches a pattern."""
    known: dict[str, str] = {}

    def declaration(found: re.Match) -> str:
        if any(re.search(pattern, found[0]) for pattern in initialized):
            known[found[2]] = found[3]
        return f"{found[1]}{found[2]} ;"

    return re.sub(r"^( *reg (?:\[.*?\] )?)(\S+) += ([^;]+);$", declaration, gates, flags=re.MULTILINE), known


def _trace(output: str, cycles: int) -> Trace:
    trace = Trace(cycles)
    tx, contact, alive = 1, 0, 0
    for line in output.splitlines():
        what, cycle, *levels = line.split()
        if what == "contention":
            raise Contention(f"cycle {cycle}: columns {levels[0]} are driven against rows {levels[1]}")
        if what != "pins":
            raise Unknown(f"cycle {cycle}: rows {levels[0]}, tx {levels[1]}, contact {levels[2]}, alive {levels[3]}")
        if int(levels[0]) != tx:
            tx = int(levels[0])
            trace.line.append((int(cycle), tx))
        if int(levels[1]) != contact:
            contact = int(levels[1])
            trace.contact.append((int(cycle), contact))
        if int(levels[2]) != alive:
            alive = int(levels[2])
            trace.alive.append((int(cycle), alive))
    return trace


def _bench(skin: Skin, timeline: Timeline, cycles: int, known: dict[str, str]) -> str:
    """Verilog that drives the pins as the timeline says and prints the outputs' changes and the first unknown one."""
    moves = _moves(skin, timeline, cycles)
    moves[1 - RESET_CLOCKS] = " ".join(f"top.{name} = {value};" for name, value in known.items())
    steps = "".join(f"        {cycle}: begin {text} end\n" for cycle, text in sorted(moves.items()))
    cells = ", ".join(f"closed{row} = 0" for row in range(skin.row_lines))
    sheet, pins = _sheet(skin)
    return f"""`timescale 1ns/1ns
module bench;
reg clk = 0, rst = 1, rx = 1;
reg [{skin.column_lines - 1}:0] stuck = 0, {cells};
{sheet}wire tx, contact;
wire alive{"" if skin.alive else " = 0"};
reg [2:0] seen = 3'bxxx;
integer cycle;
top top(.clk(clk), .rst(rst), .rx(rx), .tx(tx), .contact(contact){pins}{", .alive(alive)" if skin.alive else ""});
initial for (cycle = -{RESET_CLOCKS}; cycle < {cycles}; cycle = cycle + 1) begin
    if (cycle == 0) rst = 0;
    case (cycle)
{steps}    endcase
    #5;
    if (cycle > -{RESET_CLOCKS} && ^{{rows, rows_drive, columns_drive, tx, contact, alive}} === 1'bx) begin
        $display("unknown %0d %b %b %b %b", cycle, rows, tx, contact, alive);
        $finish;
    end
    if (cycle > -{RESET_CLOCKS} && |(pulled & feeding)) begin
        $display("contention %0d %b %b", cycle, pulled & feeding, selected);
        $finish;
    end
    if (cycle >= 0 && seen !== {{tx, contact, alive}}) $display("pins %0d %b %b %b", cycle, tx, contact, alive);
    seen = {{tx, contact, alive}};
    clk = 1;
    #5 clk = 0;
end
endmodule
"""


def _sheet(skin: Skin) -> tuple[str, str]:
    """Verilog of the sheet, and the ports of the top that it is connected to.

    Before the first clock of the reset nothing is known; pins that may be driven then read as unknown.
    """
    lines = range(skin.row_lines)
    rows, columns = f"[{skin.row_lines - 1}:0]", f"[{skin.column_lines - 1}:0]"
    selecting, level, let_go = ("~rows", "~reads", "touched") if skin.selects_low else ("rows", "reads", "~touched")
    pulled = " | ".join(f"{{{skin.column_lines}{{selected[{row}]}}}} & closed{row}" for row in lines)
    feeding = ", ".join(f"|(closed{row} & feeding & ~stuck)" for row in reversed(lines))
    reverses = skin.reads_rows
    checks = reverses and (skin.guard or skin.self_test)
    released = f"columns_level == 1'b{int(skin.selects_low)}"
    plain = f"{{{skin.columns}{{{released}}}}}"
    guard = f"{{~({released}), {plain}}}" if skin.guard else plain
    kept = _kept(skin, columns) if skin.self_test else ""
    reads = "pulled | stuck" + (" | held | still" if skin.self_test else "") + (" | drained" if reverses else "")
    alone = (f"{{{skin.column_lines}{{~(rows_drive[{row}] | touched[{row}])}}}} & closed{row}" for row in lines)
    text = f"""wire {rows} rows;
wire {rows} rows_drive{"" if reverses else f" = {{{skin.row_lines}{{1'b1}}}}"};
wire {columns} columns_drive{"" if skin.precharge_us else " = 0"};
{"wire columns_level;" if checks else ""}
wire {columns} feeding = columns_drive{f" & {guard}" if checks else ""};
wire {rows} selected = {selecting} & rows_drive;
wire {columns} pulled = {pulled};
{kept}wire {rows} touched = {{{feeding}}};
wire {columns} drained = ({" | ".join(alone)}) & ~feeding;
wire {columns} reads = {reads};
wire {rows} rows_read = rows & rows_drive | {let_go} & ~rows_drive;
"""
    pins = f", .columns({level}), .rows(rows)"
    pins += ", .columns_drive(columns_drive)" if skin.precharge_us else ""
    pins += ", .columns_level(columns_level)" if checks else ""
    return text, pins + (", .rows_drive(rows_drive), .rows_read(rows_read)" if reverses else "")


def _kept(skin: Skin, columns: str) -> str:
    """Columns that a self-test discharged stay at the selecting level for a slot, as their pulls are weak."""
    return f"""wire {columns} held = columns_drive & ~feeding;
reg {columns} kept = 0;
integer left = 0;
wire {columns} still = left != 0 ? kept & ~feeding : 0;
always @(posedge clk)
    if (|held) begin kept <= held; left <= {facts(skin).settle + 1}; end
    else if (left != 0) begin kept <= still; left <= left - 1; end
"""


def _moves(skin: Skin, timeline: Timeline, cycles: int) -> dict[int, str]:
    """Assignments to the bench's inputs, by the cycle from which they hold."""
    moves: dict[int, str] = {}
    line = InputDriver(skin, Timeline([], timeline.received))
    before = 1
    for cycle in range(cycles):
        *_, level = line.pins(cycle, dict.fromkeys(line.reads, 0))
        if level != before:
            moves[cycle] = f"rx = {level};"
        before = level
    sheet = Matrix(skin)
    for cycle in sorted({0, *(piece[0] for piece in timeline.pieces), *(cut[0] for cut in timeline.cuts)}):
        cuts = timeline.cuts_at(cycle)
        sheet.press(*timeline.at(cycle))
        sheet.cut(cuts.rows, cuts.columns)
        width = skin.column_lines
        text = "".join(f" closed{line} = {width}'h{word:x};" for line, word in enumerate(sheet.closed))
        moves[cycle] = moves.get(cycle, "") + f"{text} stuck = {width}'h{sheet.stuck:x};"
    return moves
