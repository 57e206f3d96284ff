"""Consecutive frames of one sheet as arrays, converted to :class:`~contactfpga.Zones` on demand."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator

import numpy as np

from contactfpga.skin.sheet import Sheet
from contactfpga.wire.faults import STUCK
from contactfpga.wire.protocol import Frame, frame_of
from contactfpga.zones.units import UnitHistory
from contactfpga.zones.zone import HostLine, HostLines, Zones


@dataclasses.dataclass(frozen=True, eq=False)
class Run:
    """At least one frame; those after the first carry the same answer and the same names of faults."""

    sheet: Sheet
    packets: np.ndarray
    """(n,) valid packets of :data:`contactfpga.wire.table.FIELDS`."""
    starts: np.ndarray
    """(n + 1,) starts of each frame's records; the first may be above 0."""
    records: np.ndarray
    """:attr:`contactfpga.wire.table.PacketTable.records`."""
    times_us: np.ndarray
    line: HostLine | HostLines | None
    """Arrival times and times on the host's clock, for all frames or each; None in a recording."""
    before: Frame | None = None
    faults: tuple[str, ...] = (STUCK,)
    history: UnitHistory | None = None
    answers: int = 0
    """Highest ticket of :meth:`contactfpga.driver.conversation.Conversation.ask` that was issued before the frames were
    scanned."""

    def __len__(self) -> int:
        return len(self.packets)

    def after(self, index: int) -> Run:
        return dataclasses.replace(
            self,
            packets=self.packets[index:],
            starts=self.starts[index:],
            times_us=self.times_us[index:],
            line=self.line.after(index) if isinstance(self.line, HostLines) else self.line,
            before=self._frame(index - 1) if index else self.before,
        )

    @property
    def carried(self) -> np.ndarray:
        """(k, ...) records of the run's own frames."""
        return self.records[self.starts[0] : self.starts[-1]]

    def __getitem__(self, index: int) -> Zones:
        before = self._frame(index - 1) if index else self.before
        time_us = self._plain[2][index]
        line = self.line.of(index) if isinstance(self.line, HostLines) else self.line
        return Zones(self._frame(index), self.sheet, time_us, before, line, self.faults, self.history)

    def _frame(self, index: int) -> Frame:
        if (made := self._made.get(index)) is None:
            fields, starts, _ = self._plain
            made = frame_of(fields[index], self.records[starts[index] : starts[index + 1]], self.sheet)
            self._made.clear()  # but the last one, which comes before the next
            self._made[index] = made
        return made

    def __iter__(self) -> Iterator[Zones]:
        return map(self.__getitem__, range(len(self)))

    @functools.cached_property
    def _made(self) -> dict[int, Frame]:
        return {}

    @functools.cached_property
    def _plain(self) -> tuple[list[tuple[int, ...]], list[int], list[int]]:
        return self.packets.tolist(), self.starts.tolist(), self.times_us.tolist()
