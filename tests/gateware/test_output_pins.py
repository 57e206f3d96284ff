"""Each pin that leads out of the FPGA comes from a register: what several make of it could glitch as they change."""

import dataclasses

import pytest
from amaranth.hdl import Elaboratable, Fragment, Module, Signal
from amaranth.hdl._ir import build_netlist
from amaranth.hdl._nir import FlipFlop, Net, Operator
from amaranth.lib import wiring
from amaranth.lib.wiring import Out
from sample import each_choice, sample

from contactfpga import Skin, examples
from contactfpga.skin.several import Several
from contactfpga_hdl.several import SeveralTop
from contactfpga_hdl.top import Top
from contactfpga_sim.verify.cosim.covering import CHOICES, REVERSAL, pairwise, skin_for

COVERING = [*pairwise(CHOICES), *pairwise(REVERSAL)]
SOME = each_choice(COVERING)
UNITS = {"rows": 2, "columns": 3, "clock_hz": 12_000_000, "baud": 3_000_000, "units": 2, "converter_v": 3.3}
FAST = {
    "scan": "reversal", "rows": 3, "columns": 4, "clock_hz": 24_000_000, "baud": 12_000_000, "precharge_us": 0.04,
    "settle_us": 0.1, "release_us": 0.05, "project_us": 0.2,
}  # fmt: skip
SKINS = {
    "reference": Skin(),
    "units": Skin(**UNITS),
    "units, fail_safe": Skin(**UNITS, fail_safe=True),
    "ADS131M08": Skin(**UNITS | {"converter": "ads131m08", "baud": 6_000_000}),
    "guard, fail_safe, alive": Skin(guard=True, fail_safe=True, alive=True),
    "registers": Skin(row_drive="74hc595", column_read="74hc165"),
    "without diodes": Skin(diodes="none", connectivity=4),
    "reversal, guard": Skin(**FAST, guard=True, fail_safe=True),
    "reversal, self-test": Skin(**FAST, self_test=True),
    "reversal, guard, self-test": Skin(**FAST, guard=True, self_test=True, diodes="row2col", alive=True),
    "dual": Skin(dual=True),
    "dual, fail_safe": Skin(dual=True, fail_safe=True, alive=True),
}


@dataclasses.dataclass
class Pins:
    """What stands behind each bit of each output: its registers, and whether anything else does."""

    netlist: object
    known: dict = dataclasses.field(default_factory=dict)

    def behind(self, net: Net) -> frozenset:
        """Registers' bits and inputs that a net follows within a clock."""
        if net.is_const:
            return frozenset()
        if net not in self.known:
            cell = self.netlist.cells[net.cell]
            if net.cell == 0 or isinstance(cell, FlipFlop) or not list(cell.comb_edges_to(net.bit)):
                self.known[net] = frozenset([net])
            elif (level := self._constant(net)) is not None:
                self.known[net] = level
            else:
                self.known[net] = frozenset().union(*(self.behind(other) for other, _ in cell.comb_edges_to(net.bit)))
        return self.known[net]

    def _constant(self, net: Net) -> frozenset | None:
        """Nothing, where an input alone decides on a level."""
        cell = self.netlist.cells[net.cell]
        if isinstance(cell, Operator) and cell.operator in "&|":
            inputs = [operand[net.bit] for operand in cell.inputs]
            if any(other.is_const and other.const == (cell.operator == "|") for other in inputs):
                return frozenset()
        return None

    def is_register(self, net: Net) -> bool:
        return isinstance(self.netlist.cells[net.cell], FlipFlop)


def outputs(top: wiring.Component) -> list[str]:
    return [path[0] for path, member, _ in top.signature.flatten(top) if member.flow == Out]


def mixed(top: wiring.Component) -> list[str]:
    """Outputs of which a bit is more than a register, its inverse or a constant."""
    ports = {port: (getattr(top, port), None) for port in top.signature.members}
    netlist = build_netlist(Fragment.get(top, None), ports=ports)
    pins, found = Pins(netlist), []
    for name in outputs(top):
        for net in netlist.top.ports_o[name]:
            behind = pins.behind(net)
            if len(behind) > 1 or not all(map(pins.is_register, behind)):
                found.append(name)
                break
    return found


@pytest.mark.parametrize("name", SKINS)
def test_each_pin_comes_from_a_register(name):
    """Of two copies ``tx`` is the first one's and a level that is constant until they differ: a line that breaks."""
    assert mixed(Top(SKINS[name])) == ["tx"] * SKINS[name].dual


def test_each_pin_of_several_sheets_comes_from_a_register():
    assert mixed(SeveralTop(Several.load(examples() / "two-sheets.toml"))) == []


@pytest.mark.parametrize("number", sample(range(len(COVERING)), quick=SOME[:3], slow=SOME))
def test_each_pin_of_the_covering_set_comes_from_a_register(number):
    assert mixed(Top(skin_for(COVERING[number]))) == []


class _Odd(wiring.Component):
    """One pin that two registers make, one that an input makes, and one of a register's inverse."""

    def __init__(self):
        super().__init__({"both": Out(1), "through": Out(1), "inverse": Out(1), "level": wiring.In(1)})

    def elaborate(self, platform) -> Elaboratable:
        m = Module()
        one, other = Signal(), Signal()
        m.d.sync += [one.eq(self.level), other.eq(one)]
        m.d.comb += [self.both.eq(one | other), self.through.eq(~self.level), self.inverse.eq(~one)]
        return m


def test_the_walk_finds_what_is_no_register():
    assert mixed(_Odd()) == ["both", "through"]
