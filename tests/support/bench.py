"""A stage in Amaranth's simulator, clock by clock."""

import contextlib
import itertools
import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from amaranth.hdl import Cat, Value
from amaranth.sim import Simulator

NUMBERS = itertools.count(1)
"""Of waveforms."""


def split(word: int, widths: Iterable[int]) -> tuple[int, ...]:
    """The fields of these widths in bits that make up a word, the lowest first."""
    fields = []
    for width in widths:
        fields.append(word & (1 << width) - 1)
        word >>= width
    assert word == 0
    return tuple(fields)


class Source:
    """Offers ``items`` (ints) to a stream; item i from cycle ``not_before[i]`` on, and only by chance with ``gap``."""

    def __init__(self, port, items, rng=None, gap=0.0, not_before=None):
        payload = Value.cast(port.payload)
        self.targets = [port.valid, payload]
        self.watched = [port.ready]
        self.items = list(items)
        self.transfers = []  # cycle of each item
        self._rng, self._gap = rng, gap
        self._not_before = not_before
        self._offering = False

    def drive(self, cycle, _ctx):
        index = len(self.transfers)
        if not self._offering and index < len(self.items):
            early = self._not_before is not None and cycle < self._not_before[index]
            self._offering = not early and not (self._gap and self._rng.random() < self._gap)
        return (1, self.items[index]) if self._offering else (0, 0)

    def note(self, cycle, ready):
        if self._offering and ready:
            self.transfers.append(cycle)
            self._offering = False

    @property
    def done(self):
        return len(self.transfers) == len(self.items)


class Sink:
    """Takes what a stream offers, by chance with ``stall`` or as ``ready(cycle)`` says, and holds it to the rules."""

    def __init__(self, port, rng=None, stall=0.0, ready=None):
        self.targets = [port.ready]
        self.watched = [port.valid, Value.cast(port.payload)]
        self.transfers = []  # (cycle, payload)
        self.offered = []  # cycle from which each of them was offered
        self._ready = ready or (lambda cycle: not (stall and rng.random() < stall))
        self._takes = False
        self._waiting = None

    def drive(self, cycle, _ctx):
        self._takes = bool(self._ready(cycle))
        return (int(self._takes),)

    def note(self, cycle, valid, payload):
        if self._waiting is not None:
            assert valid, f"cycle {cycle}: an offer was withdrawn"
            assert payload == self._waiting, f"cycle {cycle}: an offer changed before it was taken"
        elif valid:
            self.offered.append(cycle)
        self._waiting = payload if valid and not self._takes else None
        if valid and self._takes:
            self.transfers.append((cycle, payload))


class Drive:
    """Sets a value to ``schedule(cycle)``, or to ``schedule(cycle, seen)`` with what a register holds in that cycle."""

    def __init__(self, target, schedule: Callable[..., int], seen=None):
        self.targets, self.watched = [Value.cast(target)], []
        self._schedule, self._seen = schedule, None if seen is None else Value.cast(seen)

    def drive(self, cycle, ctx):
        return (self._schedule(cycle) if self._seen is None else self._schedule(cycle, ctx.get(self._seen)),)

    def note(self, cycle):
        pass


class Watch:
    """The value of a signal in each cycle, as ``Watch[cycle]``."""

    def __init__(self, value):
        self.targets, self.watched = [], [Value.cast(value)]
        self.values = []

    def drive(self, _cycle, _ctx):
        return ()

    def note(self, _cycle, value):
        self.values.append(value)

    def __getitem__(self, cycle):
        return self.values[cycle]


class Bench:
    """A component in the simulator. Add parts, then ``run``; each run starts from reset, with new parts.

    A value in cycle n is what it is just before clock edge n, when what was set in that cycle has settled.
    """

    def __init__(self, dut, limit_s=60.0):
        self._simulator = Simulator(dut)
        self._simulator.add_clock(1e-6)
        self._simulator.add_testbench(self._testbench)
        self._limit_s = limit_s
        self._parts = []
        self._used = False

    def source(self, *args, **options) -> Source:
        return self._add(Source(*args, **options))

    def sink(self, *args, **options) -> Sink:
        return self._add(Sink(*args, **options))

    def drive(self, *args, **options) -> Drive:
        return self._add(Drive(*args, **options))

    def watch(self, value) -> Watch:
        return self._add(Watch(value))

    def run(self, cycles, until: Callable[[], bool] | None = None):
        """Run for ``cycles``; with ``until`` no longer than needed, and fail if that was not enough."""
        if self._used:
            self._simulator.reset()
        self._used = True
        self._cycles, self._until = cycles, until
        with self._waveform():
            self._simulator.run()
        self._parts = []

    def _waveform(self):
        """Of every signal, in a file for each run, where a folder is named to look into a failing test."""
        folder = os.environ.get("CONTACTFPGA_WAVES")
        if not folder:
            return contextlib.nullcontext()
        Path(folder).mkdir(parents=True, exist_ok=True)
        return self._simulator.write_vcd(str(Path(folder) / f"run-{next(NUMBERS)}.vcd"))

    def _add(self, part):
        self._parts.append(part)
        return part

    def _drive(self, ctx, cycle):
        values = [value for part in self._parts for value in part.drive(cycle, ctx)]
        if values != self._driven:
            self._driven = values
            word, offset = 0, 0
            for value, width in zip(values, self._widths):
                assert 0 <= value < 1 << width, f"{value} does not fit {width} bits at {offset} of {self._targets!r}"
                word |= value << offset
                offset += width
            ctx.set(self._targets, word)

    async def _testbench(self, ctx):
        targets = [target for part in self._parts for target in part.targets]
        # Amaranth computes a width each time that it is asked for.
        self._targets, self._widths = Cat(*targets), [len(target) for target in targets]
        self._driven = None
        watched = [value for part in self._parts for value in part.watched]
        deadline = time.process_time() + self._limit_s
        if targets:
            self._drive(ctx, 0)
        clock = ctx.tick().sample(*watched).__aiter__()
        try:
            for cycle in range(self._cycles):
                _, _, *values = await clock.__anext__()
                values = iter(values)
                for part in self._parts:
                    part.note(cycle, *(next(values) for _ in part.watched))
                if self._until is not None and self._until():
                    return
                assert cycle % 256 or time.process_time() < deadline, (
                    f"{cycle} cycles took over {self._limit_s} s of the processor"
                )
                if targets:
                    self._drive(ctx, cycle + 1)
        finally:
            await clock.aclose()
        assert self._until is None, f"not done after {self._cycles} cycles"
