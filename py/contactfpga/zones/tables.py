"""Zones as tables of pandas and pyarrow, which are imported on demand."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.errors import MissingExtra
from contactfpga.zones.box import Box, BoxMm

if TYPE_CHECKING:
    import pandas
    import pyarrow

VECTORS = {
    "point_mm": ("point_x_mm", "point_y_mm", "point_z_mm"),
    "normal": ("normal_x", "normal_y", "normal_z"),
    "box": Box._fields,
    "box_mm": tuple(f"box_{name}" for name in BoxMm._fields),
}


def columns(records: np.ndarray, **same: int) -> dict[str, np.ndarray]:
    """Columns of n values from (n,) structured records, after constant columns ``same``."""
    found = {name: np.full(len(records), value) for name, value in same.items()}
    for name in records.dtype.names or ():
        if name in VECTORS:
            found |= {part: records[name][:, number].copy() for number, part in enumerate(VECTORS[name])}
        else:
            found[name] = records[name].copy()
    return found


def to_pandas(records: np.ndarray, **same: int) -> pandas.DataFrame:
    """:func:`columns` as a DataFrame. Raises :class:`~contactfpga.MissingExtra`."""
    return _needed("pandas", "to_pandas()").DataFrame(columns(records, **same))


def to_arrow(records: np.ndarray, **same: int) -> pyarrow.Table:
    """:func:`columns` as a table, with null for NaN. Raises :class:`~contactfpga.MissingExtra`."""
    arrow = _needed("pyarrow", "to_arrow()")
    arrays = {name: arrow.array(values, from_pandas=True) for name, values in columns(records, **same).items()}
    return arrow.table(arrays)


def _needed(package: str, what: str) -> Any:
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        raise MissingExtra(f"{what} ({error})", "analysis") from None
