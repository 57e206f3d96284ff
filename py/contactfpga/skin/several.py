"""The Skins of several sheets on one FPGA."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from contactfpga.errors import SkinError
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown
from contactfpga.skin.skin import Skin

MOST_SHEETS = 16
"""Largest number of sheets that packets can number."""

_ALONE = ("units", "dual")


@dataclasses.dataclass(frozen=True)
class Several:
    """The sheets of one FPGA, each on shift registers of its own; they share clock, UART and contact pin.

    A sheet's number is its index in ``skins``. Raises :class:`SkinError` for Skins that do not fit together.
    """

    skins: tuple[Skin, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "skins", tuple(self.skins))
        if not 2 <= len(self.skins) <= MOST_SHEETS:
            raise SkinError(f"there are {len(self.skins)} sheets; one FPGA serves 2 to {MOST_SHEETS} of them together")
        for number, skin in enumerate(self.skins):
            self._check(number, skin)

    @classmethod
    def load(cls, path: str | Path, trust: bool = False) -> Several:
        """Read a TOML file whose only key is ``sheets``, a list of Skin files relative to its folder; ``trust`` as in
        :meth:`Skin.load`.
        """
        values = tomlfile.load(path, SkinError)
        if set(values) != {"sheets"}:
            unknown = sorted(set(values) - {"sheets"})
            what = f"unknown key {shown(unknown[0])}" if unknown else "no key 'sheets'"
            raise SkinError(f'{path}: {what}; the file of several sheets holds sheets = ["SKIN.toml", ...] alone')
        files = values["sheets"]
        if not isinstance(files, list) or not all(isinstance(file, str) for file in files):
            raise SkinError(f"{path}: sheets is {shown(files)}; it must be a list of Skin files")
        if len(files) > MOST_SHEETS:
            raise SkinError(f"{path}: sheets names {len(files):,} files; a board has at most {MOST_SHEETS} sheets")
        skins = [Skin.load(Path(path).parent / file, trust) for file in files]
        try:
            return cls(tuple(skins))
        except SkinError as error:
            raise SkinError(f"{path}: {error}") from None

    @property
    def clock_hz(self) -> int:
        """Common clock of the gateware in Hz."""
        return self.skins[0].clock_hz

    @property
    def baud(self) -> int:
        """Common bits per second on the wire."""
        return self.skins[0].baud

    def _check(self, number: int, skin: Skin) -> None:
        sheet = f"sheet {number}"
        for name in ("clock_hz", "baud"):
            value, first = getattr(skin, name), getattr(self.skins[0], name)
            if value != first:
                raise SkinError(f"{sheet}: {name} is {value}, that of sheet 0 is {first}; one FPGA has one {name}")
        for name, registers in (("row_drive", "74hc595"), ("column_read", "74hc165")):
            if getattr(skin, name) != registers:
                raise SkinError(
                    f"{sheet}: {name} is {getattr(skin, name)!r}; of several sheets each is on shift registers, set "
                    f"{name} = {registers!r}"
                )
        for name in _ALONE:
            if value := getattr(skin, name):
                raise SkinError(
                    f"{sheet}: {name} is {shown(value)}; only a board of one sheet can have it, leave it out"
                )


def sheets_of(skins: Sequence[Skin]) -> str:
    """Sizes of sheets in words: ``8x8, 16x4``."""
    return ", ".join(f"{skin.rows}x{skin.columns}" for skin in skins)
