"""One flip, followed until its end, at most half a second."""

from __future__ import annotations

import contextlib
import copy
import itertools
from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np

from contactfpga_sim.lab.flips import touches
from contactfpga_sim.lab.flips.reference import AFTER_S, FIRST_S, LAST_S, DeliveredFrame, Listener, Reference
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.state import Bit, Storage
from contactfpga_sim.model.sheet.matrix import Contention

SETTLED_STEPS = 4
"""Steps heard after the board has recovered."""
QUIET_S = {"always": 0.02, "on_change": 0.12}
"""Longest unreported silence: frames or keep-alives come earlier."""
COUNTED = ("lost", "unexplained", "restarts", "foreign_skin", "foreign_version", "skin_changes", "unknown_kinds")
"""Driver counters that stay 0 on a good line."""

Outcome = Literal["masked", "told", "silent"]


class Flip(NamedTuple):
    bit: Bit
    cycle: int


class FlipOutcome(NamedTuple):
    name: str
    memory: bool
    outcome: Outcome
    kind: str
    """The error, or the means that reports it."""
    frames: int
    seconds: float
    """Time from the first silently wrong frame to the next right one."""
    gone_s: float
    """Time of full recovery; infinite if later than the study."""
    fights: int = 0
    """Clocks in which a column was driven against a row."""


def drawn(reference: Reference, memory: bool, count: int, seed: int) -> list[Flip]:
    """Random flips, uniform over clocks and all register, or memory, bits."""
    rng = np.random.default_rng([seed, memory])
    places = reference.board.places
    bits = np.array([place.bits * (place.memory == memory) for place in places])
    ends = np.cumsum(bits)
    first, last = (round(time * reference.skin.clock_hz) for time in (FIRST_S, LAST_S))
    flips = []
    for number, cycle in zip(rng.integers(0, ends[-1], count), rng.integers(first, last, count)):
        index = int(np.searchsorted(ends, number, "right"))
        word, bit = divmod(int(number - ends[index] + bits[index]), places[index].width)
        flips.append(Flip(Bit(index, word, bit), int(cycle)))
    return flips


def follow(reference: Reference, flip: Flip) -> FlipOutcome:
    """Flip a bit and judge the outcome."""
    before = reference.board.fights
    listener, heard, gone_s = _run(reference, flip)
    return _judged(reference, flip, listener, heard, gone_s)._replace(fights=reference.board.fights - before)


def _judged(
    reference: Reference, flip: Flip, listener: Listener, heard: list[DeliveredFrame], gone_s: float
) -> FlipOutcome:
    place = reference.board.places[flip.bit.place]
    begun_s = flip.cycle / reference.skin.clock_hz
    told = _told(reference, listener, heard, gone_s, begun_s)
    wrong = _wrong(reference, heard)
    silent = [(one, kind) for one, kind in wrong if not one.flagged]
    if silent:
        return _silent(place, heard, silent, gone_s)
    flags = [kind for one, kind in wrong if one.flagged]
    kind = told or ("flag" if flags or any(one.flagged for one in heard) else "")
    return FlipOutcome(place.name, place.memory, "told" if kind else "masked", kind, 0, 0.0, gone_s)


def _silent(
    place: Storage, heard: list[DeliveredFrame], silent: list[tuple[DeliveredFrame, str]], gone_s: float
) -> FlipOutcome:
    first, last = silent[0][0].time_s, silent[-1][0].time_s
    after = [one.time_s for one in heard if one.time_s > last]
    until = after[0] if after else last
    kinds = sorted({kind for _, kind in silent})
    frames = sum(kind != "stale" for _, kind in silent)
    return FlipOutcome(place.name, place.memory, "silent", ", ".join(kinds), frames, until - first, gone_s)


def _run(reference: Reference, flip: Flip) -> tuple[Listener, list[DeliveredFrame], float]:
    board, skin, clocks = reference.board, reference.skin, reference.step_clocks
    number = flip.cycle // clocks
    board.go_to(reference.steps[number].moment)
    board.press(reference.sheets[number])
    _advance(board, flip.cycle - board.cycle)
    board.flip(flip.bit)
    listener, heard, gone_s = copy.deepcopy(reference.steps[number].listener), [], float("inf")
    last = number + round(AFTER_S / touches.STEP_S)
    _advance(board, (number + 1) * clocks - flip.cycle)
    for step in range(number + 1, last + 1):
        heard += listener.hear(board.take("received"), skin.clock_hz)
        if board.same(reference.steps[step].moment):
            gone_s = (step * clocks - flip.cycle) / skin.clock_hz
            for following in reference.steps[step : min(step + SETTLED_STEPS, last)]:
                heard += listener.hear(following.events, skin.clock_hz)
            break
        board.press(reference.sheets[step])
        _advance(board, clocks)
    else:
        heard += listener.hear(board.take("received"), skin.clock_hz)
    return listener, [one for one in heard if one.time_s > flip.cycle / skin.clock_hz], gone_s


def _advance(board: CompiledBoard, clocks: int) -> None:
    with contextlib.suppress(Contention):
        board.run(clocks)


def _told(reference: Reference, listener: Listener, heard: list[DeliveredFrame], gone_s: float, begun_s: float) -> str:
    stats = listener.conversation.stats
    if listener.surprises:
        return "another Skin"
    for name in COUNTED:
        if getattr(stats, name):
            return name
    if stats.damaged.total():
        return "damaged"
    times = [begun_s, *(one.time_s for one in heard)]
    if gone_s == float("inf"):
        times.append(begun_s + AFTER_S)
    return "silence" if max(np.diff(times), default=0.0) > QUIET_S[reference.skin.send] else ""


def _wrong(reference: Reference, heard: list[DeliveredFrame]) -> list[tuple[DeliveredFrame, str]]:
    """Frames with a wrong sheet or time, and moments of outdated ones."""
    found = [(one, kind) for one in _since_restart(reference, heard) if (kind := _kind(reference, one))]
    if reference.skin.send == "on_change":
        found += ((one, "stale") for one in _stale(reference, heard))
    return sorted(found, key=lambda pair: pair[0].time_s)


def _since_restart(reference: Reference, heard: Sequence[DeliveredFrame]) -> Iterator[DeliveredFrame]:
    begun: dict[int, float] = {0: 0.0}
    for one in heard:
        shift = begun.setdefault(one.restarts, one.late_s - sum(reference.late_s) / 2)
        yield one._replace(late_s=one.late_s - shift)


def _kind(reference: Reference, one: DeliveredFrame) -> str:
    early, late = reference.late_s[0] - reference.slack_s, reference.late_s[1] + reference.slack_s
    first = max(0, int((one.time_s - late) / touches.STEP_S))
    if not reference.truth.holds(one.said, first, int(one.time_s / touches.STEP_S)):
        return "zones"
    return "" if early <= one.late_s <= late else "time"


def _stale(reference: Reference, heard: Sequence[DeliveredFrame]) -> Iterator[DeliveredFrame]:
    """Moments of sheet changes that the host learns too late."""
    late = reference.late_s[1] + reference.slack_s
    for before, after in itertools.pairwise(heard):
        if after.time_s - before.time_s > QUIET_S["on_change"]:
            continue  # told
        first, last = (int((one.time_s - shift) / touches.STEP_S) for one, shift in ((before, 0.0), (after, late)))
        for step in range(first + 1, last + 1):
            if reference.truth.still[step] != before.said:
                yield before._replace(time_s=step * touches.STEP_S + late, flagged=before.flagged)
                break
