"""Which mutants behave differently from the gateware as it should be."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim import golden
from contactfpga_sim.board import native
from contactfpga_sim.board.compiled import CompiledBoard
from contactfpga_sim.cosim import bench_native
from contactfpga_sim.cosim.compare import compare
from contactfpga_sim.mutants.stimuli import Stimulus
from contactfpga_sim.sheet.matrix import Contention

OBSERVED = (*golden.BOUNDARIES, "driven", "charged")
"""Where a mutant can be told from the gateware as it should be."""

_FIRST_LOOK = 512
"""Cycles before the first comparison; each further one comes after twice as many."""

Events = Mapping[str, np.ndarray]


def survivors(skin: Skin, model: native.Model, numbers: Iterable[int], stimuli: Iterable[Stimulus]) -> list[int]:
    """The mutants that no stimulus tells from the gateware as it should be."""
    left = list(numbers)
    with CompiledBoard(skin, OBSERVED, model) as board:
        for stimulus in stimuli:
            events = expected(board, stimulus)
            left = [number for number in left if killed_at(board, number, stimulus, events) is None]
    return left


def expected(board: CompiledBoard, stimulus: Stimulus) -> Events:
    """What the board without a mutant does, after it was compared with the golden model in every clock, unless lines
    are joined.

    Raises :class:`contactfpga_sim.cosim.compare.Mismatch` where they differ.
    """
    board.restart()
    _play(board, stimulus, stimulus.cycles)
    events = {name: board.take(name) for name in OBSERVED}
    if stimulus.shorts:
        return events
    trace = bench_native.trace(events, stimulus.cycles)
    compare(golden.predict(board.skin, stimulus.timeline, stimulus.cycles), trace)
    rows = [(int(event["cycle"]), int(event["data"])) for event in events["driven"]]
    if rows != golden.driven(board.skin, stimulus.timeline, stimulus.cycles):
        raise AssertionError("rows are not driven as docs/timing.md says")
    return events


def killed_at(board: CompiledBoard, number: int, stimulus: Stimulus, events: Events) -> str | None:
    """The first boundary at which mutant ``number`` does something other than ``events``, or "contention" where it
    drives lines against each other; None where it never does."""
    board.restart(number)
    while (start := board.cycle) < stimulus.cycles:
        until = min(max(_FIRST_LOOK, 2 * start), stimulus.cycles)
        try:
            _play(board, stimulus, until)
        except Contention:
            return "contention"
        for name in OBSERVED:
            first, last = np.searchsorted(events[name]["cycle"], (start, until))
            if not np.array_equal(board.take(name), events[name][first:last]):
                return name
    return None


def _play(board: CompiledBoard, stimulus: Stimulus, until: int) -> None:
    done = [(start, lambda cycles=cycles: board.pull_low(cycles)) for start, cycles in stimulus.noise]
    done += [(start, lambda shorts=shorts: board.join(shorts)) for start, shorts in stimulus.shorts]
    for start, do in done:
        if board.cycle <= start < until:
            bench_native.play(board, stimulus.timeline, start)
            do()
    bench_native.play(board, stimulus.timeline, until)
