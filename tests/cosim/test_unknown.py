"""From a power-up at which nothing is known, every output is known after the reset, and the golden model's."""

import bench_unknown
import pytest
from amaranth.hdl import Fragment
from bench_unknown import Unknown, forget, initialized
from reversal import never_let_go
from sample import sample

from contactfpga.skin import Skin
from contactfpga_hdl.link.link import hello_words
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_sim.model.golden import predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.sheet.matrix import Contention
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.covering import stimulus
from contactfpga_sim.verify.proofs.inside import Inside

SMALL = Skin(rows=8, columns=8)
REVERSAL = {"scan": "reversal", "precharge_us": 0.5, "settle_us": 2.0}
SKINS = {
    "moments": SMALL,
    "16x16": Skin(),
    "4-connected": SMALL.replace(connectivity=4, zone_capacity=4),
    "serial": SMALL.replace(labeller="serial"),
    "serial, 4-connected": SMALL.replace(labeller="serial", connectivity=4, rows=9, columns=7, zone_capacity=4),
    "projection": SMALL.replace(labeller="projection"),
    "single": SMALL.replace(labeller="single"),
    "symmetric": SMALL.replace(debounce="sym_defer_pk", debounce_press_us=60.0, debounce_release_us=120.0),
    "eager": SMALL.replace(
        debounce="asym_eager_defer_pk",
        debounce_press_us=60.0,
        debounce_release_us=120.0,
        send="on_change",
        keep_alive_ms=0.3,
    ),
    "barycenter": SMALL.replace(report="barycenter", barycenter_bits=2),
    "cells": SMALL.replace(report="cells", diodes="row2col", send="on_change", keep_alive_ms=0.3),
    "precharge": SMALL.replace(diodes="row2col", precharge_us=0.5),
    "reversal": SMALL.replace(**REVERSAL),
    "self-test": SMALL.replace(**REVERSAL, self_test=True),
    "reversal, cells": SMALL.replace(**REVERSAL, report="cells", diodes="row2col", send="on_change"),
}

with_icarus = pytest.mark.skipif(not bench_unknown.available(), reason="no iverilog on PATH")


AT_A_PIN = r"cycle \d+: rows (\w*x|[01]{8}, tx (x|[01], contact x))"
"""What is unknown may restart the board, and then it shows at the rows or at ``contact`` first."""


@with_icarus
@pytest.mark.parametrize("name", sample(SKINS, quick=["serial, 4-connected", "eager", "reversal"]))
def test_no_output_depends_on_what_was_there_at_power_up(name, record_property):
    skin = SKINS[name]
    cycles = (40 if skin.scan == "reversal" else 10) * facts(skin).scan_clocks
    timeline = stimulus(skin, cycles, seed=3)
    assert compare(predict(skin, timeline, cycles).at_the_pins(), bench_unknown.run(skin, timeline, cycles)) > 400
    record_property("cases", cycles)


@with_icarus
@pytest.mark.parametrize(
    ("missing", "name"),
    sample([("link", "symmetric"), ("label", "serial")], quick=[("link", "symmetric")]),
)
def test_memory_contents_that_the_bitstream_does_not_bring_are_seen(missing, name):
    skin = SKINS[name]
    cycles = 20 * facts(skin).scan_clocks
    kept = [pattern for pattern in initialized(skin) if missing not in pattern]
    with pytest.raises(Unknown, match=AT_A_PIN):
        bench_unknown.run(skin, stimulus(skin, cycles, seed=3), cycles, kept)


@with_icarus
def test_a_register_without_a_reset_is_seen(monkeypatch):
    elaborate = Scanner.elaborate

    def without_reset(self, platform):
        fragment = Fragment.get(elaborate(self, platform), platform)
        Inside(fragment)["seen"]._reset_less = True
        return fragment

    monkeypatch.setattr(Scanner, "elaborate", without_reset)
    cycles = 3 * facts(SMALL).scan_clocks
    with pytest.raises(Unknown, match=r"cycle \d+: rows [01]{8}, tx [01], contact x"):
        bench_unknown.run(SMALL, stimulus(SMALL, cycles, seed=3), cycles)


@with_icarus
def test_lines_that_are_driven_against_each_other_are_reported(monkeypatch):
    never_let_go(monkeypatch)
    cycles = 6 * facts(SMALL).scan_clocks
    skin = SKINS["reversal"]
    with pytest.raises(Contention, match=r"cycle \d+: columns [01]{8} are driven against rows [01]{8}"):
        bench_unknown.run(skin, stimulus(skin, cycles, seed=3), cycles)


@with_icarus
def test_a_word_that_is_read_while_it_is_written_is_seen(monkeypatch):
    # All zones are in one place of the table.
    monkeypatch.setattr("contactfpga_hdl.label.join.place_of", lambda derived, column: column & 0)
    cycles = 6 * facts(SMALL).scan_clocks
    with pytest.raises(Unknown, match=AT_A_PIN):
        bench_unknown.run(SMALL, stimulus(SMALL, cycles, seed=3), cycles)


@with_icarus
def test_a_bracket_that_is_read_while_it_is_written_is_seen(monkeypatch):
    monkeypatch.setattr("contactfpga_hdl.label.serial.place_of", lambda derived, column: column & 0)
    skin = SKINS["serial"]
    cycles = 6 * facts(skin).scan_clocks
    with pytest.raises(Unknown, match=AT_A_PIN):
        bench_unknown.run(skin, stimulus(skin, cycles, seed=3), cycles)


def test_only_what_is_named_keeps_its_value():
    first = hello_words(SMALL).start
    hello, frame = rf"  reg [7:0] \link.store[{first}] ", rf"  reg [7:0] \link.store[{first - 1}] "
    text, known = forget(f"{hello} = 8'h41;\n{frame} = 8'h00;\n  reg busy = 1'h0;\n  wire x = y;\n", initialized(SMALL))
    assert known == {rf"\link.store[{first}]": "8'h41"}
    assert text == f"{hello};\n{frame};\n  reg busy ;\n  wire x = y;\n"
