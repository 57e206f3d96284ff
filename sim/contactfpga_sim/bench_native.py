"""Co-simulation through the compiled board: the same events as the golden model predicts."""

from __future__ import annotations

from contactfpga.skin import Skin
from contactfpga_sim.board import Board
from contactfpga_sim.golden.trace import BOUNDARIES, Timeline, Trace


def run(skin: Skin, timeline: Timeline, cycles: int) -> Trace:
    """What the compiled board does in cycles 0 to ``cycles`` - 1."""
    with Board(skin, BOUNDARIES) as board:
        changes = {cycle: (cells, stuck) for cycle, cells, stuck in timeline.pieces}
        requests = set(timeline.requests)
        moments = sorted(cycle for cycle in {*changes, *requests} if cycle < cycles)
        for now, until in zip(moments, [*moments[1:], cycles]):
            board.run(now - board.cycle)
            if now in changes:
                cells, stuck = changes[now]
                board.press(cells)
                board.stick(stuck)
            if now in requests:
                board.send(b"\x01")
            board.run(until - now)
        board.run(cycles - board.cycle)
        trace = Trace(cycles)
        for name in BOUNDARIES:
            events = board.take(name)
            columns = [events["cycle"].tolist(), events["data"].tolist()]
            if name in ("rows", "records"):
                columns.append(events["mark"].astype(bool).tolist())
            setattr(trace, name, list(zip(*columns)))
    return trace
