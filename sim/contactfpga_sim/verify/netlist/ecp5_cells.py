"""Verilog of ECP5 cells without a usable Yosys model, for the gateware's needs. Any other use names a missing
module."""

from __future__ import annotations

_RAM_BYTES, _WORDS_AN_INITVAL = 2048, 16


def cells() -> str:
    return _block_ram() + _PIN + _GLOBAL_RESET + _pll()


# Yosys drives an input's pin with "not driven", which loses what drives it outside.
_PIN = """module TRELLIS_IO(inout B, input I, T, output O);
parameter DIR = "INPUT";
generate
    if (DIR == "INPUT") begin
        assign O = B;
    end else if (DIR == "OUTPUT") begin
        assign B = I;
    end else begin
        this_use_of_TRELLIS_IO_has_no_model refused();
    end
endgenerate
endmodule
"""

# It puts every flip-flop into the state that the simulation starts from.
_GLOBAL_RESET = "module SGSR(input CLK, GSR); endmodule\n"


def _block_ram() -> str:
    """Two ports of 9 or 18 bits that read before write, without output registers.

    9 bits are a byte with its parity bit; an 18-bit address counts these in pairs, with their enables in the two lowest
    bits.
    """
    ports, parameters, bodies = [], [], []
    for side in "AB":
        ports += _bits("input", f"DI{side}", 18) + _bits("input", f"AD{side}", 14) + _bits("output", f"DO{side}", 18)
        ports += [f"input {name}{side}" for name in ("CLK", "CE", "OCE", "WE", "RST")] + _bits("input", f"CS{side}", 3)
        parameters += [f'CLK{side}MUX = "CLK{side}"', f"DATA_WIDTH_{side} = 18", f'REGMODE_{side} = "NOREG"']
        parameters += [f'WRITEMODE_{side} = "NORMAL"', f'CSDECODE_{side} = "0b000"']
        bodies.append(_ram_port(side))
    slices = range(_RAM_BYTES // 2 // _WORDS_AN_INITVAL)
    parameters += ['RESETMODE = "SYNC"', 'ASYNC_RESET_RELEASE = "SYNC"', 'GSR = "ENABLED"']
    parameters += [f"INITVAL_{number:02X} = 320'b0" for number in slices]
    initial = "".join(_initial(number) for number in slices)
    return (
        f"module DP16KD({', '.join(ports)});\n"
        + "".join(f"parameter {parameter};\n" for parameter in parameters)
        + f"reg [8:0] bytes [0:{_RAM_BYTES - 1}];\ninteger i;\ninitial begin\n{initial}end\n"
        + "".join(bodies)
        + "endmodule\n"
    )


def _initial(number: int) -> str:
    first = 2 * _WORDS_AN_INITVAL * number
    value = f"INITVAL_{number:02X}"
    return (
        f"for (i = 0; i < {_WORDS_AN_INITVAL}; i = i + 1) begin "
        f"bytes[{first} + 2 * i] = {value}[20 * i +: 9]; bytes[{first + 1} + 2 * i] = {value}[20 * i + 9 +: 9]; end\n"
    )


def _ram_port(side: str) -> str:
    wide, word, data = f"DATA_WIDTH_{side} == 18", f"address{side}[13:4]", f"data{side}"
    return f"""
wire [13:0] address{side} = {_vector(f"AD{side}", 14)};
wire [17:0] {data} = {_vector(f"DI{side}", 18)};
reg [17:0] q{side} = 0;
assign {_vector(f"DO{side}", 18)} = q{side};
generate
    if ((!({wide}) && DATA_WIDTH_{side} != 9) || CLK{side}MUX != "CLK{side}" || REGMODE_{side} != "NOREG") begin
        this_use_of_DP16KD_has_no_model refused();
    end
    if ({wide}) begin
        always @(posedge CLK{side}) if (CE{side}) begin
            q{side} <= {{bytes[{{{word}, 1'b1}}], bytes[{{{word}, 1'b0}}]}};
            if (WE{side} && address{side}[0]) bytes[{{{word}, 1'b0}}] <= {data}[8:0];
            if (WE{side} && address{side}[1]) bytes[{{{word}, 1'b1}}] <= {data}[17:9];
        end
    end else begin
        always @(posedge CLK{side}) if (CE{side}) begin
            q{side} <= bytes[address{side}[13:3]];
            if (WE{side}) bytes[address{side}[13:3]] <= {data}[8:0];
        end
    end
endgenerate
"""


def _pll() -> str:
    """A stub: always locked, with its input as output."""
    control = ("CLKFB", "RST", "STDBY", "PLLWAKESYNC", "ENCLKOP")
    phase = ("PHASESEL0", "PHASESEL1", "PHASEDIR", "PHASESTEP", "PHASELOADREG")
    parameters = ("CLKI_DIV", "CLKFB_DIV", "CLKOP_DIV", "CLKOP_CPHASE", "CLKOP_ENABLE", "FEEDBK_PATH")
    return (
        f"module EHXPLLL(input CLKI, {', '.join(control + phase)}, output CLKOP, LOCK);\n"
        + "".join(f"parameter {name} = 0;\n" for name in parameters)
        + "assign CLKOP = CLKI;\nassign LOCK = 1'b1;\nendmodule\n"
    )


def _bits(direction: str, name: str, width: int) -> list[str]:
    return [f"{direction} {name}{bit}" for bit in range(width)]


def _vector(name: str, width: int) -> str:
    return "{" + ", ".join(f"{name}{bit}" for bit in reversed(range(width))) + "}"
