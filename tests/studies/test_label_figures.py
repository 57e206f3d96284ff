"""The page's figures of the labeller's last record, for touches at every place."""

import itertools

import numpy as np
import pytest
from sample import sample
from study_pages import section

from contactfpga_sim.lab.performance import labellers as label_figures
from contactfpga_sim.model.golden import volume
from contactfpga_sim.verify.cosim.bench_labeller import LabelBench

SQUARE = label_figures.SHEET


@pytest.fixture(scope="module")
def places():
    return label_figures.every_place(label_figures.touches(SQUARE))


@pytest.mark.parametrize("labeller", label_figures.EXACT)
@pytest.mark.parametrize("connectivity", [8, 4])
def test_the_last_two_rows_alone_decide_how_late_the_last_record_is(labeller, connectivity):
    rng = np.random.default_rng(3)
    frames = rng.random((500, 9, 16)) < rng.choice([0.1, 0.3, 0.6, 0.9], (500, 1, 1))
    whole = volume.last_record_clocks(frames, connectivity, labeller)
    assert np.array_equal(volume.last_record_clocks(frames[:, -2:], connectivity, labeller), whole)


def test_every_place_is_every_offset_of_the_frame():
    """Counted with the frame moved about on a sheet, a cell at a time."""
    frame = np.zeros((4, 5), bool)
    frame[1, 1:4] = frame[2, 2] = True
    padded = np.pad(frame, ((4, 4), (5, 5)))
    expected = {}
    for down in range(1, 8):
        for right in range(1, 10):
            last = padded[down : down + 4, right : right + 5][-2:]
            if last.any():
                expected[last.tobytes()] = expected.get(last.tobytes(), 0) + 1
    rows, count = label_figures.every_place(frame[None])
    assert {row.tobytes(): number for row, number in zip(rows, count.tolist())} == expected


@pytest.mark.slow
@pytest.mark.parametrize(
    ("labeller", "connectivity"),
    sample(itertools.product(label_figures.EXACT, (8, 4)), quick=[(label_figures.EXACT[0], 8)]),
)
def test_the_gateware_is_as_late_as_the_page_says(places, labeller, connectivity):
    """The worst touch goes through the compiled labeller; the row of the table is that of a new run."""
    skin = SQUARE.replace(labeller=labeller, connectivity=connectivity)
    assert label_figures.labeller_row(skin, places) in section("performance.md", "labeller").splitlines()
    rows, _ = places
    clocks = volume.last_record_clocks(rows, connectivity, labeller)
    worst = np.zeros((1, 16, 16), bool)
    worst[0, -2:] = rows[clocks.argmax()]
    with LabelBench(skin) as bench:
        assert bench.run(worst).last_record_clocks[0] == clocks.max()
