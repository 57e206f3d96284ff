"""Random mutants of the gateware, and which of them the comparison with the golden model detects.

Survivors of short stimuli go through proofs of equivalence and longer stimuli in turn.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from contactfpga.skin.several import Several
from contactfpga_sim.model import golden
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.compiled import CompiledBoard, CompiledSheets
from contactfpga_sim.model.golden.predict import predict_several
from contactfpga_sim.model.sheet.matrix import Contention
from contactfpga_sim.verify.cosim import bench_native
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.mutants import netlist, proof, sheets, stimuli
from contactfpga_sim.verify.mutants.netlist import STAGES, Design, Mutant
from contactfpga_sim.verify.mutants.skins import OPTIONS, SEVERAL, SKINS
from contactfpga_sim.verify.mutants.stimuli import Stimulus

OBSERVED = (*golden.BOUNDARIES, "driven", "charged")
"""Boundaries at which a mutant can differ."""
SHARED = ("line", "contact")
"""Boundaries at which a mutant of several sheets can differ."""

_FIRST_LOOK = 512
"""Cycles before the first comparison; each further one doubles them."""

Events = Mapping[str, np.ndarray]


def survivors(
    design: Design, model: native.Model, numbers: Iterable[int], stimuli: Iterable[Stimulus], until: float = math.inf
) -> list[int]:
    """Mutants that no stimulus, begun before ``until``, tells from the gateware."""
    left = list(numbers)
    with _board(design, model) as board:
        for stimulus in stimuli:
            if time.monotonic() >= until:
                break
            events = expected(board, stimulus)
            left = [number for number in left if killed_at(board, number, stimulus, events) is None]
    return left


def expected(board: CompiledBoard | CompiledSheets, stimulus: Stimulus) -> Events:
    """Events of the board without a mutant, compared with the golden model in every clock unless lines are joined.

    Raises :class:`contactfpga_sim.verify.cosim.compare.Mismatch`.
    """
    board.restart()
    _play(board, stimulus, stimulus.cycles)
    events = {name: board.take(name) for name in _observed(board)}
    if stimulus.shorts:
        return events
    if isinstance(board, CompiledSheets):
        _compare_shared(board.several, stimulus, events)
        return events
    trace = bench_native.trace(events, stimulus.cycles)
    compare(golden.predict(board.skin, stimulus.timeline, stimulus.cycles), trace)
    rows = [(int(event["cycle"]), int(event["data"])) for event in events["driven"]]
    if rows != golden.driven(board.skin, stimulus.timeline, stimulus.cycles):
        raise AssertionError("rows are not driven as docs/timing.md says")
    return events


def _board(design: Design, model: native.Model) -> CompiledBoard | CompiledSheets:
    return CompiledSheets(design, model) if isinstance(design, Several) else CompiledBoard(design, OBSERVED, model)


def _observed(board: CompiledBoard | CompiledSheets) -> tuple[str, ...]:
    return SHARED if isinstance(board, CompiledSheets) else OBSERVED


def _compare_shared(several: Several, stimulus: Stimulus, events: Events) -> None:
    predicted = predict_several(several.skins, [stimulus.timeline, *stimulus.others], stimulus.cycles)[0]
    wanted, got = golden.Trace(stimulus.cycles), golden.Trace(stimulus.cycles)
    for name in SHARED:
        setattr(wanted, name, getattr(predicted, name))
        setattr(got, name, [(int(event["cycle"]), int(event["data"])) for event in events[name]])
    compare(wanted, got)


def killed_at(board: CompiledBoard | CompiledSheets, number: int, stimulus: Stimulus, events: Events) -> str | None:
    """The first boundary at which a mutant differs from ``events``, "contention" if it drives lines against each other,
    or None."""
    board.restart(number)
    while (start := board.cycle) < stimulus.cycles:
        until = min(max(_FIRST_LOOK, 2 * start), stimulus.cycles)
        try:
            _play(board, stimulus, until)
        except Contention:
            return "contention"
        for name in _observed(board):
            first, last = np.searchsorted(events[name]["cycle"], (start, until))
            if not np.array_equal(board.take(name), events[name][first:last]):
                return name
    return None


def _play(board: CompiledBoard | CompiledSheets, stimulus: Stimulus, until: int) -> None:
    if isinstance(board, CompiledSheets):
        _play_sheets(board, [stimulus.timeline, *stimulus.others], until)
        return
    done = [(start, lambda cycles=cycles: board.pull_low(cycles)) for start, cycles in stimulus.noise]
    done += [(start, lambda shorts=shorts: board.join(shorts)) for start, shorts in stimulus.shorts]
    for start, do in done:
        if board.cycle <= start < until:
            bench_native.play(board, stimulus.timeline, start)
            do()
    bench_native.play(board, stimulus.timeline, until)


def _play_sheets(board: CompiledSheets, timelines: Sequence[golden.Timeline], until: int) -> None:
    received = dict(timelines[0].received)
    pressed: dict[int, list[tuple[int, np.ndarray]]] = {}
    for number, timeline in enumerate(timelines):
        for cycle, cells, _ in timeline.pieces:
            pressed.setdefault(cycle, []).append((number, cells))
    for now in sorted(cycle for cycle in {*received, *pressed} if board.cycle <= cycle < until):
        board.run(now - board.cycle)
        for number, cells in pressed.get(now, ()):
            board.press(number, cells)
        if now in received:
            board.send(received[now])
    board.run(until - board.cycle)


BATCH = 500
"""Mutants per board, as more slow it down."""

CHECKED = 2
"""Killed mutants of each Skin that the prover must not prove equivalent."""


@dataclasses.dataclass(frozen=True)
class Result:
    """Fate of a mutant: ``killed``, ``equivalent``, ``alive``, or ``open`` if time was up."""

    skin: str
    mutant: Mutant
    fate: str


def chosen(name: str) -> tuple[Design, tuple[str, ...]]:
    """Skin or sheets of this name, and the stages to mutate."""
    if name in SKINS:
        return SKINS[name], tuple(STAGES)
    return SEVERAL[name] if name in SEVERAL else OPTIONS[name]


def left_by(
    design: Design, mutants: Sequence[Mutant], stimuli: Iterable[Stimulus], until: float = math.inf
) -> list[Mutant]:
    """Mutants that agree with the golden model under every stimulus begun before ``until``, a
    :func:`time.monotonic`."""
    given = list(itertools.takewhile(lambda _: time.monotonic() < until, stimuli))
    left: list[Mutant] = []
    for start in range(0, len(mutants), BATCH):
        batch = mutants[start : start + BATCH]
        model = netlist.model(design, batch)
        left += [batch[n - 1] for n in survivors(design, model, range(1, len(batch) + 1), given, until)]
    return left


def examine(
    name: str,
    count: int,
    seed: int,
    long_s: int = proof.LONG_S,
    say: Callable[[str], None] = lambda _: None,
    budget_s: float = math.inf,
) -> list[Result]:
    """Fates of ``count`` mutants of what is :func:`chosen`; ``long_s``: seconds of a longer proof. No proof and no long
    stimulus begins after ``budget_s`` seconds.

    Raises :class:`contactfpga_sim.verify.mutants.proof.Contradiction` if a killed mutant is proved equivalent.
    """
    until = time.monotonic() + budget_s
    design, stages = chosen(name)
    given = sheets if isinstance(design, Several) else stimuli
    say("draw")
    drawn = netlist.draw([mutant for mutant in netlist.candidates(design) if mutant.stage in stages], count, seed)
    say(f"{len(drawn)} mutants, short stimuli")
    left = left_by(design, drawn, given.quick(design))
    say(f"{len(left)} left, proofs")
    killed = [mutant for mutant in drawn if mutant not in left][:CHECKED]
    proved = _proved(design, [*left, *killed], proof.QUICK_S, until)
    if wrong := proved & {*killed}:
        raise proof.Contradiction(f"killed, yet proved equivalent: {', '.join(map(str, wrong))}")
    left = [mutant for mutant in left if mutant not in proved]
    say(f"{len(left)} left, long stimuli")
    if time.monotonic() < until:
        longest = [stimuli.until_time_wraps(SKINS[name])] if name in SKINS else []  # minutes in the model of an option
        left = left_by(design, left, itertools.chain(given.thorough(design), longest), until)
    say(f"{len(left)} left, longer proofs")
    proved |= _proved(design, left, long_s, until)
    rest = "alive" if time.monotonic() < until else "open"
    fates = {mutant: "equivalent" if mutant in proved else rest for mutant in (*left, *proved)}
    say(f"{len({*left} - proved)} {rest}")
    return [Result(name, mutant, fates.get(mutant, "killed")) for mutant in drawn]


def _proved(design: Design, mutants: Sequence[Mutant], limit_s: int, until: float) -> set[Mutant]:
    found = proof.equivalent(design, mutants, limit_s, until=until)
    return {mutant for mutant, same in zip(mutants, found) if same}
