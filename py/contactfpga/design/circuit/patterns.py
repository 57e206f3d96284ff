"""Patterns of pressed switches that are worst for some time or level."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np


def named(rows: int, columns: int) -> Mapping[str, np.ndarray]:
    """(rows, columns) bool by name; the selected row and the omitted line are the middle ones."""
    row, column = middle(rows), middle(columns)
    none = np.zeros((rows, columns), bool)
    found = {name: none.copy() for name in ("nothing", "one cell", "one row", "one row but a cell", "one column")}
    found["one cell"][row, column] = True
    found["one row"][row] = found["one row but a cell"][row] = True
    found["one row but a cell"][row, column] = False
    found["one column"][:, column] = True
    found["one column but a cell"] = found["one column"].copy()
    found["one column but a cell"][row, column] = False
    found["all"] = ~none
    found["all but a row"], found["all but a column"], found["all but a cell"] = (~none for _ in range(3))
    found["all but a row"][row] = False
    found["all but a column"][:, column] = False
    found["all but a cell"][row, column] = False
    found["all, one cell of the row"], found["all, every other cell of the row"] = ~none, ~none
    found["all, one cell of the row"][row] = np.arange(columns) == column
    found["all, every other cell of the row"][row] = np.arange(columns) % 2 == column % 2
    found["checker"] = np.indices((rows, columns)).sum(axis=0) % 2 == (row + column) % 2
    return found


def middle(count: int) -> int:
    return count // 2


SETTLE = (
    "one row but a cell",
    "all",
    "all but a column",
    "all, one cell of the row",
    "all, every other cell of the row",
)
RELEASE = ("one row", "all")
PROJECT_ROWS = ("nothing", "one cell", "one column but a cell", "all but a row")
PROJECT_COLUMNS = ("nothing", "one cell", "all but a column", "all")
