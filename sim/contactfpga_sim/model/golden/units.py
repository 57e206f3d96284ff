"""Pressure units: readings, packets and thresholds (docs/timing.md)."""

from __future__ import annotations

import bisect
import dataclasses
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from contactfpga.choices import converters
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.packet import Packet
from contactfpga_sim.model.golden.request import Request
from contactfpga_sim.model.golden.scan import Changes
from contactfpga_sim.model.golden.trace import Timeline

KIND, OVER, ARMED = 8, 1, 2
SET_ZERO, SET_THRESHOLD, SET_SUM_THRESHOLD = 3, 4, 5


class UnitSample(NamedTuple):
    """Reading of a unit."""

    sampled: int
    """Cycle in which the input was sampled."""
    done: int
    """Cycle in which the reading is available."""
    time_us: int
    """Time of the sweep's first reading."""


@dataclasses.dataclass(frozen=True)
class ConverterRule:
    """A converter that reads the units in turn. Times are in levels, half periods of its clock."""

    bits: int
    supplies: tuple[tuple[float, int], ...]
    """(V, Hz): maximum clock from that supply voltage on."""
    least_level_ns: int
    levels: int
    """Levels from one conversion to the next."""
    sampled: int
    """Levels from the selection to the sample."""
    last_bit: int
    """Levels from the selection to the edge that reads the last bit."""

    def level(self, facts: Facts) -> int:
        """Clocks per level of the SPI clock."""
        fastest = max(hz for volts, hz in self.supplies if volts <= facts.skin.converter_v)
        by_rate = Fraction(facts.skin.clock_hz, 2 * fastest)
        by_level = Fraction(self.least_level_ns * facts.skin.clock_hz, 10**9)
        return -(-max(by_rate, by_level) // 1)

    def spans(self, facts: Facts) -> tuple[int, int]:
        """Cycles from unit to unit, and from sweep to sweep."""
        between = self.levels * self.level(facts)
        return between, between * facts.skin.units

    def sweeps(self, facts: Facts, cycles: int) -> Iterator[list[UnitSample]]:
        """Sweeps that begin before ``cycles``."""
        level, begin = self.level(facts), self.first(facts)
        while begin < cycles:
            sweep = []
            for _ in range(facts.skin.units):
                sampled = begin + self.sampled * level
                sweep.append(UnitSample(sampled, begin + self.last_bit * level + 2, sampled // facts.clocks_per_us))
                begin += self.levels * level
            yield sweep

    def first(self, facts: Facts) -> int:
        """Cycle in which the first conversion selects the converter."""
        return 2 * self.level(facts) + 1


@dataclasses.dataclass(frozen=True)
class PacedRule:
    """A converter of all units at once, paced by a clock from the board."""

    bits: int
    least_level_ns: int
    pace_hz: int
    pace_level_ns: int
    periods: int
    """Periods of the pacing clock per conversion."""
    word_levels: int
    """Levels of the SPI clock per word; the first word is the converter's status."""

    def level(self, facts: Facts) -> int:
        return -(-self.least_level_ns * facts.skin.clock_hz // 10**9)

    def pace(self, facts: Facts) -> int:
        """Cycles per level of the pacing clock."""
        hz = facts.skin.clock_hz
        return max(-(-hz // (2 * self.pace_hz)), -(-self.pace_level_ns * hz // 10**9))

    def spans(self, facts: Facts) -> tuple[int, int]:
        return 0, 2 * self.periods * self.pace(facts)

    def sweeps(self, facts: Facts, cycles: int) -> Iterator[list[UnitSample]]:
        """Sweeps without the first two conversions; conversion n is of the input one and a half periods earlier."""
        whole, pace, level = self.spans(facts)[1], self.pace(facts), self.level(facts)
        late_us = round(1.5e6 * whole / facts.skin.clock_hz)
        ready = 3 * whole - pace
        while ready < cycles:
            time_us = (ready + 3) // facts.clocks_per_us - late_us
            sampled = ready - 3 * whole // 2
            yield [
                UnitSample(sampled, ready + 6 + (unit + 2) * self.word_levels * level, time_us)
                for unit in range(facts.skin.units)
            ]
            ready += whole


ADS131M08 = PacedRule(24, 40, 8_200_000, 49, periods=2048, word_levels=48)
MCP3208 = ConverterRule(12, ((2.7, 1_000_000), (5.0, 2_000_000)), 250, levels=40, sampled=12, last_bit=37)


@dataclasses.dataclass
class Units:
    """Results of the units in a run."""

    packets: list[tuple[int, bytes]] = dataclasses.field(default_factory=list)
    """(cycle from which it waits, packet) of every sweep, as on the wire."""
    over: Changes = dataclasses.field(default_factory=list)
    """(cycle, level): whether a threshold is exceeded."""
    armed: Changes = dataclasses.field(default_factory=list)
    """(cycle, level): whether a threshold is set."""


class _Settings:
    def __init__(self, facts: Facts, bits: int, requests: Sequence[Request]):
        skin = facts.skin
        largest = max((sum(map(abs, row)) for row in skin.unit_sums), default=0) * (2**bits - 1)
        counts = {SET_ZERO: skin.units, SET_THRESHOLD: skin.units, SET_SUM_THRESHOLD: len(skin.unit_sums)}
        widths = {SET_ZERO: bits, SET_THRESHOLD: bits, SET_SUM_THRESHOLD: largest.bit_length()}
        self._set: dict[tuple[int, int], list[tuple[int, int, bool]]] = {}
        for one in requests:
            what, value = one.command or (0, 0)
            place, number = value % 8, value // 8
            if place < counts.get(what, 0):
                width = widths[what]
                kept = number * 2 ** max(0, width - 18) % 2**width
                self._set.setdefault((what, place), []).append((one.cycle + 1, kept, number > 0))

    def at(self, what: int, place: int, cycle: int) -> tuple[int, bool]:
        given = self._set.get((what, place), [])
        index = bisect.bisect_right(given, cycle, key=lambda one: one[0])
        return given[index - 1][1:] if index else (0, False)

    def reached(self, what: int, place: int, cycle: int, amount: int) -> bool:
        threshold, is_set = self.at(what, place, cycle)
        return is_set and amount >= threshold

    def armed(self) -> Changes:
        marks = sorted(
            (cycle, key, is_set) for key, given in self._set.items() if key[0] != SET_ZERO for cycle, _, is_set in given
        )
        now: set[tuple[int, int]] = set()
        changes: Changes = []
        for cycle, key, is_set in marks:
            (now.add if is_set else now.discard)(key)
            if bool(now) != bool(changes and changes[-1][1]):
                changes.append((cycle, int(bool(now))))
        return changes


def play(facts: Facts, timeline: Timeline, requests: Sequence[Request], cycles: int) -> Units:
    """Results in cycles 0 to ``cycles`` - 1, and beyond."""
    skin = facts.skin
    if not skin.units:
        return Units()
    rule: ConverterRule | PacedRule = converters.find(skin.converter).load_golden()
    settings = _Settings(facts, rule.bits, requests)
    found = Units(armed=settings.armed())
    hits: dict[tuple[int, int], bool] = {}
    for sequence, sweep in enumerate(rule.sweeps(facts, cycles)):
        readings, deviations = [], []
        for unit, (sampled, done, _) in enumerate(sweep):
            readings.append(timeline.units_at(sampled, unit))
            deviations.append(readings[-1] - settings.at(SET_ZERO, unit, done)[0])
            hits[SET_THRESHOLD, unit] = settings.reached(SET_THRESHOLD, unit, done + 1, abs(deviations[-1]))
            _note(found.over, done + 2, hits)
        for place, weights in enumerate(skin.unit_sums):
            total = sum(weight * deviation for weight, deviation in zip(weights, deviations, strict=True))
            hits[SET_SUM_THRESHOLD, place] = settings.reached(SET_SUM_THRESHOLD, place, done + 3 + place, abs(total))
            _note(found.over, done + 4 + place, hits)
        reported = done + -(-rule.bits // 7) + 6
        over, armed = (bool(_level(changes, reported)) for changes in (found.over, found.armed))
        packet = _packet(facts, rule.bits, readings, sweep[0].time_us, sequence, over, armed)
        found.packets.append((reported + 1, packet))
    return found


def _packet(
    facts: Facts, bits: int, readings: list[int], time_us: int, sequence: int, over: bool, armed: bool
) -> bytes:
    plain = [128 + reading // 128**place % 128 for reading in readings for place in range(-(-bits // 7))]
    trailer = time_us % 2**24 + sequence % 256 * 2**24
    plain += [128 + trailer // 128**place % 128 for place in range(5)]
    packet = Packet()
    packet.push(bytes([*plain, KIND * 16 + OVER * over + ARMED * armed]))
    return packet.wire(before=facts.fingerprint[:2])


def _note(changes: Changes, cycle: int, hits: dict[tuple[int, int], bool]) -> None:
    level = int(any(hits.values()))
    if level != (changes[-1][1] if changes else 0):
        changes.append((cycle, level))


def _level(changes: Changes, cycle: int) -> int:
    index = bisect.bisect_right(changes, cycle, key=lambda change: change[0]) - 1
    return changes[index][1] if index >= 0 else 0
