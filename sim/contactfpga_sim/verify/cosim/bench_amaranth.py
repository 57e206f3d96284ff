"""The gateware top in Amaranth's simulator."""

from __future__ import annotations

import contextlib
import itertools
import time
from typing import TYPE_CHECKING, Any

from amaranth.hdl import Cat, Const
from amaranth.sim import Simulator

from contactfpga_hdl.top import Top
from contactfpga_sim.model.golden.trace import Timeline, Trace
from contactfpga_sim.verify.cosim.record import LEVELS, PAYLOADS, InputDriver, OutOfTime, TraceRecorder, ports

if TYPE_CHECKING:
    from contactfpga.skin import Skin


def run(skin: Skin, timeline: Timeline, cycles: int, limit_s: float = 60.0, vcd: str | None = None) -> Trace:
    """Trace of ``cycles`` clocks of the board; raises :class:`OutOfTime` after ``limit_s`` processor seconds.

    ``vcd``: file for every signal in every clock, in board time.
    """
    top = Top(skin, probes=True)
    simulator = Simulator(top)
    simulator.add_clock(1 / skin.clock_hz)
    recorder = TraceRecorder(cycles)
    stimulus = InputDriver(skin, timeline)
    there = ports(LEVELS, skin)
    levels = Cat(*(getattr(top, name) if name in there else Const(0, 1) for name in LEVELS))
    names = ports(PAYLOADS, skin)
    payloads = [getattr(top, name) for name in names]
    reads = {name: getattr(top, name) for name in stimulus.reads}
    drives = [getattr(top, name) for name in stimulus.drives]
    places = list(itertools.accumulate((len(port) for port in drives), initial=0))
    deadline = time.process_time() + limit_s

    async def bench(ctx: Any) -> None:
        for cycle in range(cycles):
            pins = stimulus.pins(cycle, {name: ctx.get(port) for name, port in reads.items()})
            ctx.set(Cat(*drives), sum(level << place for level, place in zip(pins, places, strict=False)))
            _, _, level, *values = await ctx.tick().sample(levels, *payloads)
            recorder.note(cycle, level, dict(zip(names, values, strict=True)).__getitem__)
            if cycle % 256 == 0 and time.process_time() > deadline:
                raise OutOfTime(f"{cycle} of {cycles} cycles simulated in {limit_s:g} s")

    simulator.add_testbench(bench)
    with simulator.write_vcd(vcd) if vcd else contextlib.nullcontext():
        simulator.run()
    return recorder.trace
