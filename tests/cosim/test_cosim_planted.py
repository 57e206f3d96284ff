"""A fault planted in the gateware, at each boundary, is named by co-simulation in the cycle in which it shows."""

import functools

import numpy as np
import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from sample import sample

from contactfpga.skin import Skin
from contactfpga_hdl import top
from contactfpga_hdl.label import run, serial
from contactfpga_hdl.report import divide
from contactfpga_hdl.scan import raster
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import Mismatch, compare

SKIN = Skin(rows=4, columns=6)
CYCLES = 4 * 72 * 8

# Stages that a Skin chooses, and where their classes are; the others are in the top.
CHOSEN = {
    "scan": (raster, "Scanner"),
    "run": (run, "RunLabeller"),
    "serial": (serial, "SerialLabeller"),
    "Divider": (divide, "Divider"),
}

# boundary: the stage whose output it is, and the name of that output
STAGES = {
    "rows": ("scan", "rows"),
    "records": ("labeller", "records"),
    "items": ("Divider", "items"),
    "bytes": ("Link", "bytes"),
    "line": ("Transmitter", "pin"),
}


def faulty(stage, port, fault):
    """The stage with ``fault(m, from_stage, to_outside)`` between one of its outputs and the outside."""

    class Faulty(wiring.Component):
        def __init__(self, *args):
            self.inner = stage(*args)
            super().__init__(self.inner.signature)

        def elaborate(self, platform):
            m = Module()
            m.submodules.inner = self.inner
            for name, member in self.signature.members.items():
                inside, outside = getattr(self.inner, name), getattr(self, name)
                if name == port:
                    fault(m, inside, outside)
                elif member.is_signature:
                    wiring.connect(m, wiring.flipped(outside), inside)
                elif member.flow == wiring.Out:
                    m.d.comb += outside.eq(inside)
                else:
                    m.d.comb += inside.eq(outside)
            return m

    return Faulty


def a_clock_late(m, inside, outside):
    if isinstance(inside, Signal):
        m.d.sync += outside.eq(inside)
        return
    with m.If(~outside.valid | outside.ready):
        m.d.sync += [outside.valid.eq(inside.valid), outside.payload.eq(inside.payload)]
    m.d.comb += inside.ready.eq(~outside.valid | outside.ready)


def one_bit_wrong(m, inside, outside):
    """The lowest bit of the payload is inverted in the transfer after 1,000 cycles; of a line, a bit of a byte."""
    clock = Signal(16)
    m.d.sync += clock.eq(clock + 1)
    if isinstance(inside, Signal):
        m.d.comb += outside.eq(inside ^ (clock == 1000))
        return
    done = Signal()
    due = (clock >= 1000) & ~done
    with m.If(due & inside.valid & inside.ready):
        m.d.sync += done.eq(1)
    payload = getattr(inside.payload, "as_value", lambda: inside.payload)()
    m.d.comb += [
        outside.valid.eq(inside.valid),
        outside.payload.eq(payload ^ due),
        inside.ready.eq(outside.ready),
    ]


@functools.cache
def sound(skin):
    """What is done to a board, and what the model predicts, which the gateware does without a fault."""
    rng = np.random.default_rng(3)
    timeline = Timeline.frames(skin, rng.random((8, 4, 6)) < 0.4)
    expected = predict(skin, timeline, CYCLES)
    assert compare(expected, bench_amaranth.run(skin, timeline, CYCLES)) > 100
    return timeline, expected


@pytest.mark.parametrize("fault", [a_clock_late, one_bit_wrong])
@pytest.mark.parametrize(
    ("boundary", "labeller"),
    sample(
        [*((boundary, "run") for boundary in STAGES), ("records", "serial")],
        quick=[("rows", "run"), ("records", "run"), ("bytes", "run")],
    ),
)
def test_a_fault_in_the_gateware_is_named(monkeypatch, record_property, boundary, labeller, fault):
    skin = SKIN.replace(labeller=labeller, report="barycenter" if boundary == "items" else "moments")
    timeline, expected = sound(skin)
    stage, port = STAGES[boundary]
    module, name = CHOSEN[labeller] if stage == "labeller" else CHOSEN.get(stage, (top, stage))
    monkeypatch.setattr(module, name, faulty(getattr(module, name), port, fault))
    with pytest.raises(Mismatch) as found:
        compare(expected, bench_amaranth.run(skin, timeline, CYCLES))
    assert found.value.boundary == boundary
    assert str(found.value.cycle) in str(found.value)
    if fault is one_bit_wrong:
        assert found.value.cycle >= 1000
    else:
        assert found.value.cycle == expected.events(boundary)[0][0]
