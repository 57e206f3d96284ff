"""Two copies that are compared say what one says, in the same clock, and neither is optimized away."""

import numpy as np
import pytest
from amaranth.hdl import Cat, Module, Signal
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from contactfpga import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.dual import PAUSE_BITS, Dual
from contactfpga_hdl.top import Top
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare

SMALL = Skin(rows=2, columns=3, settle_us=3.0, dual=True)


@pytest.mark.parametrize("changes", [{}, {"send": "on_change", "labeller": "serial"}], ids=["always", "on change"])
def test_without_a_difference_each_clock_is_that_of_the_plain_gateware(changes):
    skin = SMALL.replace(**changes)
    rng = np.random.default_rng(4)
    timeline = Timeline.frames(skin, list(rng.random((12, skin.rows, skin.columns)) < 0.4))
    cycles = 12 * skin.derived.frame_clocks + 1200
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles, limit_s=300)) > 100


class Copy(Top):
    """A copy with only the gateware's ports: ``said`` are the bits of its outputs, ``heard`` those of its inputs."""

    def __init__(self, skin):
        super().__init__(skin, copy=True)
        self.outputs, self.heard = ports(self, Out), ports(self, In)
        self.said = Signal(len(self.outputs), init=-1)

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.outputs.eq(self.said)
        return m


def ports(component, flow):
    return Cat(getattr(component, name) for name, port in component.signature.members.items() if port.flow == flow)


PINS = {
    "registers": {"row_drive": "74hc595", "column_read": "74hc165", "settle_us": 4.0},
    "reversal": {"scan": "reversal", "precharge_us": 0.5, "alive": True, "self_test": True},
    "units": {"units": 2, "converter": "mcp3208", "fail_safe": True, "guard": True},
}


@pytest.mark.whole
@pytest.mark.parametrize("name", PINS)
def test_each_bit_at_each_pin_is_compared_and_heard_by_both(name):
    skin = SMALL.replace(**PINS[name])
    first, second = Copy(skin), Copy(skin)
    dut = Dual(skin, first, second)
    inputs = ports(dut, In)
    restart = 2 * PAUSE_BITS * skin.derived.bit_clocks + skin.derived.frame_clocks + 2
    rng = np.random.default_rng(5)

    async def bench(ctx):
        given = ctx.get(inputs)
        for bit in range(len(second.said)):
            await ctx.tick().repeat(restart)
            assert ctx.get(dut.tx)
            ctx.set(second.said, ctx.get(second.said) ^ 1 << bit)
            await ctx.tick()
            ctx.set(second.said, -1)
            assert not ctx.get(dut.tx), bit
        for _ in range(40):
            ctx.set(inputs, int(rng.integers(1 << len(inputs))))
            assert (ctx.get(first.heard), ctx.get(second.heard)) == (ctx.get(inputs), given)
            given = ctx.get(inputs)
            await ctx.tick()

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()


@pytest.mark.campaign
@pytest.mark.parametrize("labeller", ["run", "serial"])
def test_synthesis_keeps_both(labeller):
    """Yosys keeps the registers of both copies, of which it would merge one in seven if they ran in the same clock.
    Logic without registers may be shared."""
    skin = Skin(labeller=labeller, dual=True)
    copies = (lambda: Top(skin, copy=True), lambda: Top(skin))
    (one_luts, one_flip_flops, _), (luts, flip_flops, _) = (sizes.counts(make, sizes.UP5K) for make in copies)
    assert flip_flops >= 2 * one_flip_flops
    assert luts < 2 * one_luts + 200
