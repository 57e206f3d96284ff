"""A Skin's gateware as Verilog for another design."""

from __future__ import annotations

import dataclasses
import itertools
import random
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from amaranth.hdl import Cat, ClockDomain, Module, Signal
from amaranth.lib.wiring import In
from amaranth.sim import Simulator

from contactfpga import __version__
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import write_text
from contactfpga.inputs.values import shown
from contactfpga.skin import Skin
from contactfpga_hdl.core import BYTES, RECORDS, Core
from contactfpga_hdl.link.records import closing_layout, word_bits
from contactfpga_hdl.payloads import zone_layout
from contactfpga_hdl.report.divide import barycenter_layout
from contactfpga_sim.model.board import native
from contactfpga_sim.model.golden.trace import Timeline
from contactfpga_sim.verify.cosim.record import InputDriver

NAME = "contactfpga_core"
"""Default name of the core's module. The names of all other modules begin with it."""
MOST_LETTERS = 64
SCANS = 4
"""Scans in the vectors after the hello."""
RESET = 4
"""Initial clocks of reset."""
MOST_CLOCKS = 100_000
"""Most clocks of vectors: a minute or two in Amaranth's simulator."""

# As Amaranth does for its own Verilog: processes stay processes, so that conditions can be read.
_VERILOG = """read_rtlil core.il
proc -nomux -norom
memory_collect
write_verilog -norename -noattr core.v"""

_SYNCHRONIZED = "two registers synchronize it inside"
MEANINGS = {
    "clk": "clock; times of the sheet hold at {clock_hz:,} Hz",
    "rst": "synchronous reset, high; hold it for 4 clocks. Then the core is as at power-up",
    "rows": "to the rows of the sheet",
    "columns": f"from the columns of the sheet; {_SYNCHRONIZED}",
    "row_data": "to the data pins of the rows' shift registers",
    "row_clock": "to their clock",
    "row_latch": "to their latch",
    "row_enable_n": "to their output enable, low",
    "column_data": f"from the data pins of the columns' shift registers; {_SYNCHRONIZED}",
    "column_clock": "to their clock",
    "column_load_n": "to their parallel load, low",
    "rows_drive": "drive each row, else leave it to its resistor",
    "rows_read": f"from the rows of the sheet; {_SYNCHRONIZED}",
    "columns_drive": "drive each column, else leave it to its resistor",
    "columns_level": "the level to which columns are driven",
    "rx": (
        "requests and commands as a UART at {baud:,} bits per second; hold it high if there are none; " + _SYNCHRONIZED
    ),
    "contact": "high while something touches the sheet",
    "alive": "turns each millisecond while whole frames without a fault come",
    "spi_clock": "to the converter of the pressure units",
    "spi_select_n": "to its select, low",
    "spi_mosi": "to its data input",
    "spi_miso": f"from its data output; {_SYNCHRONIZED}",
    "spi_ready_n": f"from its ready output, low; {_SYNCHRONIZED}",
    "spi_pace": "to its clock input, from which it takes its pace",
    "m_axis_tdata": "a byte of a packet",
    "m_axis_tvalid": "there is one",
    "m_axis_tready": "it is taken; may be low for as long as you like",
    "m_axis_tlast": "it is the last one of its packet, 0",
    "m_axis_records_tdata": "a word of a frame: a record, or what closes the frame",
    "m_axis_records_tvalid": "there is one",
    "m_axis_records_tready": "it is taken; may be low for as long as you like",
    "m_axis_records_tlast": "it closes its frame",
}

CLOSING = {
    "time": "device time at the sample of the frame's first row, in us",
    "number": "frames before this one, modulo 65,536",
    "cells": "pressed switches",
    "zones": "zones on the sheet, including those without a record",
    "overflow": "the sheet has more zones than the frame has records",
    "mismatch": "the sums of the records differ from those of the cells: the gateware or a bit of it was wrong",
    "fault": "a column read pressed while no row was driven, or another fault of a line is known",
    "motion": "a row read touched as the frame began, and empty when it was driven: something moved during the frame",
}


class IpError(ContactFPGAError):
    """The Skin has no such core; the message gives the reason."""


@dataclasses.dataclass(frozen=True)
class Port:
    """A port of the core."""

    name: str
    takes: bool
    bits: int
    meaning: str

    @property
    def range(self) -> str:
        """Range in Verilog."""
        return f"[{self.bits - 1}:0] " if self.bits > 1 else ""


def ports(skin: Skin, core: Core) -> list[Port]:
    """Clock, reset, then the other inputs and outputs in the vectors' order."""
    found = [(name, member.flow == In, len(getattr(core, name))) for name, member in core.signature.members.items()]
    every = [("clk", True, 1), ("rst", True, 1), *sorted(found, key=lambda port: not port[1])]
    said = {name: text.format(clock_hz=skin.clock_hz, baud=skin.baud) for name, text in MEANINGS.items()}
    return [Port(name, takes, bits, said[name]) for name, takes, bits in every]


def record_fields(skin: Skin) -> dict[str, int]:
    """Bits of each field of a record, lowest first."""
    if not skin.derived.report.zones:
        return {"cells": skin.columns}
    if skin.derived.report.divided:
        return {name: len(Signal(shape)) for name, shape in barycenter_layout(skin.derived).members.items()}
    return {name: len(Signal(shape)) for name, shape in zone_layout(skin.derived).members.items()}


def closing_fields(skin: Skin) -> dict[str, int]:
    """Bits of each field of a frame's closing word, lowest first."""
    return {name: len(Signal(shape)) for name, shape in closing_layout(skin.derived).members.items()}


def write(skin: Skin, folder: Path, name: str = NAME) -> list[Path]:
    """Write all files of the core into an existing folder; the names of all modules begin with ``name``.

    Raises :class:`IpError` if the Skin has no core, or if Verilog has no module of this name.
    """
    if skin.dual:
        raise IpError("dual = true compares two copies at the transmit pin, which a core has not; leave it out")
    text = verilog(skin, name)
    core = Core(skin)
    known = ports(skin, core)
    played = vectors(skin, core, known)
    texts = {
        f"{name}.v": _head(skin) + text,
        f"{name}_sva.sv": assertions(skin, known, name),
        f"{name}_tb.v": testbench(known, len(played), name),
        "vectors.hex": "".join(f"{word:x}\n" for word in played),
        "example.v": example(skin, known, name),
        f"{name}.sdc": constraints(skin, known),
        "README.md": readme(skin, known, name),
    }
    for file, content in texts.items():
        write_text(folder / file, content)
    return [folder / file for file in texts]


def verilog(skin: Skin, name: str = NAME) -> str:
    """The core as Verilog-2005; raises :class:`IpError` as :func:`write` does."""
    named = re.fullmatch(rf"[A-Za-z_]\w{{0,{MOST_LETTERS - 1}}}", name, re.ASCII)
    text = _converted(Core(skin), name) if named else ""
    if f"module {name}(" not in text:  # Yosys escapes the keywords of Verilog
        raise IpError(
            f"--name is {shown(name)}; a module's name has up to {MOST_LETTERS} letters, digits and underscores, does "
            "not begin with a digit, and is no keyword of Verilog"
        )
    return text


def _converted(core: Core, name: str) -> str:
    with tempfile.TemporaryDirectory(prefix="contactfpga-") as work:
        (Path(work) / "core.il").write_text(native.rtlil(core, name=name))
        native.yosys(_VERILOG, Path(work))
        return _started((Path(work) / "core.v").read_text())


def _started(text: str) -> str:
    """Verilog that four-state simulators compute correctly from the first clock on.

    They compute a block once something in it changes, so each block gets a signal that changes once.
    """
    text = re.sub(r"^  wire \[-1:0\] \S+ ?;\n", "", text, flags=re.MULTILINE)
    modules = [_triggered(module) for module in re.split(r"(?<=^endmodule\n)", text, flags=re.MULTILINE)]
    return re.sub(r"^(  reg (?:\[\d+:0\] )?_\d+_);$", r"\1 = 0;", "".join(modules), flags=re.MULTILINE)


def _triggered(module: str) -> str:
    alone = re.compile(r"^  always @\*\n    (.*;)$", re.MULTILINE)
    found = re.search(r"^  reg (\\\$auto\$verilog_backend\S+ ) = 0;\n", module, re.MULTILINE)
    if not found and not alone.search(module):
        return module
    trigger = found[1] if found else "starts "
    place = found.span() if found else [module.index(";\n") + 2] * 2
    module = f"{module[: place[0]]}  reg {trigger} = 0;\n  initial {trigger} <= 1;\n{module[place[1] :]}"
    return alone.sub(lambda match: f"  always @* begin\n    if ({trigger}) begin end\n    {match[1]}\n  end", module)


def _head(skin: Skin) -> str:
    return (
        f"// contactfpga {__version__}: {skin.rows}x{skin.columns} switches, Skin {skin.fingerprint.hex()}. Made by "
        "`contactfpga ip`.\n/* verilator lint_off WIDTHEXPAND */\n/* verilator lint_off WIDTHTRUNC */\n"
        "/* verilator lint_off CASEINCOMPLETE */\n/* verilator lint_off CMPCONST */\n"
        "/* verilator lint_off INITIALDLY */\n`timescale 1ns / 1ps\n"
    )


def vectors(skin: Skin, core: Core, known: list[Port]) -> list[int]:
    """Inputs and outputs of each clock as a word, inputs lowest, in Amaranth's simulator.

    After the hello two switches close and open. The streams' readers stall in a quarter of the clocks, the records'
    reader in all of the second and third scans.
    """
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[0, 0] = cells[-1, -1] = True
    scan = skin.derived.frame_clocks
    hello = 2 * scan + 1000
    timeline = Timeline([(hello, cells, None), (hello + 3 * scan // 2, cells & False, None)])
    rng = random.Random(skin.fingerprint.hex())

    def takes(clock: int) -> tuple[bool, bool]:
        return rng.random() < 0.75, rng.random() < 0.75 and not hello < clock < hello + 2 * scan

    return simulated(skin, core, known, timeline, min(hello + SCANS * scan, MOST_CLOCKS), takes)


def simulated(
    skin: Skin,
    core: Core,
    known: list[Port],
    timeline: Timeline,
    clocks: int,
    takes: Callable[[int], tuple[bool, bool]],
) -> list[int]:
    """Words of these clocks. ``takes``: whether bytes and records are taken in a clock."""
    stimulus = InputDriver(skin, timeline)
    m = Module()
    m.domains.sync = clock_domain = ClockDomain()
    m.submodules.core = core
    inside = known[1:]
    ins, outs = (
        [_signal(core, clock_domain, port) for port in inside if port.takes is taken] for taken in (True, False)
    )
    places = list(itertools.accumulate((len(signal) for signal in ins), initial=0))
    place = dict(zip((port.name for port in inside if port.takes), places, strict=False))
    words: list[int] = []

    async def bench(ctx: Any) -> None:
        for clock in range(clocks):
            levels = stimulus.pins(clock, {name: ctx.get(getattr(core, name)) for name in stimulus.reads})
            given: dict[str, int] = dict(zip((f"{BYTES}_tready", f"{RECORDS}_tready"), takes(clock), strict=True))
            given |= {"rst": clock < RESET, **dict(zip(stimulus.drives, levels, strict=True))}
            word = sum(level << place[name] for name, level in given.items())
            ctx.set(Cat(*ins), word)
            _, _, out = await ctx.tick().sample(Cat(*outs))
            words.append(word | out << places[-1])

    simulator = Simulator(m)
    simulator.add_clock(1 / skin.clock_hz)
    simulator.add_testbench(bench)
    simulator.run()
    return words


def _signal(core: Core, clock_domain: ClockDomain, port: Port) -> Any:
    return clock_domain.rst if port.name == "rst" else getattr(core, port.name)


def assertions(skin: Skin, known: list[Port], name: str) -> str:
    """Invariants at the pins, as immediate assertions for Yosys, Verilator and Icarus."""
    declared = ",\n".join(f"    input wire {port.range}{port.name}" for port in known)
    rows = "~rows" if skin.selects_low else "rows"
    one_row = (
        f"    wire {next(port.range for port in known if port.name == 'rows')}driven = {rows};\n"
        "    always @(posedge clk) if (!rst) assert ((driven & (driven - 1)) == 0);  // one row at a time\n"
        if skin.row_drive == "direct" and skin.scan == "raster" and not skin.self_test
        else ""
    )
    return f"""// What holds at the pins of {name} in every clock. Instantiate it beside the core with the same wires.
`timescale 1ns / 1ps
module {name}_sva (
{declared}
);
{_of_records(skin)}    reg waited = 0;
    reg [8:0] offered = 0;
    always @(posedge clk) begin
        waited <= !rst && m_axis_tvalid && !m_axis_tready;
        offered <= {{m_axis_tlast, m_axis_tdata}};
        // What is offered stays until it is taken.
        if (waited && !rst) assert (m_axis_tvalid && {{m_axis_tlast, m_axis_tdata}} == offered);
        // The last byte of a packet is 0, and no other byte is.
        if (m_axis_tvalid && !rst) assert (m_axis_tlast == (m_axis_tdata == 0));
    end
{one_row}endmodule
"""


def _of_records(skin: Skin) -> str:
    fields = closing_fields(skin)
    place = dict(zip(fields, itertools.accumulate(fields.values(), initial=0), strict=False))

    def field(name: str) -> str:
        low, high = place[name], place[name] + fields[name] - 1
        return f"{RECORDS}_tdata[{low if low == high else f'{high}:{low}'}]"

    most = skin.derived.max_items
    there = f"16'd{most}"
    if skin.derived.report.zones:
        there = f"{field('overflow')} ? {there} : {{{16 - fields['zones']}'d0, {field('zones')}}}"
    return f"""    reg [{word_bits(skin.derived)}:0] word = 0;
    reg held = 0, after = 0;
    reg [15:0] records = 0, number = 0;
    always @(posedge clk) begin
        held <= !rst && {RECORDS}_tvalid && !{RECORDS}_tready;
        word <= {{{RECORDS}_tlast, {RECORDS}_tdata}};
        if (rst) {{after, records}} <= 0;
        else if ({RECORDS}_tvalid && {RECORDS}_tready) begin
            records <= {RECORDS}_tlast ? 0 : records + 1;
            if ({RECORDS}_tlast) {{after, number}} <= {{1'b1, {field("number")}}};
        end
        // A word that is offered stays until it is taken.
        if (held && !rst) assert ({RECORDS}_tvalid && {{{RECORDS}_tlast, {RECORDS}_tdata}} == word);
        // Once a frame has begun, a word is there in every clock.
        if (records != 0 && !rst) assert ({RECORDS}_tvalid);
        if ({RECORDS}_tvalid && {RECORDS}_tlast && !rst) begin
            // The last word says how many records came before, and no frame comes twice.
            assert (records == ({there}));
            assert (!after || {field("number")} != number);
        end
    end
"""


def testbench(known: list[Port], clocks: int, name: str) -> str:
    """A testbench that plays the vectors and compares all outputs in every clock."""
    inside = known[1:]
    takes, gives = ([port for port in inside if port.takes is taken] for taken in (True, False))
    wide, out = (sum(port.bits for port in some) for some in (takes, gives))
    connected = ", ".join(f".{port.name}({port.name})" for port in known)
    wires = "\n".join(f"    wire {port.range}{port.name};" for port in inside)
    return f"""// Plays vectors.hex, one word per clock, and compares each output: run it in the folder of that file.
`timescale 1ns / 1ps
module {name}_tb;
    reg clk = 0;
    reg [{wide + out - 1}:0] vectors [0:{clocks - 1}];
    reg [{wide - 1}:0] inputs = 0;
    wire [{out - 1}:0] outputs;
{wires}
    assign {{{", ".join(port.name for port in reversed(takes))}}} = inputs;
    assign outputs = {{{", ".join(port.name for port in reversed(gives))}}};
    {name} core ({connected});
    {name}_sva sva ({connected});

    integer i, wrong = 0;
    initial begin
        $readmemh("vectors.hex", vectors);
        for (i = 0; i < {clocks}; i = i + 1) begin
            inputs = vectors[i][{wide - 1}:0];
            #4;
            if (outputs !== vectors[i][{wide + out - 1}:{wide}]) begin
                wrong = wrong + 1;
                if (wrong <= 10) $display("clock %0d: %h, not %h", i, outputs, vectors[i][{wide + out - 1}:{wide}]);
            end
            #1 clk = 1;
            #5 clk = 0;
        end
        if (wrong == 0) $display("PASS: {clocks} clocks");
        else $display("FAIL: %0d of {clocks} clocks", wrong);
        $finish;
    end
endmodule
"""


def example(skin: Skin, known: list[Port], name: str) -> str:
    """A peripheral of a small bus, with the core inside."""
    sheet = [port for port in known[2:] if not port.name.startswith(BYTES) and port.name not in ("rx", "contact")]
    declared = "\n".join(f"    {'input' if port.takes else 'output'} wire {port.range}{port.name}," for port in sheet)
    connected = ", ".join(f".{port.name}({port.name})" for port in sheet)
    bits = word_bits(skin.derived)
    last = -(-bits // 32)
    return f"""// A peripheral for a 32-bit bus with a select and a read strobe (Wishbone, AXI4-Lite or a CSR bus
// of LiteX need a few gates more). Register 0 gives {{closing, valid}}, and from register 1 on there are the
// bits of the word, lowest first; a read of register {last} takes it. README.md has the fields. The interrupt is
// high while a word waits: read words up to a closing one, then the frame is whole.
`timescale 1ns / 1ps
module {name}_peripheral (
    input wire clk,
    input wire rst,
    input wire select,
    input wire read,
    input wire [2:0] address,
    output reg [31:0] data,
    output wire irq,
    output wire contact,
{declared}
    input wire rx  // high, or a UART's line with requests
);
    wire [{bits - 1}:0] tdata;
    wire tlast;
    wire [255:0] registers = {{{{{224 - bits}{{1'b0}}}}, tdata, 30'd0, tlast, irq}};
    wire taken = select & read & (address == {last});

    always @(posedge clk) if (select & read) data <= registers[32 * address +: 32];

    {name} core (
        .clk(clk), .rst(rst), .rx(rx), .contact(contact), {connected},
        .{BYTES}_tdata(), .{BYTES}_tvalid(), .{BYTES}_tready(1'b0), .{BYTES}_tlast(),
        .{RECORDS}_tdata(tdata), .{RECORDS}_tvalid(irq), .{RECORDS}_tready(taken), .{RECORDS}_tlast(tlast)
    );
endmodule
"""


def constraints(skin: Skin, known: list[Port]) -> str:
    """Constraints of the clock and the asynchronous inputs."""
    there = [port.name for port in known if port.name in ("rx", "columns", "column_data", "rows_read")]
    paths = "".join(f"set_false_path -from [get_ports {{{name}*}}]\n" for name in there)
    return f"create_clock -name clk -period {1e9 / skin.clock_hz:.3f} [get_ports clk]\n{paths}"


def _fields(fields: dict[str, int]) -> str:
    places = itertools.accumulate(fields.values(), initial=0)
    there = [
        (name, place, place + bits - 1) for (name, bits), place in zip(fields.items(), places, strict=False) if bits
    ]
    return ", ".join(f"`{name}` [{high}:{low}]" if high > low else f"`{name}` [{low}]" for name, low, high in there)


def _place(skin: Skin) -> str:
    """Where a record's cells are."""
    if not skin.derived.report.zones:
        return "bit c of a frame's record r is the switch in row r and column c"
    if skin.derived.report.divided:
        return f"x and y are in steps of 1/{2**skin.barycenter_bits} of a column and of a row, from the first on"
    closed = "(sum_x + columns * turned) / area, modulo the columns (docs/protocol.md has rings)"
    sums = closed if skin.closed else "sum_x / area"
    return f"a zone is at x = {sums}, and y = sum_y / area, in columns and rows from the first one, 0, on"


def readme(skin: Skin, known: list[Port], name: str) -> str:
    """Ports, settings, and how to try the core."""
    rows = "".join(
        f"| `{port.name}` | {'in' if port.takes else 'out'} | {port.bits} | {port.meaning} |\n" for port in known
    )
    settings = "".join(f"    {line}\n" for line in skin.to_toml().splitlines())
    scan = skin.derived.frame_clocks
    record, closing = (_fields(fields) for fields in (record_fields(skin), closing_fields(skin)))
    meanings = "".join(f"    - `{field}`: {CLOSING[field]}\n" for field, bits in closing_fields(skin).items() if bits)
    return f"""# {name}

contactfpga {__version__} for {skin.rows}x{skin.columns} switches, as Verilog-2005 without primitives of a vendor.
One clock, synchronous reset.

| port | | bits | |
|---|---|---|---|
{rows}
- Clock: {skin.clock_hz:,} Hz. The core counts clocks, so another frequency needs another core (`clock_hz`).
- A scan takes {scan:,} clocks, {scan * 1e6 / skin.clock_hz:,.1f} us.
- Both streams keep the rules of AXI4-Stream: what is offered stays until it is taken, and `tvalid` does not wait for
  `tready`. Tie `tready` of one that you do not use low.
- `m_axis` has the packets of docs/protocol.md: bytes of COBS with a check, and a 0 at the end. The first one is a
  hello, which says the size of the sheet. If a frame is ready while an older one waits, it takes its place.
- `m_axis_records` has the same frames as words: records, at most {skin.derived.max_items:,}, then one with `tlast`.
  - record: {record}
  - {_place(skin)}
  - with `tlast`: {closing}
{meanings}- A frame is offered when it is whole. If one waits and the first word of the next one comes, that takes its
  place: `number` counts replaced frames, too, so a gap of n says that the reader missed n. With `send = "on_change"`
  a scan that replaces a frame counts although nothing has changed, so a slow reader may miss many more frames than a
  prompt one gets.

    iverilog -g2012 -o tb {name}.v {name}_sva.sv {name}_tb.v && ./tb
    verilator --binary --assert -CFLAGS -std=c++20 --top {name}_tb {name}.v {name}_sva.sv {name}_tb.v
    ./obj_dir/V{name}_tb

`example.v` is a peripheral with the core inside, `{name}.sdc` has the clock. The settings, to make it again with
`contactfpga ip --skin FILE --name {name}`:

{settings}"""
