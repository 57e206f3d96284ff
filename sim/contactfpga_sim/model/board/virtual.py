"""The virtual board, of one sheet or of several: compiled gateware in simulated time, as a serial port."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

import numpy as np

from contactfpga.choices import converters
from contactfpga.design.circuit import Circuit, load_checked
from contactfpga.design.cover import Cover, load_cover
from contactfpga.driver.address import Sim
from contactfpga.errors import AddressError
from contactfpga.robot.haptics import LoadCells
from contactfpga.skin import Skin
from contactfpga.skin.several import Several
from contactfpga_sim.model.board.compiled import CompiledBoard, CompiledSheets
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.felt import UnitReadings
from contactfpga_sim.model.scenes.recordings import Recording
from contactfpga_sim.model.scenes.scene import CONTACTS, CellsAt, Scene, Source, contacts_of
from contactfpga_sim.model.scenes.scene import scene as make_scene
from contactfpga_sim.model.sheet.line import lines_of

CHUNK_S = 0.2e-3
"""Simulated time between two looks at the scene and at the line."""


UnitSource = Callable[[float], Sequence[int]]
"""From the simulated time in s to what each pressure unit reads, in steps of its converter."""


def _unit_source(skin: Skin, scene: Source, units: UnitSource | LoadCells | None) -> UnitSource:
    """Raises ValueError for units that the Skin or the scene has no use for."""
    if not isinstance(units, LoadCells):
        return units or _at_rest(skin)
    if len(units.units) != skin.units:
        raise ValueError(f"there are {len(units.units)} units; the Skin has units = {skin.units}")
    contacts = contacts_of(skin, scene)
    if contacts is None:
        raise ValueError(f"scene {scene!r} has no forces, which units need; take one of {', '.join(CONTACTS)}")
    return UnitReadings(contacts, units, skin)


class RoundContact(Protocol):
    """A round contact, placed on the sheet laid flat."""

    x_mm: float
    y_mm: float
    radius_mm: float
    force_n: float


def _at_rest(skin: Skin) -> UnitSource:
    readings = [1 << converters.find(skin.converter).bits - 1] * skin.units
    return lambda _: readings


class VirtualBoard:
    """A board in simulated time, behind the interface of a serial port: time passes only in :meth:`read`.

    skin: the reference Skin by default; scene: whatever :func:`contactfpga_sim.model.scenes.scene.scene` takes, among
    it a function of the simulated time in s that returns the pressed cells, (rows, columns) bool; cover: through which
    its contacts press, by default none; circuit: the sheet's, by which its lines take time to settle, by default none;
    slow_rows, slow_columns: by line the factor by which it then takes longer; units: a function
    of the simulated time in s that returns what each pressure unit reads, by default half of full scale; or the
    LoadCells that the scene's contacts press on, if it has contacts; look_s: simulated time between two looks at the
    scene.

    ``contactfpga.open(VirtualBoard())`` makes a board of it as of any port. What the function raises comes out of the
    call that waits for a frame.
    """

    def __init__(
        self,
        skin: Skin | None = None,
        scene: Source = None,
        cover: Cover | None = None,
        circuit: Circuit | None = None,
        slow_rows: Mapping[int, float] | None = None,
        slow_columns: Mapping[int, float] | None = None,
        units: UnitSource | LoadCells | None = None,
        look_s: float = CHUNK_S,
    ):
        self.skin = skin or Skin()
        self._look_s = look_s
        self._units = _unit_source(self.skin, scene, units)
        self._scene = make_scene(self.skin, scene, cover)
        self._cover = cover
        self._touch: CellsAt | None = None
        self.pressed = np.zeros((self.skin.rows, self.skin.columns), bool)
        """(rows, columns) bool: the switches that are closed since the last :meth:`advance`."""
        self._board = CompiledBoard(self.skin)
        if circuit is not None:
            self._board.settle(*lines_of(circuit, self.skin))
        elif slow_rows or slow_columns:
            raise ValueError("slow_rows and slow_columns are factors of a circuit's times; give the circuit")
        if slow_rows or slow_columns:
            self._board.slow(slow_rows or {}, slow_columns or {})

    def write(self, data: bytes) -> None:
        """Send bytes to the board."""
        self._board.send(data)

    def read(self, seconds: float) -> bytes:
        """Let simulated time pass until bytes have come, at most ``seconds``; returns those that came."""
        left = round(seconds * self.skin.clock_hz)
        while True:
            if (data := self._board.receive()) or left <= 0:
                return data
            cycles = min(left, max(1, round(self._look_s * self.skin.clock_hz)))
            self.advance(cycles)
            left -= cycles

    @property
    def by_force(self) -> bool:
        """Whether it depends on a finger's force which switches close: there is a cover that goes by stress."""
        return self._cover is not None and self._cover.model != "patch"

    def touch(self, fingers: Iterable[RoundContact]) -> None:
        """From now on these touch the sheet, besides its scene, until the next call; from any thread."""
        placed = [
            contacts.Contact(shape=contacts.disc(one.radius_mm), x_mm=one.x_mm, y_mm=one.y_mm, force_n=one.force_n)
            for one in fingers
        ]
        scene = Scene(tuple(placed))
        self._touch = scene.on(self.skin, self._cover) if placed else None
        if isinstance(self._units, UnitReadings):
            self._units.touching = scene

    def advance(self, cycles: int) -> None:
        """Run clock cycles with the scene as it is now."""
        touch, pressed = self._touch, self._scene(self.clock())
        self.pressed = pressed if touch is None else pressed | touch(self.clock())
        if self.skin.units:
            self._board.load(self._units(self.clock()))
        self._board.hold(self.pressed[None], cycles)

    def clock(self) -> float:
        """Simulated seconds since power-up."""
        return self._board.cycle / self.skin.clock_hz

    def close(self) -> None:
        """Free the board."""
        self._board.close()

    def __enter__(self) -> VirtualBoard:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class VirtualSheets:
    """A board of several sheets in simulated time, which passes only in :meth:`read`.

    several: the sheets; scenes: what touches each of them, for :func:`contactfpga_sim.model.scenes.scene.scene`.
    """

    def __init__(self, several: Several, scenes: Sequence[Source]):
        self.several = several
        self._scenes = [make_scene(skin, scene) for skin, scene in zip(several.skins, scenes, strict=True)]
        self._board = CompiledSheets(several)
        self._chunk = max(1, round(CHUNK_S * several.clock_hz))

    def write(self, data: bytes) -> None:
        """Send bytes to the board."""
        self._board.send(data)

    def read(self, seconds: float) -> bytes:
        """Let simulated time pass until bytes have come, at most ``seconds``; returns those that came."""
        left = round(seconds * self.several.clock_hz)
        while True:
            data = self._board.receive()
            if data or left <= 0:
                return data
            cycles = min(left, self._chunk)
            self.advance(cycles)
            left -= cycles

    def advance(self, cycles: int) -> None:
        """Run clock cycles with the scenes as they are now."""
        for number, scene in enumerate(self._scenes):
            self._board.press(number, scene(self.clock()))
        self._board.run(cycles)

    def clock(self) -> float:
        """Simulated seconds since power-up."""
        return self._board.cycle / self.several.clock_hz

    def close(self) -> None:
        """Free the board."""
        self._board.close()


def board_at(name: str, skin: Skin | None = None) -> VirtualBoard | VirtualSheets:
    """The board that ``sim://?scene=NAME&skin=FILE&threshold=NUMBER&units=FILE`` asks for; ``skin``: where it names no
    file. Raises :class:`~contactfpga.AddressError`, and as the files that it names do."""
    address = Sim.parse(name)
    cover, circuit, units = None, None, None
    several = Several.load(address.sheets) if address.sheets is not None else None
    if address.skin is not None:
        skin = Skin.load(address.skin)
        cover, circuit = load_cover(address.skin), load_checked(address.skin, skin)
    try:
        if several is not None:
            return VirtualSheets(several, [address.scene] * len(several.skins))
        if address.units is not None:
            units = LoadCells.load(address.units)
        scene = _compared(address.scene, address.threshold)
        return VirtualBoard(skin, scene, cover, circuit, units=units)
    except ValueError as error:  # a scene that is not known, or that does not fit the sheet
        raise AddressError(f"{name}: {error}") from None


def _compared(scene: str | None, threshold: float | None) -> str | Recording | None:
    """The scene; with a threshold the recording in its file, whose numbers above it count as pressed."""
    if threshold is None:
        return scene
    if scene is None or not scene.endswith((".npy", ".npz")):
        raise ValueError(f"threshold is {threshold:g}; only numbers of a .npy or .npz file are compared with it")
    return Recording.load(scene, threshold)
