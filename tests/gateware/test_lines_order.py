"""Sheets whose wires are soldered in another order: a scene of the sheet gives its own zones."""

import numpy as np
import pytest
from sample import sample

from contactfpga import Skin
from contactfpga_sim.model.golden import Timeline, driven, predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.model.sheet.shift import SheetAtPins
from contactfpga_sim.verify.cosim import bench_amaranth, record
from contactfpga_sim.verify.cosim.compare import Mismatch, compare

KINDS = {
    "direct": {"settle_us": 12},
    "precharged": {"settle_us": 12, "precharge_us": 2, "release_us": 4},
    "chains": {"row_drive": "74hc595", "column_read": "74hc165", "row_chains": 2, "column_chains": 2},
    "reversal": {"settle_us": 2, "precharge_us": 1, "release_us": 3, "scan": "reversal"},
}


def skin_of(kind: str, guard: bool, seed: int) -> Skin:
    rng = np.random.default_rng(seed)
    columns = ((2, 0, 1), (1, 2, 0), (2, 1, 0), (0, 2, 1), (1, 0, 2))[rng.integers(5)]
    orders = {"row_order": rng.permutation(5).tolist(), "column_order": columns}
    return Skin(
        rows=5, columns=3, guard=guard, mask=((1, 2),), diodes="row2col" if seed % 2 else "col2row",
        clock_hz=1_000_000, baud=250_000, **KINDS[kind], **orders,
    )  # fmt: skip


def scene(skin: Skin, frames: int, seed: int) -> Timeline:
    rng = np.random.default_rng(seed)
    scan = facts(skin).scan_clocks
    cells = rng.random((frames, 5, 3)) < 0.35
    cuts = [(4 * scan, Cuts({1: 2}, {0: 4})), (6 * scan, Cuts({}, {2: 0}))] if skin.guard else []
    return Timeline([(index * scan, frame, None) for index, frame in enumerate(cells)], cuts=cuts)


CASES = [(kind, guard) for kind in KINDS for guard in (False, True) if not guard or kind != "reversal"]


@pytest.mark.parametrize(
    ("kind", "guard"), sample(CASES, quick=[("precharged", True), ("chains", True), ("reversal", False)])
)
def test_a_scene_in_the_sheets_rows_and_columns_is_the_golden_models(kind, guard):
    skin = skin_of(kind, guard, len(kind))
    assert skin.row_order
    assert skin.column_order
    timeline, cycles = scene(skin, 8, len(kind)), 8 * facts(skin).scan_clocks
    expected = predict(skin, timeline, cycles)
    plain = predict(skin.replace(row_order=(), column_order=()), timeline, cycles)
    assert expected.rows == plain.rows  # the golden model takes the order for no more than a wiring
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 50


@pytest.mark.parametrize("field", ["row_order", "column_order"])
def test_a_sheet_that_is_soldered_in_another_order_is_seen(field, monkeypatch):
    skin = skin_of("direct", True, 2)
    order = getattr(skin, field)
    soldered = skin.replace(**{field: (order[1], order[0], *order[2:])})
    monkeypatch.setattr(record, "SheetAtPins", lambda _: SheetAtPins(soldered))
    timeline, cycles = scene(skin, 3, 5), 3 * facts(skin).scan_clocks
    with pytest.raises(Mismatch):
        compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles))


def test_a_line_is_driven_where_its_row_is_soldered():
    skin = Skin(rows=3, columns=2, row_order=(2, 0, 1), guard=True, settle_us=12)
    words = [word for _, word in driven(skin, Timeline([]), 4 * facts(skin).row_clocks) if word]
    assert words == [0b1000, 0b0100, 0b0001, 0b0010]
