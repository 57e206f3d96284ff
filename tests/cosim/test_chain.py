"""Random Skins through everything: scene, compiled gateware, line, driver, zones, against a flood fill of the cells."""

import random

import numpy as np
import pytest
from zone_oracles import zones_by_image_tools

import contactfpga
from contactfpga import Skin, SkinError
from contactfpga.choices import labellers
from contactfpga_sim.model import golden
from contactfpga_sim.model.board.virtual import VirtualBoard

DEFAULT_SKINS, CAMPAIGN_SKINS = 1, 60
FRAMES = 25


def random_skin(rng):
    """A Skin of any kind whose gateware does not bounce or forget: what is pressed long enough is what comes."""
    while True:
        rows, columns = rng.choice([(rng.randint(1, 12), rng.randint(1, 12)), (rng.randint(1, 64), rng.randint(1, 64))])
        values = {
            "rows": rows,
            "columns": columns,
            "connectivity": rng.choice([4, 8]),
            "labeller": rng.choice(list(labellers.LABELLERS)),
            "report": rng.choice(["moments", "moments", "barycenter", "cells"]),
            "send": rng.choice(["always", "on_change"]),
            "diodes": rng.choice(["col2row", "row2col"]),
            "row_drive": rng.choice(["direct", "74hc595"]),
            "clock_hz": rng.choice([1, 12, 25, 48]) * 1_000_000,
            "settle_us": rng.choice([2.0, 5.0, 9.5, 40.0]),
            "pitch_x_mm": rng.choice([1.0, 4.5, 10.0, 7 / 3]),
            "pitch_y_mm": rng.choice([1.0, 4.5, 10.0, 7 / 3]),
            "name": rng.choice(["", "left forearm", "Hüfte"]),
        }
        values["baud"] = rng.choice([values["clock_hz"] // divisor for divisor in (4, 10, 50)])
        try:
            return Skin(**values)
        except SkinError:
            continue


def expected(skin, cells):
    """Zones as (area, x, y) with x and y in mm, sorted; and by how much each may be rounded."""
    # Cells are labelled exactly on the host.
    exact = labellers.find(skin.labeller).exact or skin.report == "cells"
    zones = golden.zones(cells, skin.connectivity) if exact else zones_by_image_tools(cells, skin.labeller)
    step = 2.0**-skin.barycenter_bits / 2 if skin.report == "barycenter" else 0.0
    places = [(area, x / area * skin.pitch_x_mm, y / area * skin.pitch_y_mm) for area, x, y in zones]
    return places, (step * skin.pitch_x_mm, step * skin.pitch_y_mm)


def check(seed):
    rng = random.Random(seed)
    skin = random_skin(rng)
    cells = np.zeros((skin.rows, skin.columns), bool)
    with contactfpga.open(VirtualBoard(skin, lambda _: cells), timeout=60.0) as board:
        assert (board.sheet, board.name) == (skin.sheet, skin.name)
        for _ in range(FRAMES):
            density = rng.choice([0.0, 0.02, 0.1, 0.5, 0.9, 1.0])
            cells = np.array([[rng.random() < density for _ in range(skin.columns)] for _ in range(skin.rows)])
            zones = board.read(timeout=60.0)  # scanned after the cells were changed
            wanted, (off_x, off_y) = expected(skin, cells)
            # Cells jump, and the host flags a zone that moved by more than a pitch since the scan before.
            assert (zones.pressed, zones.flags - {"overflow", "motion"}) == (cells.sum(), set())
            if skin.report != "cells":
                assert zones.total_zones == len(wanted)
            if "overflow" in zones.flags:
                continue
            got = sorted((zone.area_cells, zone.x_mm, zone.y_mm) for zone in zones)
            assert len(got) == len(wanted)
            for area, x_mm, y_mm in got:  # a one to one pairing: places of one area differ by more than the rounding
                near = [w for w in wanted if w[0] == area and abs(w[1] - x_mm) <= off_x + 1e-9]
                near = [w for w in near if abs(w[2] - y_mm) <= off_y + 1e-9]
                assert near, f"{skin}: no zone of {area} cells at {x_mm}, {y_mm}"
                wanted.remove(near[0])
        assert not board.stats.damaged
        assert board.stats.lost == 0


@pytest.mark.parametrize("seed", range(DEFAULT_SKINS))
def test_random_skins_through_the_whole_chain(seed):
    check(seed)


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(DEFAULT_SKINS, CAMPAIGN_SKINS))
def test_many_random_skins_through_the_whole_chain(seed):
    check(seed)
