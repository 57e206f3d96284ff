"""The drawn sheet: what the board tells of it, and no more."""

from types import SimpleNamespace

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga.tools.console import drawn_sheet
from contactfpga.tools.console.drawn_sheet import CENTER, MASKED, SCALES, draw


def zones(skin, *found, cells=None):
    """What a frame says, with zones of (area, column, row)."""

    class Frame(list):
        pass

    frame = Frame(
        SimpleNamespace(
            area_cells=area,
            area_mm2=area * skin.pitch_x_mm * skin.pitch_y_mm,
            x_mm=None if x is None else x * skin.pitch_x_mm,
            y_mm=None if y is None else y * skin.pitch_y_mm,
        )
        for area, x, y in found
    )
    frame.sheet, frame.cells = skin.sheet, cells
    return frame


def test_a_zone_is_no_blob_of_cells():
    """Which cells a zone has is not known: neither within its circle nor anywhere is one drawn."""
    for scale in SCALES:
        for unicode in (True, False):
            drawing = draw(zones(Skin(), (61, 7.6, 7.3)), scale, unicode)
            assert not set("█▀▄#") & set(drawing.text)
            assert "not its cells" in drawing.legend
    middle = draw(zones(Skin(), (61, 7.6, 7.3))).text.split("\n")[8][12:20]
    assert set(middle) <= {"·", " "}  # the circle is empty


def test_zones_about_one_barycenter_are_told_apart():
    rings = zones(Skin(), (12, 7.5, 7.5), (28, 7.5, 7.5), (44, 7.5, 7.5), (60, 7.5, 7.5))
    across = drawn_sheet._circles(rings, SCALES[0])[32]  # through all their middles
    assert np.flatnonzero(across[1:] & ~across[:-1]).size == 8  # each circle is crossed twice
    assert (draw(rings).kinds == CENTER).sum() == 1


@pytest.mark.parametrize("scale", SCALES)
def test_a_circle_has_the_zones_area(scale):
    skin = Skin(rows=40, columns=40, pitch_x_mm=5, settle_us=20)
    area = 400
    dots = drawn_sheet._circles(zones(skin, (area, 19.5, 19.5)), scale)
    columns = np.flatnonzero(dots.any(axis=0))
    rows = np.flatnonzero(dots.any(axis=1))
    across, down = np.ptp(columns) / scale, np.ptp(rows) / scale
    assert across * down * np.pi / 4 == pytest.approx(area, rel=0.15)
    assert across == pytest.approx(2 * down, rel=0.15)  # as columns are half as far apart


@pytest.mark.parametrize("scale", SCALES)
def test_a_circle_over_the_seam_goes_on_at_the_other_end(scale):
    around = Skin(rows=10, columns=12, surface="cylinder", radius_mm=40.0, closed=True)
    middle = drawn_sheet._circles(zones(around, (12, 5.75, 5)), scale)
    for column in (11.75, 11.25, 0.25):
        shown = zones(around, (12, column, 5))
        turned = np.roll(middle, round((column - 5.75) * scale), axis=1)
        assert np.array_equal(drawn_sheet._circles(shown, scale), turned) or scale < 4  # whole dots only
        assert (draw(shown, scale).kinds == CENTER).sum() == 1
        assert drawn_sheet._circles(shown, scale).sum() == pytest.approx(middle.sum(), abs=3)


def test_the_barycenter_stands_where_it_is():
    drawing = draw(zones(Skin(), (1, 3, 5), (1, 10, 12)))
    assert np.argwhere(drawing.kinds == CENTER).tolist() == [[5, 6], [12, 20]]


def test_zones_that_lie_nowhere_are_left_out():
    assert (draw(zones(Skin(), (0, None, None), (4, 1e9, -1e9))).kinds == CENTER).sum() == 0


@pytest.mark.parametrize("scale", SCALES)
def test_every_cell_can_be_read_back(scale):
    rng = np.random.default_rng(3)
    for rows, columns in ((16, 16), (7, 5), (1, 1), (64, 63), (3, 2)):
        skin = Skin(rows=rows, columns=columns, report="cells", settle_us=20)
        cells = rng.random((rows, columns)) < 0.5
        drawing = draw(zones(skin, cells=cells), scale)
        assert (read_back(drawing, scale, rows, columns) == cells).all()
        assert "barycenter" not in drawing.legend


def read_back(drawing, scale, rows, columns):
    lines = ["".join(line) for line in drawing.characters]
    if scale == 4:
        cells = [[line[2 * column : 2 * column + 2] == "██" for column in range(columns)] for line in lines]
    elif scale == 2:
        cells = [[one in signs for one in line] for line in lines for signs in ("▀█", "▄█")]
    else:
        bits = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
        cells = [
            [one != "·" and bool((ord(one) - 0x2800) & bit) for one in line for bit in row]
            for line in lines
            for row in bits
        ]
    return np.array(cells)[:rows, :columns]


@pytest.mark.parametrize("scale", SCALES)
def test_in_ascii_no_pressed_cell_is_lost(scale):
    skin = Skin(rows=16, columns=16, report="cells")
    for row, column in ((0, 0), (7, 9), (15, 15)):
        cells = np.zeros((16, 16), bool)
        cells[row, column] = True
        drawing = draw(zones(skin, cells=cells), scale, unicode=False)
        assert drawing.text.isascii()
        assert drawing.legend.isascii()
        assert "#" in drawing.text.split("\n")[row * scale // 4]


def test_switches_that_are_known_to_be_absent_are_left_blank():
    skin = Skin(mask=((0, 0), (15, 15)))
    drawing = draw(zones(skin), mask=skin.mask)
    assert np.argwhere(drawing.kinds == MASKED)[:, 0].tolist() == [0, 0, 15, 15]
    assert drawing.text.startswith("  · ")
    assert "blank: no switch" in drawing.legend
    assert "blank" not in draw(zones(Skin())).legend


def test_the_largest_drawing_that_fits_comes_first():
    big = zones(Skin(rows=64, columns=64, settle_us=20))
    assert drawn_sheet.scales(big, 130, None) == [4, 2, 1]
    assert drawn_sheet.scales(big, 80, None) == [2, 1]
    assert drawn_sheet.scales(big, 130, 40) == [2, 1]
    assert drawn_sheet.scales(big, 60, 20) == [1]
    assert drawn_sheet.scales(big, 10, 2) == [1]


def marks(**cells):
    """What is known of each (row, column) of a sheet of 16x16."""
    made = {name: np.zeros((16, 16), bool) for name in ("seen", "flutters", "stuck")}
    for name, places in cells.items():
        for place in places:
            made[name][place] = True
    return drawn_sheet.Marks(**made)


def test_marks_show_what_a_watch_knows():
    skin, pressed = Skin(report="cells"), np.zeros((16, 16), bool)
    pressed[0, 3] = pressed[0, 4] = True
    known = marks(seen=[(0, 0), (0, 3), (0, 4), (0, 5)], flutters=[(0, 5)], stuck=[(0, 4)])
    drawing = draw(zones(skin, cells=pressed), SCALES[0], True, [(0, 2)], known)
    assert drawing.text.split("\n")[0] == "○ ·   ██!!~~" + "· " * 9 + "·"
    assert drawing.legend == ("█ pressed; ○ pressed before; · never pressed; ! stuck; ~ flutters; blank: no switch")
    assert "stuck" not in draw(zones(skin, cells=pressed), marks=marks()).legend


@pytest.mark.parametrize("unicode", [True, False])
def test_a_character_of_several_cells_is_seen_where_all_of_them_are(unicode):
    """Somebody looks for what was not touched yet."""
    sheet = zones(Skin(report="cells"), cells=np.zeros((16, 16), bool))
    block = [(row, column) for row in range(4) for column in range(2)]
    sign, free = ("○", "·") if unicode else ("o", ".")
    assert draw(sheet, 1, unicode, marks=marks(seen=block)).text[0] == sign
    assert draw(sheet, 1, unicode, marks=marks(seen=block[1:])).text[0] == free
    assert draw(sheet, 1, unicode, block[:1], marks(seen=block[1:])).text[0] == sign
    assert draw(sheet, 1, unicode, marks=marks(seen=block, stuck=block[:1])).text[0] == "!"
