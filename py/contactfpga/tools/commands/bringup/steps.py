"""The steps of a first power-up."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from contactfpga.driver import health
from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.errors import ReadTimeout
from contactfpga.instruments.bounce import Bounce
from contactfpga.instruments.self_test import LineFinding, untried
from contactfpga.instruments.watch import Watch, named, places
from contactfpga.skin import Skin
from contactfpga.tools.commands import doctor
from contactfpga.tools.commands.bringup import film, times
from contactfpga.tools.commands.bringup.bench import Bench, Step
from contactfpga.tools.console import interrupt
from contactfpga.wire.faults import UNPLUGGED
from contactfpga.zones.zone import Zones

READS = 50
MOST_LOST = 0.1
RULER = "Press a ruler's edge along each column, one after the other, half a second each."
WATCHED_S = 0.1
"""Least time in s for the untouched sheet."""


# ---- nothing touches


def link(bench: Bench) -> Step:
    """Supply and link: hello, frames, losses, and response time."""
    board = bench.board
    bench.person.asked("nothing", "Touch nothing, and let nothing lie on the sheet.")
    found = [*health.hello(board), *_counted(bench)]
    stats = board.stats
    share = stats.lost / max(1, stats.frames + stats.lost)
    measured = {"lost_share": share}
    try:
        answers_ms = 1e3 * np.array([_answer_s(bench) for _ in range(READS)])
    except ReadTimeout as error:
        found.append(Finding("fault", f"an answer did not come: {error}"))
    else:
        median, slowest = (float(np.quantile(answers_ms, part, method="inverted_cdf")) for part in (0.5, 0.99))
        found.append(Finding("ok", f"an answer takes {median:.2f} ms in half of the cases, {slowest:.2f} ms in 99 %"))
        measured |= {"answer_ms": median, "answer_99_ms": slowest}
    stop = ""
    if share > MOST_LOST:
        stop = f"{100 * share:.0f} % of the frames are lost; mend the link first: baud, cable, ground, USB hub"
    return Step("supply and link", tuple(found), measured, stop)


def _counted(bench: Bench) -> Iterator[Finding]:
    """Findings without line faults, which have their own step."""
    lines = {finding.sentence for finding in health.lines(bench.board, bench.board.next(bench.timeout))}
    for finding in health.count(bench.board, bench.seconds, bench.timeout):
        is_line = any(finding.sentence.startswith(f"{name}: ") for name in _faults(bench.board))
        if finding.sentence not in lines and not is_line and "flagged 'fault'" not in finding.sentence:
            yield finding


def _answer_s(bench: Bench) -> float:
    begun = bench.board.clock()
    bench.board.read(bench.timeout)
    return bench.board.clock() - begun


def _faults(board: Board) -> tuple[str, ...]:
    return board.faults.names if board.faults else ()


def lines(bench: Bench) -> Step:
    """Lines of the untouched sheet: guard lines, self-test, and pressed cells."""
    board, skin = bench.board, bench.skin
    pressed, zones = np.ones((skin.rows, skin.columns), bool), board.next(bench.timeout)
    first_us = zones.time_us
    while zones.time_us - first_us < 1e6 * max(WATCHED_S, bench.seconds):
        zones = board.next(bench.timeout)
        if zones.cells is not None:
            pressed &= zones.cells
    found = [finding for finding in health.lines(board, zones) if finding.verdict == "fault"]
    stop = ""
    if UNPLUGGED in _faults(board):
        stop = "no line answers at all: look at the sheet's supply, its connectors and the order of its cables"
    if zones.cells is not None and (stuck := places(pressed)):
        if 2 * len(stuck) > skin.rows * skin.columns:
            stop = f"{len(stuck)} switches read pressed though nothing touches: look at pulls, supply and diodes"
        cause = "stuck, a short circuit, or something lies there"
        found.append(Finding("fault", f"{named(stuck)} pressed though nothing touches: {cause}"))
    if skin.self_test:
        tested = board.self_test(max(2.0, bench.timeout))
        found += map(doctor.tested, tested.findings)
        if tested.faults:
            stop = "lines are joined, so pins would drive against each other once a switch closes; mend that first"
    if not found:
        how = " and ".join([*["guard lines"] * skin.guard, *["self-test"] * skin.self_test])
        found.append(Finding("ok", f"no line is open, stuck or joined, by {how}" if how else "nothing reads pressed"))
    if not skin.guard:
        found.append(Finding("note", "the Skin has no guard lines, so open lines show once they are touched"))
    return Step("lines", tuple(found), stop=stop)


# ---- a finger, a ruler


def switches(bench: Bench) -> Step:
    """A finger over all switches: stuck, dead and loose ones, and lines that read alike."""
    person, skin = bench.person, bench.skin
    seconds = person.asked("finger", "Press every switch with a fingertip, one row after the other.")
    watch, alike = Watch(skin, stuck_s=person.stuck_s), _Alike()
    found: list[Finding] = []

    def take(zones: Zones) -> None:
        found.extend(doctor.suspected(one) for one in watch.update(zones))
        alike.take(zones)

    _follow(bench, take, seconds, lambda: not watch.never)
    found = [finding for finding in found if finding.verdict == "fault"]
    seen, never = watch.seen, watch.never
    assert seen is not None
    if not seen.any():
        none = Finding("fault", "no switch read pressed; was the sheet touched?")
        return Step("switches", (none,), stop="nothing reads pressed: look at the connectors, and run this again")
    if never:
        cause = "not touched, or a broken line or switch, a missing or reversed diode"
        found.append(Finding("fault", f"{doctor.dark(seen, never)} never read pressed: {cause}"))
    found += (Finding("fault", sentence) for sentence in alike.sentences())
    if not found:
        found = [Finding("ok", "every switch reads pressed and released, each by itself")]
    return Step("switches", tuple(found), {"switches_seen": float(seen.sum())})


class _Alike:
    """Lines that always read like another, in frames equal to the one before: a switch that moves during a scan would
    show in one line first.
    """

    def __init__(self) -> None:
        self._last: np.ndarray | None = None
        self._rests = False
        self._differ: list[np.ndarray] | None = None
        self._seen: list[np.ndarray] | None = None

    def take(self, zones: Zones) -> None:
        assert zones.cells is not None
        before, rested = self._last, self._rests
        self._last = zones.cells
        self._rests = before is not None and bool((zones.cells == before).all())
        if rested or not self._rests:
            return
        ways = (zones.cells, zones.cells.T)
        differ = [np.asarray((lines[:, None] != lines[None]).any(axis=2)) for lines in ways]
        seen = [np.asarray(lines.any(axis=1)) for lines in ways]
        self._differ = [before | now for before, now in zip(self._differ or differ, differ, strict=True)]
        self._seen = [before | now for before, now in zip(self._seen or seen, seen, strict=True)]

    def sentences(self) -> Iterator[str]:
        for name, differ, seen in zip(("rows", "columns"), self._differ or (), self._seen or ()):
            same = np.triu(~differ & seen[:, None] & seen[None], 1)
            for one, other in np.argwhere(same).tolist():
                yield f"{name} {one} and {other} always read alike: joined, by solder or a short circuit"


def diodes(bench: Bench) -> Step:
    """The self-test with pressed switches, which shows bridged diodes."""
    seconds = bench.person.asked("ruler", RULER)
    last = bench.board.self_test(max(2.0, bench.timeout))
    known: dict[LineFinding, None] = dict.fromkeys(last.findings)
    pressed = last.pressed
    until_s = bench.board.clock() + seconds
    with interrupt.usual_end():
        while bench.board.clock() < until_s and untried(last, pressed):
            last = bench.board.self_test(max(2.0, bench.timeout))
            pressed |= last.pressed
            known |= dict.fromkeys(last.findings)
    found = [doctor.tested(finding) for finding in known]
    if left := untried(last, pressed):
        found.append(
            Finding("note", f"{left} switches were not pressed in a self-test, so their diodes are not tested")
        )
    elif not found:
        found.append(Finding("ok", "no diode is bridged"))
    faulty = any(finding.verdict == "fault" for finding in found)
    stop = (
        "a diode is bridged or lines are joined: pins may drive against each other; mend that first" if faulty else ""
    )
    return Step("diodes", tuple(found), stop=stop)


def bounce(bench: Bench) -> Step:
    """Bounce times of switches, pressed column by column."""
    seconds = bench.person.asked("ruler", RULER)
    seen = Bounce(bench.board.hello.send == "on_change")
    _follow(bench, seen.update, seconds, lambda: len(seen.longest()) == bench.skin.rows * bench.skin.columns)
    seen.finish()
    found: list[Finding] = []
    if not seen.bounced:
        found.append(Finding("note", "no press was seen to its end; hold each column for half a second"))
        return Step("bounce", tuple(found))
    press_us, release_us = (float(max(seen.times_us(way), default=0)) for way in (True, False))
    for cell, us in seen.slow().items():
        found.append(
            Finding("fault", f"{named([cell])} bounces for {us / 1000:.2f} ms, far longer than others: replace")
        )
    proposal = seen.proposal()
    within = f"press within {press_us / 1000:.2f} ms, release within {release_us / 1000:.2f} ms"
    advice = (
        "no debounce is needed"
        if proposal is None
        else f"a debounce that hides it: {', '.join(proposal.lines.splitlines())}"
    )
    found.append(Finding("ok", f"{len(seen.longest())} switches {within}; {advice}"))
    return Step("bounce", tuple(found), {"press_us": press_us, "release_us": release_us})


def _follow(bench: Bench, take: Callable[[Zones], None], seconds: float, whole: Callable[[], bool]) -> None:
    zones = bench.board.latest(bench.timeout)
    first_us = rest_us = zones.time_us
    with interrupt.usual_end():
        while zones.time_us - first_us < 1e6 * seconds:
            take(zones)
            if zones.pressed or not whole():
                rest_us = zones.time_us
            if zones.time_us - rest_us > 1e6 * bench.person.rest_s:
                return
            zones = bench.board.next(bench.timeout)


# ---- which


def steps_for(skin: Skin) -> list[Callable[[Bench], Step]]:
    if skin.report != "cells":
        return [link, lines]
    if skin.ruler:
        return [link, lines, switches, film.film]
    return [link, lines, switches, *[diodes] * skin.self_test, bounce, times.settling, times.circuit]


def run(bench: Bench) -> Iterator[Step]:
    """The steps up to the last, or up to one that makes others pointless."""
    for step in steps_for(bench.skin):
        done = step(bench)
        yield done
        if done.stop:
            return
