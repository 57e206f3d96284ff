"""Kits: a sheet, its cover, its board and further parts, as files under ``examples/kits``."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path

from contactfpga.boards import find
from contactfpga.boards.spec import BoardSpec, bitstream_path
from contactfpga.design.circuit import load_circuit
from contactfpga.design.sheet import Layout, lay_out
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown
from contactfpga.shipped import examples
from contactfpga.skin import Skin


class KitError(ContactFPGAError, ValueError):
    """A missing kit or wrong files."""


@dataclasses.dataclass(frozen=True)
class KitPart:
    """An article to buy that is not on the sheet's board."""

    count: int
    what: str
    maker: str
    number: str
    """The maker's number; "" if any part of this description will do."""


@dataclasses.dataclass(frozen=True)
class Kit:
    """A sheet to build, with everything it needs."""

    name: str
    title: str
    board: BoardSpec
    parts: tuple[KitPart, ...]
    folder: Path

    @property
    def skin_path(self) -> Path:
        """The Skin's file, with the tables ``[circuit]`` and ``[cover]``."""
        return self.folder / "skin.toml"

    @property
    def bitstream(self) -> Path:
        """The bitstream in a release; a source tree has none."""
        return bitstream_path(self.board, self.folder)

    @functools.cached_property
    def skin(self) -> Skin:
        return self.board.load(self.skin_path)

    @functools.cached_property
    def layout(self) -> Layout:
        """The sheet as ``contactfpga sheet --kit`` lays it out, with headers for the kit's board."""
        return lay_out(self.skin, load_circuit(self.skin_path), board=self.board)


def names() -> list[str]:
    return sorted(path.parent.name for path in (examples() / "kits").glob("*/kit.toml"))


def kit(name: str) -> Kit:
    """The kit of this name; raises :class:`KitError`."""
    if name not in names():
        raise KitError(f"{shown(name)} is no kit; take one of {', '.join(names())}")
    folder = examples() / "kits" / name
    values = tomlfile.load(folder / "kit.toml", KitError)
    parts = tuple(KitPart(**tomlfile.fields_of(KitPart, "part", part, KitError)) for part in values.get("part", ()))
    return Kit(name, values["title"], find(values["board"]), parts, folder)
