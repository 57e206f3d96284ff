"""A Skin's gateware as Verilog for another design: the core, its assertions, a testbench with vectors, an example."""

from __future__ import annotations

import dataclasses
import itertools
import random
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from amaranth.hdl import Cat, ClockDomain, Module
from amaranth.lib.wiring import In
from amaranth.sim import Simulator

from contactfpga import __version__
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import write_text
from contactfpga.skin import Skin
from contactfpga_hdl.core import Core
from contactfpga_sim.model.board import native
from contactfpga_sim.model.golden.trace import Timeline
from contactfpga_sim.verify.cosim.record import InputDriver

NAME = "contactfpga_core"
SCANS = 4
"""Scans in the vectors after the hello."""
RESET = 4
"""Initial clocks of reset."""
MOST_CLOCKS = 100_000
"""Most clocks of vectors: a minute or two in Amaranth's simulator."""

# As Amaranth does for its own Verilog: processes stay processes, so that conditions can be read.
_VERILOG = f"""read_rtlil core.il
rename top {NAME}
proc -nomux -norom
memory_collect
write_verilog -norename -noattr core.v"""

MEANINGS = {
    "clk": "clock; times of the sheet hold at {clock_hz:,} Hz",
    "rst": "synchronous reset, high; hold it for 4 clocks",
    "rows": "to the rows of the sheet",
    "columns": "from the columns of the sheet; two registers synchronize them inside",
    "row_data": "to the data pins of the rows' shift registers",
    "row_clock": "to their clock",
    "row_latch": "to their latch",
    "row_enable_n": "to their output enable, low",
    "column_data": "from the data pins of the columns' shift registers",
    "column_clock": "to their clock",
    "column_load_n": "to their parallel load, low",
    "rows_drive": "drive each row, else leave it to its resistor",
    "rows_read": "from the rows of the sheet",
    "columns_drive": "drive each column, else leave it to its resistor",
    "columns_level": "the level to which columns are driven",
    "rx": "requests and commands as a UART at {baud:,} bits per second; hold it high if there are none",
    "contact": "high while something touches the sheet",
    "alive": "turns each millisecond while whole frames without a fault come",
    "spi_clock": "to the converter of the pressure units",
    "spi_select_n": "to its select, low",
    "spi_mosi": "to its data input",
    "spi_miso": "from its data output",
    "m_axis_tdata": "a byte of a packet",
    "m_axis_tvalid": "there is one",
    "m_axis_tready": "it is taken; may be low for as long as you like",
    "m_axis_tlast": "it is the last one of its packet, 0",
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
    """Clock, reset and all others in the vectors' order: inputs, then outputs."""
    found = [(name, member.flow == In, len(getattr(core, name))) for name, member in core.signature.members.items()]
    every = [("clk", True, 1), ("rst", True, 1), *sorted(found, key=lambda port: not port[1])]
    said = {name: text.format(clock_hz=skin.clock_hz, baud=skin.baud) for name, text in MEANINGS.items()}
    return [Port(name, takes, bits, said[name]) for name, takes, bits in every]


def write(skin: Skin, folder: Path) -> list[Path]:
    """Write all files of the core into an existing folder.

    Raises :class:`IpError` if the Skin has no core.
    """
    if skin.dual:
        raise IpError("dual = true compares two copies at the transmit pin, which a core has not; leave it out")
    core = Core(skin)
    known = ports(skin, core)
    vectors = simulated(skin, core, known)
    texts = {
        f"{NAME}.v": _head(skin) + verilog(skin),
        f"{NAME}_sva.sv": assertions(skin, known),
        f"{NAME}_tb.v": testbench(known, len(vectors)),
        "vectors.hex": "".join(f"{word:x}\n" for word in vectors),
        "example.v": example(known),
        f"{NAME}.sdc": constraints(skin, known),
        "README.md": readme(skin, known),
    }
    for name, text in texts.items():
        write_text(folder / name, text)
    return [folder / name for name in texts]


def verilog(skin: Skin) -> str:
    """The core as Verilog-2005."""
    with tempfile.TemporaryDirectory(prefix="contactfpga-") as work:
        (Path(work) / "core.il").write_text(native.rtlil(Core(skin)))
        native.yosys(_VERILOG, Path(work))
        return _started((Path(work) / "core.v").read_text())


def _started(text: str) -> str:
    """Verilog that four-state simulators compute correctly from the first clock on.

    They compute a block once an input changes. Yosys writes into most blocks a signal for that, which here does change
    once, and is added to all others. Memory outputs begin with 0.
    """
    modules = [_triggered(module) for module in re.split(r"(?<=^endmodule\n)", text, flags=re.MULTILINE)]
    return re.sub(r"^(  reg (?:\[\d+:0\] )?_\d+_);$", r"\1 = 0;", "".join(modules), flags=re.MULTILINE)


def _triggered(module: str) -> str:
    """:func:`_started` for one module."""
    alone = re.compile(r"^  always @\*\n    (.*;)$", re.MULTILINE)
    found = re.search(r"^  reg (\\\$auto\$verilog_backend\S+ ) = 0;\n", module, re.MULTILINE)
    if not found and not alone.search(module):
        return module
    trigger = found[1] if found else "starts "
    place = found.span() if found else [module.index(";\n") + 2] * 2
    module = f"{module[: place[0]]}  reg {trigger} = 0;\n  initial {trigger} <= 1;\n{module[place[1] :]}"
    return alone.sub(lambda match: f"  always @* begin\n    if ({trigger}) begin end\n    {match[1]}\n  end", module)


def _head(skin: Skin) -> str:
    """Header that names the sources. Yosys writes operands in their own widths, which Verilog extends correctly."""
    return (
        f"// contactfpga {__version__}: {skin.rows}x{skin.columns} switches, Skin {skin.fingerprint.hex()}. Made by "
        "`contactfpga ip`.\n/* verilator lint_off WIDTHEXPAND */\n/* verilator lint_off WIDTHTRUNC */\n"
        "/* verilator lint_off CASEINCOMPLETE */\n/* verilator lint_off CMPCONST */\n"
        "/* verilator lint_off INITIALDLY */\n`timescale 1ns / 1ps\n"
    )


def simulated(skin: Skin, core: Core, known: list[Port]) -> list[int]:
    """Inputs and outputs of each clock as a word, inputs lowest, in Amaranth's simulator.

    After the hello two switches close and open, and the stream's reader stalls in a quarter of the clocks.
    """
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[0, 0] = cells[-1, -1] = True
    scan = skin.derived.frame_clocks
    hello = 2 * scan + 1000
    clocks = min(hello + SCANS * scan, MOST_CLOCKS)
    timeline = Timeline([(hello, cells, None), (hello + 3 * scan // 2, cells & False, None)])
    stimulus, rng = InputDriver(skin, timeline), random.Random(skin.fingerprint.hex())
    m = Module()
    m.domains.sync = clock_domain = ClockDomain()
    m.submodules.core = core
    inside = known[1:]
    takes, gives = (
        [_signal(core, clock_domain, port) for port in inside if port.takes is taken] for taken in (True, False)
    )
    places = list(itertools.accumulate((len(signal) for signal in takes), initial=0))
    place = dict(zip((port.name for port in inside if port.takes), places, strict=False))
    words: list[int] = []

    async def bench(ctx: Any) -> None:
        for clock in range(clocks):
            levels = stimulus.pins(clock, {name: ctx.get(getattr(core, name)) for name in stimulus.reads})
            word = (rng.random() < 0.75) << place["m_axis_tready"] | (clock < RESET) << place["rst"]
            word |= sum(level << place[name] for name, level in zip(stimulus.drives, levels, strict=True))
            ctx.set(Cat(*takes), word)
            _, _, out = await ctx.tick().sample(Cat(*gives))
            words.append(word | out << places[-1])

    simulator = Simulator(m)
    simulator.add_clock(1 / skin.clock_hz)
    simulator.add_testbench(bench)
    simulator.run()
    return words


def _signal(core: Core, clock_domain: ClockDomain, port: Port) -> Any:
    return clock_domain.rst if port.name == "rst" else getattr(core, port.name)


def assertions(skin: Skin, known: list[Port]) -> str:
    """Invariants at the pins, as immediate assertions for Yosys, Verilator and Icarus."""
    declared = ",\n".join(f"    input wire {port.range}{port.name}" for port in known)
    rows = "~rows" if skin.selects_low else "rows"
    one_row = (
        f"    wire {next(port.range for port in known if port.name == 'rows')}driven = {rows};\n"
        "    always @(posedge clk) if (!rst) assert ((driven & (driven - 1)) == 0);  // one row at a time\n"
        if skin.row_drive == "direct" and skin.scan == "raster" and not skin.self_test
        else ""
    )
    return f"""// What holds at the pins of {NAME} in every clock. Instantiate it beside the core with the same wires.
`timescale 1ns / 1ps
module {NAME}_sva (
{declared}
);
    reg waited = 0;
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


def testbench(known: list[Port], clocks: int) -> str:
    """A testbench that plays the vectors and compares every output in every clock."""
    inside = known[1:]
    takes, gives = ([port for port in inside if port.takes is taken] for taken in (True, False))
    wide, out = (sum(port.bits for port in some) for some in (takes, gives))
    connected = ", ".join(f".{port.name}({port.name})" for port in known)
    wires = "\n".join(f"    wire {port.range}{port.name};" for port in inside)
    return f"""// Plays vectors.hex, one word per clock, and compares each output: run it in the folder of that file.
`timescale 1ns / 1ps
module {NAME}_tb;
    reg clk = 0;
    reg [{wide + out - 1}:0] vectors [0:{clocks - 1}];
    reg [{wide - 1}:0] inputs = 0;
    wire [{out - 1}:0] outputs;
{wires}
    assign {{{", ".join(port.name for port in reversed(takes))}}} = inputs;
    assign outputs = {{{", ".join(port.name for port in reversed(gives))}}};
    {NAME} core ({connected});
    {NAME}_sva sva ({connected});

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


def example(known: list[Port]) -> str:
    """A peripheral of a small bus, with the core inside."""
    sheet = [port for port in known[2:] if not port.name.startswith("m_axis") and port.name not in ("rx", "contact")]
    declared = "\n".join(f"    {'input' if port.takes else 'output'} wire {port.range}{port.name}," for port in sheet)
    connected = ", ".join(f".{port.name}({port.name})" for port in sheet)
    return f"""// A peripheral with one register, for a bus with a select and a read strobe (Wishbone, AXI4-Lite or
// a CSR bus of LiteX need a few gates more). A read gives {{empty, last, byte}} and takes the byte. The interrupt
// is `contact`, which rises within a scan of a touch, long before the frame is there. A program collects the
// bytes up to `last` and reads the packet as docs/protocol.md says, for example with c/contactfpga.h.
`timescale 1ns / 1ps
module contactfpga_peripheral (
    input wire clk,
    input wire rst,
    input wire select,
    input wire read,
    output reg [9:0] data,
    output wire irq,
{declared}
    input wire rx  // high, or a UART's line with requests
);
    wire [7:0] tdata;
    wire tvalid, tlast;
    wire taken = select & read;

    always @(posedge clk) if (taken) data <= {{!tvalid, tlast, tdata}};

    {NAME} core (
        .clk(clk), .rst(rst), .rx(rx), .contact(irq), {connected},
        .m_axis_tdata(tdata), .m_axis_tvalid(tvalid), .m_axis_tready(taken), .m_axis_tlast(tlast)
    );
endmodule
"""


def constraints(skin: Skin, known: list[Port]) -> str:
    """Constraints of the clock and the asynchronous inputs."""
    there = [port.name for port in known if port.name in ("rx", "columns", "column_data", "rows_read")]
    paths = "".join(f"set_false_path -from [get_ports {{{name}*}}]\n" for name in there)
    return f"create_clock -name clk -period {1e9 / skin.clock_hz:.3f} [get_ports clk]\n{paths}"


def readme(skin: Skin, known: list[Port]) -> str:
    """The ports, the settings and how to try it."""
    rows = "".join(
        f"| `{port.name}` | {'in' if port.takes else 'out'} | {port.bits} | {port.meaning} |\n" for port in known
    )
    settings = "".join(f"    {line}\n" for line in skin.to_toml().splitlines())
    scan = skin.derived.frame_clocks
    return f"""# {NAME}

contactfpga {__version__} for {skin.rows}x{skin.columns} switches, as Verilog-2005 without primitives of a vendor.
One clock, synchronous reset.

| port | | bits | |
|---|---|---|---|
{rows}
- Clock: {skin.clock_hz:,} Hz. The core counts clocks, so another frequency needs another core (`clock_hz`).
- A scan takes {scan:,} clocks, {scan * 1e6 / skin.clock_hz:,.1f} us.
- Packets are those of docs/protocol.md: bytes of COBS with a check, and a 0 at the end. The first one is a hello, which
  says the size of the sheet. If a frame is ready while an older one waits, it takes its place.
- `m_axis` keeps the rules of AXI4-Stream: what is offered stays until it is taken, and `tvalid` does not wait for
  `tready`.

    iverilog -g2012 -o tb {NAME}.v {NAME}_sva.sv {NAME}_tb.v && ./tb
    verilator --binary --assert --top {NAME}_tb {NAME}.v {NAME}_sva.sv {NAME}_tb.v
    ./obj_dir/V{NAME}_tb

`example.v` is a peripheral with the core inside, `{NAME}.sdc` has the clock. The settings, to make it again with
`contactfpga ip --skin FILE`:

{settings}"""
