"""Patterns that break labellers: functions to (rows, columns) bool cells."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np


def spiral(rows: int, columns: int) -> np.ndarray:
    """One arm, wound inward with a gap of one cell, merged only at its end."""
    cells = np.zeros((rows, columns), bool)
    y, x, dy, dx = 0, 0, 0, 1
    cells[0, 0] = True
    turns = 0
    while turns < 2:
        ahead, beyond = (y + dy, x + dx), (y + 2 * dy, x + 2 * dx)
        blocked = _inside(cells, beyond) and cells[beyond]
        if _inside(cells, ahead) and not cells[ahead] and not blocked:
            y, x = ahead
            cells[y, x] = True
            turns = 0
        else:
            dy, dx = dx, -dy
            turns += 1
    return cells


def _inside(cells: np.ndarray, place: tuple[int, int]) -> bool:
    return 0 <= place[0] < cells.shape[0] and 0 <= place[1] < cells.shape[1]


def comb(rows: int, columns: int) -> np.ndarray:
    """Teeth in every second column that merge in the last row."""
    cells = np.zeros((rows, columns), bool)
    cells[:, ::2] = True
    cells[-1] = True
    return cells


def checkerboard(rows: int, columns: int) -> np.ndarray:
    """Every second cell: one zone with 8-connectivity, the most zones with 4."""
    y, x = np.indices((rows, columns))
    return (y + x) % 2 == 0


def nested_u(rows: int, columns: int) -> np.ndarray:
    """Nested cups, open at the top: the most waiting zones, the inner ones closed first."""
    y, x = np.indices((rows, columns))
    depth = np.minimum(np.minimum(x, columns - 1 - x), rows - 1 - y)
    return depth % 2 == 0


def nested_arch(rows: int, columns: int) -> np.ndarray:
    """Nested arches, open at the bottom: the outer ones closed first."""
    return nested_u(rows, columns)[::-1]


def ladder(rows: int, columns: int) -> np.ndarray:
    """Rails in every second column with shifted rungs: holes, and merges in every row."""
    y, x = np.indices((rows, columns))
    return (x % 2 == 0) | ((y + x // 2) % 2 == 0)


def tree(rows: int, columns: int) -> np.ndarray:
    """Single cells that merge in pairs, the pairs in pairs, and so on."""
    cells = np.zeros((rows, columns), bool)
    stems = list(range(0, columns, 2))
    y = 0
    while y < rows:
        height = max(1, rows // (2 * max(1, columns.bit_length())))
        cells[y : y + height, stems] = True
        y += height
        if y >= rows:
            break
        merged = []
        for left, right in zip(stems[::2], stems[1::2], strict=False):
            cells[y, left : right + 1] = True
            merged.append((left + right) // 2)
        if len(stems) % 2:
            cells[y, stems[-1]] = True
            merged.append(stems[-1])
        stems = merged
        y += 1
    return cells


def rings(rows: int, columns: int) -> np.ndarray:
    """Closed rings in one another."""
    y, x = np.indices((rows, columns))
    depth = np.minimum(np.minimum(x, columns - 1 - x), np.minimum(y, rows - 1 - y))
    return depth % 2 == 0


def dots(rows: int, columns: int) -> np.ndarray:
    """Single cells in every second row and column: the most zones with 8-connectivity."""
    y, x = np.indices((rows, columns))
    return (y % 2 == 0) & (x % 2 == 0)


def stripes(rows: int, columns: int) -> np.ndarray:
    """Every second row."""
    cells = np.zeros((rows, columns), bool)
    cells[::2] = True
    return cells


def diagonals(rows: int, columns: int) -> np.ndarray:
    """Diagonal lines, two free cells apart: zones with 8-connectivity, dust with 4."""
    y, x = np.indices((rows, columns))
    return (y + x) % 3 == 0


def zigzag(rows: int, columns: int) -> np.ndarray:
    """Lines that run down and up: every upper turn is a new zone that merges later."""
    y, x = np.indices((rows, columns))
    wave = np.abs(x % 6 - 3)
    return (y - wave) % 4 == 0


def full(rows: int, columns: int) -> np.ndarray:
    """Every cell."""
    return np.ones((rows, columns), bool)


SHAPES: dict[str, Callable[[int, int], np.ndarray]] = {
    shape.__name__: shape
    for shape in (
        *(spiral, comb, checkerboard, nested_u, nested_arch, ladder, tree),
        *(rings, dots, stripes, diagonals, zigzag, full),
    )
}


def variants(rows: int, columns: int) -> Iterator[tuple[str, np.ndarray]]:
    """(name, (rows, columns) bool) of every shape in all distinct flips and transposes."""
    for name, shape in SHAPES.items():
        seen = set()
        for transposed in (False, True):
            cells = shape(columns, rows).T if transposed else shape(rows, columns)
            for flipped in ("", "y", "x", "xy"):
                turned = cells[:: -1 if "y" in flipped else 1, :: -1 if "x" in flipped else 1]
                if turned.tobytes() not in seen:
                    seen.add(turned.tobytes())
                    suffix = ("-t" if transposed else "") + (f"-{flipped}" if flipped else "")
                    yield name + suffix, np.ascontiguousarray(turned)


def around(rows: int, columns: int) -> np.ndarray:
    """(n, rows, columns) bool, for a closed sheet: variants, shifted over the seam and sheared; helices; spirals;
    hooks."""
    frames = []
    for _, cells in variants(rows, columns):
        for lean in (-3, -1, 0, 1, 2):
            sheared = np.stack([np.roll(row, y * lean // 2) for y, row in enumerate(cells)])
            frames += [np.roll(sheared, shift, axis=1) for shift in (0, columns // 3, columns - 1)]
    y, x = np.indices((rows, columns))
    for step in range(1, columns):
        for wide in sorted({1, step, columns // 2}):
            frames += [(x - sign * y * step) % columns < wide for sign in (-1, 1)]
    for gap in range(2, max(3, columns // 2)):  # a spiral of two rows per turn, and its seam of one cell
        turn = (x - y // 2 * gap) % columns
        frames += [np.where(y % 2 == 0, turn != 0, turn == 1), np.where(y % 2 == 0, turn > 1, turn == columns - 1)]
    if rows >= 5 and columns >= 6:
        hooks = [np.roll(_hook(rows, columns), shift, axis=1) for shift in range(columns)]
        frames += [cells[:, ::sign] for cells in hooks for sign in (1, -1)]
    return np.unique(np.array(frames, bool), axis=0)


def _hook(rows: int, columns: int) -> np.ndarray:
    """An arch over the seam, and inside it a zone that the last row joins on another turn."""
    cells = np.zeros((rows, columns), bool)
    cells[0, [0, 1, 2, -2, -1]] = cells[-1, :3] = True
    cells[:, [2, -2]] = True
    cells[2:, 0] = True
    return cells
