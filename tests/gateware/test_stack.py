"""The labeller's stack against a list."""

import pytest
from amaranth.hdl import Module
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from contactfpga_hdl.util.stack import Stack

ENTRY = data.StructLayout({"a": 5, "b": 3})


class Ports(wiring.Component):
    """The stack with its signals as ports, so that the simulator can drive them."""

    def __init__(self, depth):
        self.stack = Stack(ENTRY, depth)
        super().__init__({"enable": In(1), "push": In(1), "pop": In(1), "entry": In(ENTRY), "top": Out(ENTRY)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.stack = stack = self.stack
        m.d.comb += [
            stack.enable.eq(self.enable),
            stack.push.eq(self.push),
            stack.pop.eq(self.pop),
            stack.entry.eq(self.entry),
            self.top.eq(stack.top),
        ]
        return m


def operations(rng, depth, count, bias):
    """(enable, push, pop, entry) that never pop an empty stack or push onto a full one."""
    level = 0
    for cycle in range(count):
        upwards = bias if cycle // 50 % 2 else 1 - bias  # so that it runs full and empty
        enable, entry = rng.random() < 0.8, rng.randrange(256)
        pop = level > 0 and rng.random() < 1 - upwards
        push = level - pop < depth and rng.random() < upwards
        yield int(enable), int(push), int(pop), entry
        level += (push - pop) if enable else 0


@pytest.mark.parametrize("depth", [1, 2, 3, 4, 7, 16])
@pytest.mark.parametrize("bias", [0.7, 0.9])
def test_top_and_level_are_those_of_a_list(bench, rng, depth, bias):
    steps = list(operations(rng, depth, 1500, bias))
    dut = Ports(depth)
    sim = bench(dut)
    for index, name in enumerate(("enable", "push", "pop", "entry")):
        sim.drive(getattr(dut, name), lambda cycle, index=index: steps[min(cycle, len(steps) - 1)][index])
    top, level = sim.watch(dut.top), sim.watch(dut.stack.level)
    sim.run(len(steps))
    entries, levels = [], set()
    for cycle, (enable, push, pop, entry) in enumerate(steps):
        assert level[cycle] == len(entries), f"cycle {cycle}"
        if entries:
            assert top[cycle] == entries[-1], f"cycle {cycle}"
        levels.add(len(entries))
        if enable and pop:
            entries.pop()
        if enable and push:
            entries.append(entry)
    assert levels == set(range(depth + 1))
