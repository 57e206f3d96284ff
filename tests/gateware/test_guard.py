"""Guard lines in a raster scan: the gateware in lockstep with the golden model, with lines that break and heal."""

import itertools

import numpy as np
import pytest
from amaranth.hdl import Cat
from bench import split
from guard_lines import breaks
from sample import sample

from contactfpga import Skin
from contactfpga_hdl.scan import raster
from contactfpga_hdl.scan.guard import LineFaults
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_sim.model.golden import Timeline, guard, predict, requests
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.raster import checks
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.record import InputDriver

TINY = {"clock_hz": 1_000_000, "baud": 250_000, "guard": True}
SKINS = {
    "direct": Skin(rows=3, columns=4, settle_us=16, release_us=2, **TINY),
    "released for a clock": Skin(rows=3, columns=4, settle_us=18, release_us=1, diodes="row2col", **TINY),
    "masked": Skin(
        rows=4,
        columns=3,
        settle_us=12,
        release_us=3,
        mask=((0, 0), (0, 1), (0, 2), (1, 1), (2, 1), (3, 1), (3, 0)),
        **TINY,
    ),
    "precharged": Skin(rows=3, columns=4, settle_us=14, precharge_us=3, diodes="row2col", **TINY),
    "chains": Skin(rows=3, columns=4, row_drive="74hc595", column_read="74hc165", **TINY),
    "two chains": Skin(
        rows=5, columns=3, row_drive="74hc595", column_read="74hc165", row_chains=2, column_chains=2, **TINY
    ),
    "debounced": Skin(
        rows=3,
        columns=4,
        settle_us=16,
        release_us=2,
        debounce="sym_defer_pk",
        debounce_press_us=100,
        debounce_release_us=200,
        **TINY,
    ),
    "one row, one column": Skin(rows=1, columns=1, settle_us=12, release_us=2, report="cells", **TINY),
    "on change": Skin(
        rows=2, columns=2, settle_us=14, release_us=2, send="on_change", keep_alive_ms=0.5, clock_hz=2_000_000,
        baud=500_000, guard=True,
    ),
}  # fmt: skip


def events(skin: Skin, seed: int, frames: int) -> Timeline:
    """Random touches, stuck columns and cuts that come and go at any clock."""
    rng = np.random.default_rng(seed)
    scan = facts(skin).scan_clocks
    pieces, cuts, start = [], [], 0
    while start < frames * scan:
        cells = rng.random((skin.rows, skin.columns)) < rng.choice([0, 0.3, 1])
        stuck = rng.random(skin.columns + 1) < 0.2 if rng.random() < 0.2 else None
        pieces.append((start, cells, stuck))
        start += int(rng.integers(1, 3 * scan))
    start = 0
    while start < frames * scan:
        cuts.append((start, random_cuts(skin, rng)))
        start += int(rng.integers(1, 3 * scan))
    return Timeline(pieces, requests([scan, 3 * scan + 7], facts(skin).bit_clocks), cuts)


def random_cuts(skin: Skin, rng) -> Cuts:
    share = rng.choice([0, 0, 0.2, 0.5])
    rows = {row: int(rng.integers(skin.columns + 2)) for row in range(skin.rows + 1) if rng.random() < share}
    columns = {column: int(rng.integers(skin.rows + 2)) for column in range(skin.columns + 1) if rng.random() < share}
    return Cuts(rows, columns)


@pytest.mark.parametrize("name", sample(SKINS, quick=["two chains", "debounced"]))
def test_the_whole_board_is_the_golden_models_in_every_clock(name):
    skin = SKINS[name]
    timeline, cycles = events(skin, len(name), 20), 20 * facts(skin).scan_clocks
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 100


def reported_words(skin: Skin, timeline: Timeline, cycles: int, bench) -> list[int]:
    """The scanner's fault word in each cycle."""
    dut = Scanner(skin)
    sim, sheet = bench(dut), InputDriver(skin, timeline)
    watched = sim.watch(dut.faults)
    sim.sink(dut.rows)
    ports = [getattr(dut.pins, name) for name in sheet.reads]

    def levels(cycle, pins):
        return sheet.pins(cycle, dict(zip(sheet.reads, split(pins, map(len, ports)), strict=True)))[0]

    sim.drive(getattr(dut.pins, sheet.drives[0]), levels, Cat(*ports))
    sim.run(cycles)
    return watched.values


def changes(words) -> list[tuple[int, int]]:
    """The (cycle, word) pairs that differ from the one before; the first is compared with 0."""
    found, before = [], 0
    for cycle, word in words:
        if word != before:
            found.append((cycle, word))
        before = word
    return found


def golden(skin: Skin, timeline: Timeline, cycles: int) -> list[tuple[int, int]]:
    frames = cycles // facts(skin).scan_clocks + 1
    reported = [change for frame in checks(facts(skin), timeline, frames) for change in frame]
    return [change for change in changes(reported) if change[0] < cycles]


@pytest.fixture
def soon(monkeypatch):
    """Reports of faulty lines are renewed every 512 us."""
    monkeypatch.setattr(raster, "RETRY_BIT", 9)
    monkeypatch.setattr(guard, "RETRY_US", 2**9)


@pytest.mark.parametrize("name", sample(SKINS, quick=["precharged", "two chains", "masked"]))
def test_what_is_reported_of_lines_is_the_golden_models_in_every_clock(bench, soon, name):
    skin = SKINS[name]
    timeline, cycles = events(skin, 3 + len(name), 80), max(60 * facts(skin).scan_clocks, 4_000)
    expected = golden(skin, timeline, cycles)
    assert changes(enumerate(reported_words(skin, timeline, cycles, bench))) == expected
    assert len(expected) > 8
    ended = [word & ~later for (_, word), (_, later) in itertools.pairwise(expected)]
    assert any(ended), "no report ended"


RETRY_BIT = 7
BREAKS = Skin(rows=3, columns=4, report="cells", settle_us=10, release_us=2, **TINY)


@pytest.mark.parametrize("diodes", sample(["col2row", "row2col"], quick=["row2col"]))
def test_each_single_break_at_each_place_is_reported_within_two_frames_and_nothing_else(bench, monkeypatch, diodes):
    """Any switches may be pressed. Each line is cut in any clock of a frame, then mended, and its report ends after the
    clock toggles next."""
    monkeypatch.setattr(raster, "RETRY_BIT", RETRY_BIT)
    skin, rng = BREAKS.replace(diodes=diodes), np.random.default_rng(7)
    frame, retry = facts(skin).scan_clocks, 1 << RETRY_BIT
    spacing = 5 * frame + 2 * retry
    at = [number * spacing + int(rng.integers(frame)) for number in range(len(breaks(3, 4)))]
    cuts = [(start, cut) for start, (cut, _) in zip(at, breaks(3, 4), strict=True)]
    cuts += [(start + 2 * frame, Cuts()) for start in at]
    cycles = len(at) * spacing
    pieces = [(start, rng.random((3, 4)) < rng.random(), None) for start in range(0, cycles, frame // 2)]
    words = reported_words(skin, Timeline(pieces, cuts=sorted(cuts, key=lambda cut: cut[0])), cycles, bench)
    for start, (cut, wanted) in zip(at, breaks(3, 4), strict=True):
        meanwhile = words[start : start + spacing - frame]
        assert {word | wanted for word in meanwhile} == {wanted}, cut
        assert words[start + 2 * frame + 3] == wanted, cut
        assert words[start + 4 * frame + retry + 3] == 0, cut


def test_a_whole_sheet_is_never_reported_whatever_is_pressed(bench, rng):
    skin = Skin(rows=2, columns=3, report="cells", settle_us=10, release_us=2, **TINY)
    frame = facts(skin).scan_clocks
    every = [np.array([number >> bit & 1 for bit in range(6)], bool).reshape(2, 3) for number in range(64)]
    pieces = [(number * frame, cells, None) for number, cells in enumerate(every)]
    start = len(every) * frame
    pieces += [(clock, every[rng.randrange(64)], None) for clock in range(start, start + 20 * frame, 5)]
    assert set(reported_words(skin, Timeline(pieces), start + 20 * frame, bench)) == {0}


def test_what_is_reported_is_kept_until_a_renewing_round_finds_it_well(bench, rng):
    """Checks, rounds and toggles at random, many in the same clock, against reports looked up in the history of
    checks."""
    skin, cycles = SKINS["masked"], 6_000
    rows, columns = skin.rows, skin.columns
    ports = {"rows": rows, "columns": columns, "stuck": columns + 1, "checks_rows": rows, "checks_columns": 1,
             "checks_stuck": 1, "round": 1, "retry": 1}  # fmt: skip
    often = {"checks_rows": 0.3, "checks_columns": 0.1, "checks_stuck": 0.1, "round": 0.1}
    given = {
        name: [rng.getrandbits(bits) & rng.getrandbits(bits) for _ in range(cycles)] for name, bits in ports.items()
    }
    for name, share in often.items():
        given[name] = [word if rng.random() < share else 0 for word in given[name]]
    given["round"] = [int(rng.random() < 0.1) for _ in range(cycles)]
    toggled = [int(rng.random() < 0.04 or (ends and rng.random() < 0.2)) for ends in given["round"]]
    given["retry"] = [count % 2 for count in itertools.accumulate(toggled)]
    dut = LineFaults(skin)
    sim = bench(dut)
    for name in ports:
        sim.drive(getattr(dut, name), given[name].__getitem__)
    words = sim.watch(dut.faults)
    sim.run(cycles - 1)

    round_of = [0, *itertools.accumulate(given["round"])]
    renewing = {round_of[cycle] + 1 for cycle in range(cycles) if toggled[cycle]}
    lines = [("rows", row, lambda cycle, row=row: given["checks_rows"][cycle] >> row & 1) for row in range(rows)]
    lines += [("columns", column, given["checks_columns"].__getitem__) for column in range(columns)]
    lines += [("stuck", column, given["checks_stuck"].__getitem__) for column in range(columns + 1)]
    masked = {("rows", 0), ("columns", 1), ("stuck", 1)}
    for place, (name, line, is_checked) in enumerate(lines):
        reported, expected = 0, []
        for cycle in range(cycles - 1):
            expected.append(reported)
            if is_checked(cycle):
                kept = reported and round_of[cycle] not in renewing
                reported = int((given[name][cycle] >> line & 1 or kept) and (name, line) not in masked)
        assert [word >> place & 1 for word in words.values] == expected, (name, line)
        assert sum(expected) > 0.05 * cycles or (name, line) in masked
