"""Co-simulation through the compiled board."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.golden.trace import BOUNDARIES, Timeline, Trace


def run(skin: Skin, timeline: Timeline, cycles: int, model: native.Model | None = None) -> Trace:
    """Trace of the compiled board in cycles 0 to ``cycles`` - 1; ``model`` as in :class:`CompiledBoard`."""
    with CompiledBoard(skin, BOUNDARIES, model) as board:
        play(board, timeline, cycles)
        return trace({name: board.take(name) for name in BOUNDARIES}, cycles)


def play(board: CompiledBoard, timeline: Timeline, until: int) -> None:
    """Play the timeline to the board from its current cycle to cycle ``until`` - 1."""
    changes = {cycle: (cells, stuck) for cycle, cells, stuck in timeline.pieces}
    received, cuts, units = dict(timeline.received), dict(timeline.cuts), dict(timeline.units)
    for now in sorted(cycle for cycle in {*changes, *received, *cuts, *units} if board.cycle <= cycle < until):
        board.run(now - board.cycle)
        if now in changes:
            cells, stuck = changes[now]
            board.press(cells)
            board.stick(stuck)
        if now in cuts:
            board.cut(cuts[now].rows, cuts[now].columns)
        if now in units:
            board.load(units[now])
        if now in received:
            board.send(received[now])
    board.run(until - board.cycle)


def trace(events: Mapping[str, np.ndarray], cycles: int) -> Trace:
    """Trace of a board that ran ``cycles``, from its events (dtype ``EVENT``) by boundary."""
    result = Trace(cycles)
    for name in BOUNDARIES:
        columns = [events[name]["cycle"].tolist(), events[name]["data"].tolist()]
        if name in ("rows", "records", "items"):
            columns.append(events[name]["mark"].astype(bool).tolist())
        setattr(result, name, list(zip(*columns)))
    return result
