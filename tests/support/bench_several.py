"""The gateware of several sheets at one FPGA in Amaranth's own simulator, recorded as a trace of each sheet."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from amaranth.hdl import Cat
from amaranth.sim import Simulator

from contactfpga.skin.several import Several
from contactfpga_hdl.several import SeveralTop
from contactfpga_sim.model.golden.trace import Timeline, Trace
from contactfpga_sim.verify.cosim.record import LEVELS, PAYLOADS, InputDriver, OutOfTime, TraceRecorder, ports

_SHARED = ("tx", "rx", "contact")


def run(several: Several, timelines: Sequence[Timeline], cycles: int, limit_s: float = 60.0) -> list[Trace]:
    """Simulate ``cycles`` clocks; what is received is the first timeline's. Raises :class:`OutOfTime`."""
    top = SeveralTop(several, probes=True)
    sheets = [_Sheet(top, number, timeline, cycles) for number, timeline in enumerate(timelines)]
    simulator = Simulator(top)
    simulator.add_clock(1e-6)
    deadline = time.process_time() + limit_s

    async def bench(ctx: Any) -> None:
        for cycle in range(cycles):
            for sheet in sheets:
                sheet.drive(ctx, cycle)
            samples = await ctx.tick().sample(*(sheet.sampled for sheet in sheets))
            for sheet, sample in zip(sheets, samples[2:], strict=True):
                sheet.note(cycle, sample)
            if cycle % 256 == 0 and time.process_time() > deadline:
                raise OutOfTime(f"{cycle} of {cycles} cycles simulated in {limit_s:g} s")

    simulator.add_testbench(bench)
    simulator.run()
    return [sheet.recorder.trace for sheet in sheets]


class _Sheet:
    """Ports of one sheet, what drives them and what is recorded of them."""

    def __init__(self, top: SeveralTop, number: int, timeline: Timeline, cycles: int):
        skin = top.several.skins[number]

        def port(name: str) -> Any:
            return getattr(top, name if name in _SHARED else f"{name}_{number}")

        self.recorder = TraceRecorder(cycles)
        self._stimulus = InputDriver(skin, timeline)
        self._reads = {name: port(name) for name in self._stimulus.reads}
        self._drives = [
            (place, port(name)) for place, name in enumerate(self._stimulus.drives) if number == 0 or name != "rx"
        ]
        there = ports(LEVELS, skin)
        fields = [(name, port(name)) for name in (*there, *ports(PAYLOADS, skin))]
        self.sampled = Cat(field for _, field in fields)
        self._bits = {LEVELS.index(name): place for place, name in enumerate(there)}
        self._places: dict[str, tuple[int, int]] = {}
        offset = 0
        for name, field in fields:
            self._places[name] = (offset, (1 << len(field)) - 1)
            offset += len(field)

    def drive(self, ctx: Any, cycle: int) -> None:
        pins = self._stimulus.pins(cycle, {name: ctx.get(port) for name, port in self._reads.items()})
        for place, port in self._drives:
            ctx.set(port, pins[place])

    def note(self, cycle: int, sample: int) -> None:
        levels = sum((sample >> at & 1) << place for place, at in self._bits.items())
        self.recorder.note(cycle, levels, lambda name: sample >> self._places[name][0] & self._places[name][1])
