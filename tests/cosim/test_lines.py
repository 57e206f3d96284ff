"""Guard lines, the order of lines and lines that are cut, in both models of the sheet."""

import numpy as np
import pytest

from contactfpga import Skin
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.model.sheet.matrix import Matrix

SKIN = Skin(rows=3, columns=4, guard=True, row_order=(2, 0, 1), column_order=(1, 3, 0, 2))


def read(skin, matrix):
    """(R + 1, C + 1) bool: what the board reads of each row that is driven alone, in the order of the sheet."""
    idle = (1 << skin.row_lines) - 1
    levels = [matrix.levels(idle ^ 1 << line) for line in skin.line_of_row]
    return np.array([[not level >> line & 1 for line in skin.line_of_column] for level in levels])


def whole(skin, cells):
    """The same for a whole sheet: guard switches are closed, the corner is open."""
    closed = np.ones((skin.rows + 1, skin.columns + 1), bool)
    closed[: skin.rows, : skin.columns] = cells
    closed[-1, -1] = False
    return closed


def test_the_guard_lines_are_the_last_ones_and_the_others_in_their_order():
    assert SKIN.line_of_row == (2, 0, 1, 3)
    assert SKIN.line_of_column == (1, 3, 0, 2, 4)
    matrix = Matrix(SKIN)
    matrix.press([0b0001, 0, 0])
    assert matrix.levels(0b1011) == 0b01101  # row 0 is on line 2, column 0 on line 1, the guard column on line 4
    assert matrix.levels(0b0111) == 0b10000  # the guard row


def test_a_whole_sheet_reads_as_pressed_and_its_guard_switches_closed():
    matrix = Matrix(SKIN)
    for seed in range(20):
        cells = np.random.default_rng(seed).random((3, 4)) < 0.4
        matrix.press(cells)
        assert (read(SKIN, matrix) == whole(SKIN, cells)).all()


def test_a_cut_line_reads_up_to_the_cut_and_mends():
    matrix, cells = Matrix(SKIN), np.ones((3, 4), bool)
    matrix.press(cells)
    for row in range(4):
        for end in range(6):
            matrix.cut({row: end}, {})
            wanted = whole(SKIN, cells)
            wanted[row, end:] = False
            assert (read(SKIN, matrix) == wanted).all(), (row, end)
            assert all(Cuts({row: end}).reach(row, c) == (c < end) for c in range(5))
    for column in range(5):
        for end in range(5):
            matrix.cut({}, {column: end})
            wanted = whole(SKIN, cells)
            wanted[end:, column] = False
            assert (read(SKIN, matrix) == wanted).all(), (column, end)
            assert all(Cuts({}, {column: end}).reach(r, column) == (r < end) for r in range(4))
    matrix.cut({}, {})
    assert (read(SKIN, matrix) == whole(SKIN, cells)).all()


def test_rows_that_are_let_go_show_the_guard_column_up_to_a_cut():
    matrix = Matrix(SKIN)
    matrix.press(None)
    guard = 1 << SKIN.line_of_column[-1]
    assert matrix.row_levels(0, 0, guard) == 0b0111
    matrix.cut({1: 4}, {})
    assert matrix.row_levels(0, 0, guard) == 0b0110  # row 1 is on line 0


@pytest.mark.parametrize("stuck", [[False, True, False, False], [False, True, False, False, True]])
def test_stuck_columns_may_count_the_guard_column(stuck):
    matrix = Matrix(SKIN)
    matrix.press(None, np.array(stuck))
    assert matrix.levels(0b1111) == 0b11111 ^ 1 << 3 ^ (1 << 4 if len(stuck) == 5 else 0)
