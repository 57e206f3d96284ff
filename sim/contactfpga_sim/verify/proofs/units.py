"""Pressure units: converters and thresholds."""

from functools import partial

from amaranth.hdl import Array, Cat, Const, Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga_hdl.units.ads131m08 import BITS, CLOCKS, LEVELS, Ads131m08
from contactfpga_hdl.units.mcp3208 import Mcp3208
from contactfpga_hdl.units.watch import Settings, Watch
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.proof import Proof

_FAST = Skin(units=3, converter_v=5.0)
_SLOWEST = Skin(units=2, clock_hz=1_000_000, baud=250_000, settle_us=100)


def conversions(proof: Proof, skin: Skin) -> None:
    """Free: the converter's answers.

    Claimed: conversions follow one another, unit after unit, each with 19 clocks while the converter is selected and
    none in the two levels while it is not. No clock level is too short, nor the pause between selection and clock.
    Start, single-ended and channel bits are set a level before each rising edge, and stable while the clock is high. A
    reading is the pin's level in the clock before the last twelve rising edges, available three clocks after the last.
    """
    m = proof.m
    dut = Mcp3208(skin)
    inside = proof.put(dut)
    least = skin.derived.units.level_clocks
    miso = proof.free(1, "miso")
    m.d.comb += dut.pins.spi_miso.eq(miso)
    clock, select_n, mosi = dut.pins.spi_clock, dut.pins.spi_select_n, dut.pins.spi_mosi
    before = proof.before(clock), proof.before(select_n, init=1), proof.before(mosi)
    rises, selected = clock & ~before[0], ~select_n & before[1]
    edges = Signal(5, name="edges")  # rising ones in this conversion, before this clock
    unit = Signal(3, name="unit")  # of this conversion
    since = {name: Signal(range(2 * least + 1), name=f"since_{name}") for name in ("clock", "select", "mosi")}
    changed = {"clock": clock != before[0], "select": select_n != before[1], "mosi": mosi != before[2]}
    for name, count in since.items():
        m.d.sync += count.eq(Mux(changed[name], 1, Mux(count == 2 * least, count, count + 1)))
    begun = Signal(name="begun")
    with m.If(selected):
        m.d.sync += [edges.eq(0), begun.eq(1)]
        m.d.sync += unit.eq(Mux(begun, Mux(unit == skin.units - 1, 0, unit + 1), 0))
        proof.claim(since["select"] == 2 * least)
        proof.claim(~begun | (edges == 19))
    with m.Elif(rises):
        m.d.sync += edges.eq(edges + 1)
        sent = Cat(Const(0b11, 2), unit[2], unit[1], unit[0])
        proof.claim((since["clock"] >= least) & (since["select"] >= least) & (since["mosi"] >= least))
        proof.claim(~select_n & (edges < 19) & (mosi == (sent >> edges)[0]))
    with m.If(select_n):
        proof.claim(~clock)
    with m.If(changed["clock"] & ~clock):
        proof.claim(since["clock"] >= least)
    with m.If(changed["mosi"]):
        proof.claim(~clock | rises)
    _readings(proof, dut, rises, edges, miso, unit)
    _tie(proof, inside, least, edges, unit, begun, since)


def _readings(proof: Proof, dut: Mcp3208, rises: Value, edges: Value, miso: Value, unit: Value) -> None:
    taken = Signal(12, name="taken")
    with proof.m.If(rises):
        proof.m.d.sync += taken.eq(Cat(proof.before(miso), taken))
    last = proof.before(rises & (edges == 18))
    proof.claim(dut.done == proof.before(last))
    proof.lemma(dut.reading.value == proof.before(taken))
    with proof.m.If(dut.done):
        proof.claim(dut.reading.value == proof.before(taken))
        proof.claim(dut.reading.unit == proof.before(proof.before(unit)))
        proof.claim(dut.reading.last == (dut.reading.unit == dut.skin.units - 1))


def _tie(proof: Proof, inside, least: int, edges: Value, unit: Value, begun: Value, since: dict[str, Signal]) -> None:
    dut, level, clock, its_unit = inside.component, inside["level"], inside["clock"], inside["unit"]
    last_unit = dut.skin.units - 1
    late, phase = proof.before(level, init=38), proof.before(clock)
    late_unit = proof.before(its_unit, init=last_unit)
    starts = Signal(init=1, name="starts")
    proof.m.d.sync += starts.eq(0)
    ends = phase == least - 1
    next_unit = Mux(ends & (late == 39), Mux(late_unit == last_unit, 0, late_unit + 1), late_unit)
    follows = (clock == Mux(ends, 0, phase + 1)) & (its_unit == next_unit)
    follows &= level == Mux(ends, Mux(late == 39, 0, late + 1), late)
    at_start = (level == 38) & (clock == 0) & (its_unit == last_unit)
    first, resting = (late == 0) & (phase == 0), late >= 38
    word = Cat(Const(0b11, 2), late_unit[2], late_unit[1], late_unit[0])
    proof.lemma((late < 40) & (phase < least) & (late_unit <= last_unit) & (late < 40))
    proof.lemma(Mux(starts, at_start & resting & (phase == 0) & (late_unit == last_unit), follows))
    proof.lemma((dut.pins.spi_select_n == resting) & (dut.pins.spi_clock == (late[0] & ~resting)))
    proof.lemma(dut.pins.spi_mosi == (word >> (late >> 1))[0])
    proof.lemma(begun | (edges == 0) & (resting | first))
    with proof.m.If(first):
        proof.lemma(late_unit == Mux(begun & (unit != last_unit), unit + 1, 0))
    with proof.m.Else():
        proof.lemma(late_unit == Mux(begun, unit, last_unit))
    counted = (late + (late[0] & (phase != 0))) >> 1
    proof.lemma(edges == Mux(first | resting, Mux(begun, 19, 0), counted))
    whole = 2 * least
    of_clock = Mux(late[0] & (late != 1) | ~late[0] & (late != 38), least, Mux(late == 38, 0, whole))
    of_clock = Mux(phase == 0, of_clock, phase)
    of_clock = Mux(late == 0, whole, Mux(late == 39, least + phase, of_clock))
    proof.lemma(since["clock"] >= of_clock)
    of_select = Mux(late == 38, phase, Mux(late == 39, least + phase, Mux(first, whole, whole)))
    of_select = Mux((late == 0) & ~first, phase, Mux(late == 1, least + phase, of_select))
    proof.lemma(since["select"] >= of_select)
    proof.lemma(since["mosi"] >= Mux(late[0], least, phase))
    pin_rises = dut.pins.spi_clock & ~proof.before(dut.pins.spi_clock)
    last = pin_rises & (edges == 18)
    proof.lemma(inside["takes"] == Cat(pin_rises, proof.before(pin_rises)))
    proof.lemma(inside["of_last"] == Cat(last, proof.before(last)))
    with proof.m.If(last):
        proof.lemma((dut.reading.unit == late_unit) & (dut.reading.last == (late_unit == last_unit)))


def thresholds(proof: Proof, skin: Skin) -> None:
    """Free: readings of any unit, commands in any clock; a unit is chosen. Given: readings of one unit are at least two
    clocks apart.

    Claimed: two clocks after a reading of the unit its bit is whether a threshold is set and the reading at least that
    far from the zero; it stays until the next reading. Before a threshold is set nothing is over or armed; the unit's
    arms it.
    """
    m = proof.m
    dut = Watch(skin)
    inside = proof.put(dut)
    unit = proof.chosen(range(skin.units), "unit")
    proof.given(unit < skin.units)
    for port, name in ((dut.done, "done"), (dut.command, "command"), (dut.what, "what"), (dut.value, "value")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    reading, of = proof.free(12, "value_read"), proof.free(range(skin.units), "of")
    m.d.comb += [dut.reading.value.eq(reading), dut.reading.unit.eq(of)]
    done = proof.before(dut.done)
    proof.given((of < skin.units) & ~(done & dut.done) & (~done | (of == proof.before(of))))
    zero, threshold, is_set = Signal(12, name="zero"), Signal(12, name="threshold"), Signal(name="is_set")
    number = dut.value[3:]
    with m.If(dut.command & (dut.value[:3] == unit)):
        with m.If(dut.what == 3):
            m.d.sync += zero.eq(number)
        with m.If(dut.what == 4):
            m.d.sync += [threshold.eq(number), is_set.eq(number != 0)]
    read = proof.before(reading)
    zero_then = proof.before(zero)
    far = (read >= zero_then + threshold) | (read + threshold <= zero_then)
    expected = Signal(name="expected")
    with m.If(done & (of == unit)):
        m.d.sync += expected.eq(is_set & far)
    overs = inside["of_units"]
    bits = Array(overs[index] for index in range(skin.units))
    proof.claim(bits[unit] == expected)
    proof.claim(~expected | dut.over)
    kept = {name: [inside[f"settings.{name}"] for name in names] for name, names in _registers(skin).items()}
    ever = Signal(name="ever")
    with m.If(dut.command & (dut.what == 4) & (number != 0)):
        m.d.sync += ever.eq(1)
    proof.claim((~is_set | dut.armed) & (ever | ~dut.armed & ~dut.over))
    proof.lemma(ever | ~(inside["of_units"].any() | Cat(kept["given"]).any()))
    proof.lemma(Array(kept["zero"])[unit] == zero)
    proof.lemma(Array(kept["threshold"])[unit] == threshold)
    proof.lemma(Array(kept["given"])[unit] == is_set)
    proof.lemma(~(done & (of == unit)) | (inside["deviation"] == proof.before(reading) - zero_then))
    proof.lemma(inside["compares"] == done)


def _registers(skin: Skin) -> dict[str, list[str]]:
    places = range(skin.units)
    forms = {"zero": "zero_{}", "threshold": "threshold_{}", "given": "threshold_{}_given"}
    return {name: [form.format(place) for place in places] for name, form in forms.items()}


_SPI_BUGS = (
    Bug("a clock short", Mcp3208, "pins__spi_select_n", lambda level, inside: level | (inside["level"] >= 36)),
    Bug("selected too soon", Mcp3208, "pins__spi_select_n", lambda level, inside: level & (inside["level"] != 39)),
    Bug("data with the rising edge", Mcp3208, "pins__spi_mosi", lambda level, inside: level ^ (inside["level"] == 3)),
    Bug("channels counted from the lowest bit", Mcp3208, "pins__spi_mosi",
        lambda level, inside: Mux((inside["level"] >> 1) == 2, inside["unit"][0], level)),
    Bug("a bit too late", Mcp3208, "done", lambda done, inside: inside["of_last"][0]),
)  # fmt: skip
_WATCH_BUGS = (
    Bug("above the threshold only", Watch, "of_units",
        lambda over, inside: Mux(inside["deviation"] == inside["settings.threshold"], 0, over)),
    Bug("one way only", Watch, "of_units", lambda over, inside: Mux(inside["deviation"] < 0, 0, over)),
    Bug("armed at power-up", Settings, "armed", lambda armed, inside: ~armed),
)  # fmt: skip


_PACED_SLOW = Skin(units=2, converter="ads131m08", clock_hz=1_000_000, baud=250_000, settle_us=100)
_PACED_FAST = Skin(units=3, converter="ads131m08", clock_hz=48_000_000, baud=12_000_000)


def frames(proof: Proof, skin: Skin) -> None:
    """Free: the converter's answers, and when a conversion is ready.

    Claimed: no level of the converter's own clock or of the SPI clock is too short, nor the pause between selection and
    clock. The SPI clock runs while the converter is selected; each selection has 240 clocks. A reading is the pin's
    level in the clocks before the last 24 falling edges, its highest bit inverted, available three clocks after the
    last.
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
    _paced_readings(proof, dut, falls, miso)
    _tie_paced(proof, inside, dut, edges, since)


def _paced_readings(proof: Proof, dut: Ads131m08, falls: Value, miso: Value) -> None:
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


def _tie_paced(proof: Proof, inside, dut: Ads131m08, edges: Value, since: dict[str, Signal]) -> None:
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


_PACED_BUGS = (
    Bug("no pause after the selection", Ads131m08, "pins__spi_clock",
        lambda level, inside: level | (inside["busy"] & (inside["level"] == 0))),
    Bug("selected too late", Ads131m08, "pins__spi_select_n", lambda level, inside: level | (inside["level"] == 1)),
    Bug("a pace too fast", Ads131m08, "pins__spi_pace", lambda level, inside: level ^ inside["level"][0]),
)  # fmt: skip
CASES = (
    ProofCase("conversions of an MCP3208", "3 units, 12 MHz, 5 V", partial(conversions, skin=_FAST), 4),
    ProofCase("conversions of an MCP3208", "2 units, 1 MHz", partial(conversions, skin=_SLOWEST), 4, _SPI_BUGS, 50),
    ProofCase("thresholds of units", "3 units", partial(thresholds, skin=_FAST), 4, _WATCH_BUGS, 8),
    ProofCase("frames of an ADS131M08", "2 units, 1 MHz", partial(frames, skin=_PACED_SLOW), 6),
    ProofCase("frames of an ADS131M08", "3 units, 48 MHz", partial(frames, skin=_PACED_FAST), 6, _PACED_BUGS, 20),
)
