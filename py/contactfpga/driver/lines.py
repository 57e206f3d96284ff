"""What a board says of its lines, and which faults a frame's flag stands for."""

from __future__ import annotations

from collections.abc import Iterable

from contactfpga.wire.faults import STUCK, UNNAMED, Faults, decode_faults
from contactfpga.wire.hello import Hello


class Lines:
    """The last report of a board, and the names of its faults while frames are flagged.

    A report that the faults are gone overtakes the last frames in which they were. So their names hold until a frame
    is not flagged, or another report comes.
    """

    def __init__(self, mask: Iterable[tuple[int, int]] = ()):
        self.told: Faults | None = None
        """The last report; None: none came since the board was powered up or another Skin loaded, or it sends none."""
        self.fading = False
        """The next frame that is not flagged changes the names."""
        self._mask = tuple(mask)
        self._unnamed: tuple[str, ...] = (STUCK,)
        self._names: tuple[str, ...] = self._unnamed

    def forget(self) -> None:
        """The board was restarted, or is another one."""
        self.told, self.fading, self._names = None, False, self._unnamed

    def take_hello(self, hello: Hello) -> None:
        """What the board can tell."""
        unnamed = UNNAMED if hello.guard or (hello.self_test and self.told is None) else STUCK
        if self._names == self._unnamed:
            self._names = (unnamed,)
        self._unnamed = (unnamed,)

    def take_report(self, plain: bytes, hello: Hello) -> Faults | None:
        """An unsealed report; returns it if it says something else than the one before. Raises :class:`PacketError`."""
        sheet = hello.sheet
        found = decode_faults(plain, sheet.rows, sheet.columns, hello.guard, hello.self_test)
        found = found.named(sheet.rows, sheet.columns, self._mask)
        before, self.told = self.told or Faults(), found
        self._unnamed = (UNNAMED if hello.guard else STUCK,)
        self.fading = not found and bool(before)
        if not self.fading:
            self._names = found.names or self._unnamed
        return None if found == before else found

    def names(self, flagged: bool) -> tuple[str, ...]:
        """Names of the faults of the next frame."""
        if flagged:
            return self._names
        if self.fading:
            self.fading, self._names = False, self._unnamed
        return ()
