"""The cells of Yosys in drivers/integers, which compiled boards are made of, against Python's integers."""

import random
import subprocess

import pytest

from contactfpga_sim.board import native

FOLDER = native._INTEGERS
WIDTHS = [(1, 1, 1), (5, 9, 7), (9, 5, 32), (32, 33, 31), (64, 3, 64), (65, 70, 123), (128, 128, 64)]
"""Bits of both operands and of the result: about the machine's numbers, and across them."""


def extended(number, bits, signed):
    return number - (1 << bits) if signed and number >> bits - 1 else number


ONE = {
    "logic_not": lambda a: a == 0,
    "reduce_bool": lambda a: a != 0,
    "reduce_or": lambda a: a != 0,
    "reduce_xor": lambda a: a.bit_count() % 2,
    "reduce_xnor": lambda a: 1 - a.bit_count() % 2,
    "not_u": lambda a: ~a,
    "not_s": lambda a: ~a,
    "pos_u": lambda a: a,
    "pos_s": lambda a: a,
    "neg_u": lambda a: -a,
    "neg_s": lambda a: -a,
}
BOTH = {
    "and": lambda a, b: a & b,
    "or": lambda a, b: a | b,
    "xor": lambda a, b: a ^ b,
    "xnor": lambda a, b: ~(a ^ b),
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
}
SHIFTS = {
    "shl_uu": lambda a, b: a << b,
    "sshl_su": lambda a, b: a << b,
    "shr_uu": lambda a, b: a >> b,
    "sshr_su": lambda a, b: a >> b,
    "shift_uu": lambda a, b: a >> b,
}
TWO = {f"{name}_{signs}": rule for name, rule in BOTH.items() for signs in ("uu", "ss")} | SHIFTS
PROGRAM = """
#include <cstdio>
#include <cxxrtl/cxxrtl.h>
using namespace cxxrtl_yosys;
template <size_t Bits> void say(const char *name, const value<Bits> &v) {
    std::printf("%s ", name);
    for (size_t n = v.chunks; n--;) std::printf("%08x", v.data[n]);
    std::printf("\\n");
}
template <size_t A, size_t B, size_t Y> void all(value<A> a, value<B> b) {
"""
JOINED = """
    value<3> high; value<Y> low;
    high.concat(value<2>()).concat(low) = value<3>{0x5u}.concat(value<2>{0x3u}).concat(add_uu<Y>(a, b)).val();
    say("joined high", high);
    say("joined low", low);
    say("slice", a.template slice<A - 1, A / 2>().val());
    say("repeat", a.template slice<A - 1>().template repeat<Y>().val());
    say("truth", value<1>{a ? 1u : 0u});
}
int main() {
"""


def operands():
    """Of each widths some pairs: all ones, zero, small numbers to shift by, and random ones."""
    rng = random.Random(1)
    for a, b, _ in WIDTHS:
        shifts = [min(n, (1 << b) - 1) for n in (0, 1, 31, a)]
        yield [(rng.getrandbits(a) | 1 << a - 1, n) for n in shifts] + [
            ((1 << a) - 1, (1 << b) - 1),
            (0, rng.getrandbits(b)),
            *((rng.getrandbits(a), rng.getrandbits(b)) for _ in range(3)),
        ]


def literal(number, bits):
    return f"value<{bits}>{{{','.join(f'{number >> 32 * n & 0xFFFFFFFF:#x}u' for n in range(-(-bits // 32)))}}}"


def expected(a_bits, b_bits, y_bits, a, b):
    for name, rule in ONE.items():
        yield name, rule(extended(a, a_bits, name.endswith("_s"))), y_bits
    yield "reduce_and", a == (1 << a_bits) - 1, y_bits
    for name, rule in TWO.items():
        first, second = name.split("_")[1]
        if b > 200 and name in SHIFTS:
            result = -(extended(a, a_bits, first == "s") < 0) if name == "sshr_su" else 0
        else:
            result = rule(extended(a, a_bits, first == "s"), extended(b, b_bits, second == "s"))
        yield name, result, y_bits
    yield "joined high", 5, 3
    yield "joined low", a + b, y_bits
    yield "slice", a >> a_bits // 2, a_bits - a_bits // 2
    yield "repeat", -(a >> a_bits - 1), y_bits
    yield "truth", a != 0, 1


def build(text, folder):
    (folder / "cells.cpp").write_text(text)
    command = [*native.find_compiler(), "-std=c++17", "-w", f"-I{FOLDER}", "cells.cpp", "-o", "cells"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_cells_compute_what_pythons_integers_do(tmp_path, record_property):
    program = PROGRAM
    program += "".join(f'    say("{name}", {name}<Y>(a));\n' for name in [*ONE, "reduce_and"])
    program += "".join(f'    say("{name}", {name}<Y>(a, b));\n' for name in TWO) + JOINED
    lines = []
    for (a_bits, b_bits, y_bits), pairs in zip(WIDTHS, operands()):
        for a, b in pairs:
            program += f"    all<{a_bits}, {b_bits}, {y_bits}>({literal(a, a_bits)}, {literal(b, b_bits)});\n"
            for name, result, bits in expected(a_bits, b_bits, y_bits, a, b):
                lines.append(
                    (f"{name} {int(result) % (1 << bits):0{8 * -(-bits // 32)}x}", (a_bits, b_bits, y_bits, a, b))
                )
    built = build(program + "}\n", tmp_path)
    assert built.returncode == 0, built.stderr
    said = subprocess.run([tmp_path / "cells"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert [(line, case) for line, (_, case) in zip(said, lines)] == lines
    assert len(said) == len(lines)
    record_property("cases", len(lines))


@pytest.mark.parametrize(
    "line",
    ["value<129> wide;", "a.slice<1>() = value<1>{0u};", "a.slice<1>().concat(b) = a;", "wire<2> w; wire<2> copy = w;"],
)
def test_what_would_go_wrong_does_not_compile(tmp_path, line):
    text = "#include <cxxrtl/cxxrtl.h>\nusing namespace cxxrtl;\nint main() { value<3> a; value<2> b; %s }\n"
    assert build(text % "b = a.slice<1>().concat(a.slice<2>()).val();", tmp_path).returncode == 0
    assert build(text % line, tmp_path).returncode != 0


def test_a_design_that_needs_more_takes_yosys_own_header(tmp_path, monkeypatch):
    commands = []
    run = native._run

    def noted(command, cwd=None):
        commands.append(command)
        run(command, cwd)

    monkeypatch.setattr(native, "_run", noted)
    monkeypatch.setenv("CONTACTFPGA_CACHE", str(tmp_path))
    text = (
        "module top(input clk, input [128:0] a, output reg [128:0] q);\nalways @(posedge clk) q <= q + a;\nendmodule\n"
    )
    netlist = native.Netlist({"wide.v": text}, "read_verilog wide.v")
    (tmp_path / "wide.cpp").write_text(
        '#include "clocked.h"\nEXPORT size_t chunks() { Clocked c; return c.top.p_q.curr.chunks; }\n'
    )
    model = native.Model("wide", str(tmp_path / "wide.cpp"), netlist.key, lambda: netlist, quiet=True)
    assert native.load(model).chunks() == 5
    assert [f"-I{FOLDER}" in command for command in commands[-2:]] == [True, False]
