"""Consecutive frames of one sheet as arrays, which become :class:`~contactfpga.Zones` one by one where they are
wanted."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator

import numpy as np

from contactfpga.skin.sheet import Sheet
from contactfpga.wire.faults import STUCK
from contactfpga.wire.protocol import FLAG_SETS, NO_RECORDS, Frame
from contactfpga.zones.zone import Zones


@dataclasses.dataclass(frozen=True, eq=False)
class Run:
    """One frame or more; the sheet has a diode per switch and its report is of zones."""

    sheet: Sheet
    packets: np.ndarray
    """(n,) of :data:`contactfpga.wire.many.FIELDS`, all valid."""
    starts: np.ndarray
    """(n + 1,) where each one's records begin; the first need not be 0."""
    records: np.ndarray
    """(m, 3) int64, at least up to the last start."""
    times_us: np.ndarray
    """(n,) int64, since power-up."""
    host_time_s: float | None
    faults: tuple[str, ...] = (STUCK,)
    """Of its flagged frames; see :attr:`Zones.faults`."""

    def __len__(self) -> int:
        return len(self.packets)

    def after(self, index: int) -> Run:
        """Without the first frames."""
        return dataclasses.replace(
            self, packets=self.packets[index:], starts=self.starts[index:], times_us=self.times_us[index:]
        )

    @property
    def carried(self) -> np.ndarray:
        """(k, 3): the records of its frames alone."""
        return self.records[self.starts[0] : self.starts[-1]]

    def __getitem__(self, index: int) -> Zones:
        fields, starts, times_us = self._plain
        start, stop = starts[index], starts[index + 1]
        frame = frame_of(fields[index], self.records[start:stop], self.sheet)
        return Zones(frame, self.sheet, times_us[index], None, self.host_time_s, self.faults)

    def __iter__(self) -> Iterator[Zones]:
        return map(self.__getitem__, range(len(self)))

    @functools.cached_property
    def _plain(self) -> tuple[list[tuple[int, ...]], list[int], list[int]]:
        """The same in Python's own numbers, which numpy would make one by one."""
        return self.packets.tolist(), self.starts.tolist(), self.times_us.tolist()


def frame_of(fields: tuple[int, ...], records: np.ndarray, sheet: Sheet) -> Frame:
    """A frame of :data:`contactfpga.wire.many.FIELDS` and its records."""
    _, time_us, sequence, heard, cells, zones, overwritten, flags, _ = fields
    divided = sheet.report == "barycenter"
    return Frame(
        sequence=sequence,
        time_us=time_us,
        flags=FLAG_SETS[flags],
        overwritten=overwritten,
        heard=heard,
        zones=zones,
        cells=cells,
        moments=NO_RECORDS if divided or not len(records) else records,
        bitmap=None,
        barycenters=records if divided else None,
    )
