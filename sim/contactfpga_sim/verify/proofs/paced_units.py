"""Pressure units: a converter with a pace of its own is driven as its data sheet wants it, and read rightly."""

from functools import partial

from amaranth.hdl import Cat, Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga_hdl.units.ads131m08 import BITS, CLOCKS, LEVELS, Ads131m08
from contactfpga_sim.verify.proofs.bugs import Bug
from contactfpga_sim.verify.proofs.case import Case
from contactfpga_sim.verify.proofs.proof import Proof

_SLOW = Skin(units=2, converter="ads131m08", clock_hz=1_000_000, baud=250_000, settle_us=100)
_FAST = Skin(units=3, converter="ads131m08", clock_hz=48_000_000, baud=12_000_000)


def frames(proof: Proof, skin: Skin) -> None:
    """Free: what the converter answers, and when a conversion is ready.

    Claimed: the converter's own clock has no level that is shorter than it has to be, nor has the SPI clock, nor the
    pause between selection and clock. The SPI clock runs while the converter is selected, and each selection has 240
    clocks. A reading is what the pin was in the clocks before the last 24 falling edges, with its highest bit turned
    over, and is there three clocks after the last one.
    """
    m = proof.m
    dut = Ads131m08(skin)
    inside = proof.put(dut)
    miso = proof.free(1, "miso")
    m.d.comb += [dut.pins.spi_miso.eq(miso), dut.pins.spi_ready_n.eq(proof.free(1, "ready_n"))]
    clock, select_n, pace = dut.pins.spi_clock, dut.pins.spi_select_n, dut.pins.spi_pace
    least, paces = dut.level_clocks, dut.pace_clocks
    before = {"clock": proof.before(clock), "select": proof.before(select_n, init=1), "pace": proof.before(pace)}
    now = {"clock": clock, "select": select_n, "pace": pace}
    most = 2 * max(least, paces)
    since = {name: Signal(range(most + 1), name=f"since_{name}", init=most) for name in now}
    changed = {name: now[name] != before[name] for name in now}
    for name, count in since.items():
        m.d.sync += count.eq(Mux(changed[name], 1, Mux(count == most, count, count + 1)))
    edges = Signal(range(CLOCKS + 1), name="edges")  # rising ones since the selection
    rises, falls = clock & ~before["clock"], ~clock & before["clock"]
    with m.If(changed["select"]):
        m.d.sync += edges.eq(0)
        proof.claim(~clock & ~before["clock"])
        proof.claim(~select_n | (edges == CLOCKS))
    with m.Elif(rises):
        m.d.sync += edges.eq(edges + 1)
        proof.claim(~select_n & (edges < CLOCKS) & (since["select"] >= least))
    with m.If(changed["clock"]):
        proof.claim(since["clock"] >= least)
    with m.If(changed["pace"]):
        proof.claim(since["pace"] >= paces)
    _readings(proof, dut, falls, miso)
    _tie(proof, inside, dut, edges, since)


def _readings(proof: Proof, dut: Ads131m08, falls: Value, miso: Value) -> None:
    taken = Signal(BITS, name="taken")
    with proof.m.If(falls):
        proof.m.d.sync += taken.eq(Cat(proof.before(miso), taken))
    expected = proof.before(taken)
    raw = Cat(dut.reading.value[:-1], ~dut.reading.value[-1])
    proof.lemma(raw == expected)
    with proof.m.If(dut.done):
        proof.claim(proof.before(proof.before(falls)))
        proof.claim(dut.reading.value == Cat(expected[:-1], ~expected[-1]))
        proof.claim(dut.reading.unit < dut.skin.units)


def _tie(proof: Proof, inside, dut: Ads131m08, edges: Value, since: dict[str, Signal]) -> None:
    """What is watched from outside, by the counters inside, to which the pins are a clock late."""
    least, paces = dut.level_clocks, dut.pace_clocks
    level, clock, busy, count = inside["level"], inside["clock"], inside["busy"], inside["count"]
    late, phase, was_busy = proof.before(level), proof.before(clock), proof.before(busy)
    last = LEVELS - 1
    ends = phase == least - 1
    proof.lemma((level < LEVELS) & (clock < least) & (count < paces) & (late < LEVELS) & (phase < least))
    proof.lemma(busy | (level == 0) & (clock == 0))
    proof.lemma(was_busy | (late == 0) & (phase == 0))
    follows = (clock == Mux(ends, 0, phase + 1)) & (level == Mux(ends, Mux(late == last, 0, late + 1), late))
    proof.lemma(~was_busy | follows & (busy | (ends & (late == last))))
    proof.lemma(was_busy | (level == 0) & (clock == 0))
    resting = ~was_busy | (late == last)
    proof.lemma(dut.pins.spi_select_n == resting)
    proof.lemma(dut.pins.spi_clock == (was_busy & late[0] & (late < 2 * CLOCKS)))
    starts = late == 0
    in_frame = was_busy & ~starts & (late != last)
    counted = (late + (late[0] & (phase != 0))) >> 1
    ended = Mux(phase == 0, CLOCKS, 0)
    proof.lemma(Mux(in_frame, edges == counted, Mux(was_busy & (late == last), edges == ended, 1)))
    proof.lemma(Mux(was_busy & (late == last) | ~resting & starts, 1, in_frame | (edges == 0)))
    proof.lemma(~(was_busy & starts & (phase != 0)) | (edges == 0))
    proof.lemma(~(was_busy & starts & (phase == 0)) | (edges == 0))
    proof.lemma(since["clock"] >= Mux(in_frame & (phase != 0), phase, least))
    proof.lemma(since["select"] >= Mux(in_frame, least, Mux(was_busy & starts & (phase != 0), phase, 0)))
    proof.lemma(~(was_busy & (late == 1) & (phase == 0)) | (since["select"] >= least))
    pace_count = proof.before(count)
    proof.lemma(~proof.before(1) | (count == Mux(pace_count == paces - 1, 0, pace_count + 1)))
    proof.lemma(Mux(count == 0, since["pace"] >= paces, since["pace"] >= count))
    falls = ~dut.pins.spi_clock & proof.before(dut.pins.spi_clock)
    proof.lemma(inside["takes"] == Cat(falls, proof.before(falls)))
    marks = inside["of_last"]
    proof.lemma(~marks[0] | falls)
    proof.lemma(~marks[1] | proof.before(falls))
    proof.lemma(~dut.done | proof.before(proof.before(falls)))
    proof.lemma(~(marks.any() | dut.done) | (dut.reading.unit < dut.skin.units))


_BUGS = (
    Bug("no pause after the selection", Ads131m08, "pins__spi_clock",
        lambda level, inside: level | (inside["busy"] & (inside["level"] == 0))),
    Bug("selected too late", Ads131m08, "pins__spi_select_n", lambda level, inside: level | (inside["level"] == 1)),
    Bug("a pace too fast", Ads131m08, "pins__spi_pace", lambda level, inside: level ^ inside["level"][0]),
)  # fmt: skip
CASES = (
    Case("frames of an ADS131M08", "2 units, 1 MHz", partial(frames, skin=_SLOW), 6),
    Case("frames of an ADS131M08", "3 units, 48 MHz", partial(frames, skin=_FAST), 6, _BUGS, 20),
)
