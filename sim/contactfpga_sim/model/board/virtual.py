"""The virtual board of one or several sheets: compiled gateware in simulated time, as a serial port."""

from __future__ import annotations

import math
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
from contactfpga_sim.model.scenes.hand import Hand
from contactfpga_sim.model.scenes.recordings import Recording
from contactfpga_sim.model.scenes.scene import CONTACTS, CellsAt, Scene, Source, contacts_of
from contactfpga_sim.model.scenes.scene import scene as make_scene
from contactfpga_sim.model.sheet.falling import FallingSheet
from contactfpga_sim.model.sheet.line import lines_of

CHUNK_S = 0.2e-3
"""Simulated time between two samples of the scene and the line."""


UnitSource = Callable[[float], Sequence[int]]
"""A function from simulated time in s to each pressure unit's reading, in converter steps."""


def _unit_source(skin: Skin, scene: Source, units: UnitSource | LoadCells | None) -> UnitSource:
    """Raises ValueError for units that do not fit the Skin or the scene."""
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
    """A board in simulated time, with the interface of a serial port. Time passes only in :meth:`read`.

    skin: default the reference Skin; scene: any argument of :func:`contactfpga_sim.model.scenes.scene.scene`, for
    instance a function from simulated time in s to pressed (rows, columns) bool cells; cover: default none; circuit:
    the sheet's, for settling times, default none; slow_rows, slow_columns: factors of settling time by line; units: a
    function from simulated time in s to the pressure units' readings, default half of full scale, or the LoadCells
    under a scene with contacts; look_s: simulated time between two samples of the scene; unplug_s: simulated time from
    which the sheet is pulled off its board.

    ``contactfpga.open(VirtualBoard())`` opens it like any port. Exceptions of a scene's function come out of the call
    that waits for a frame.
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
        unplug_s: float = math.inf,
    ):
        self.skin = skin or Skin()
        self.skins = (self.skin,)
        self._look_s = look_s
        self._units = _unit_source(self.skin, scene, units)
        self._scene, self._hand = make_scene(self.skin, scene, cover), scene if isinstance(scene, Hand) else None
        self._cover = cover
        self._touch: CellsAt | None = None
        self._fingers = Scene(())
        self.pressed = np.zeros((self.skin.rows, self.skin.columns), bool)
        """(rows, columns) bool: switches closed since the last :meth:`advance`."""
        self._board = CompiledBoard(self.skin)
        self._unplug_s = unplug_s
        self._cells, self._contacts = None, contacts_of(self.skin, scene)
        if circuit is not None and circuit.falling:
            if cover is None or cover.cell is None:
                raise ValueError("[circuit.falling] needs [cover.cell], whose resistance falls with the force")
            self._cells, parts = FallingSheet(self.skin, circuit, cover.cell), circuit.falling
            noise, edge = (1e-3 * mv / circuit.supply_v for mv in (parts.noise_mv, -parts.edge_mv))
            self._board.disturb(noise, edge, 1e-6 * parts.edge_us, parts.edge_hz)
        elif circuit is not None:
            self._board.settle(*lines_of(circuit, self.skin))
        elif slow_rows or slow_columns:
            raise ValueError("slow_rows and slow_columns are factors of a circuit's times; give the circuit")
        if slow_rows or slow_columns:
            self._board.slow(slow_rows or {}, slow_columns or {})

    def write(self, data: bytes) -> None:
        """Send bytes to the board."""
        self._board.send(data)

    def read(self, seconds: float) -> bytes:
        """Let simulated time pass until bytes arrive, at most ``seconds``; returns them."""
        left = round(seconds * self.skin.clock_hz)
        while True:
            if (data := self._board.receive()) or left <= 0:
                return data
            cycles = min(left, max(1, round(self._look_s * self.skin.clock_hz)))
            self.advance(cycles)
            left -= cycles

    @property
    def by_force(self) -> bool:
        """Whether a contact's force matters, as the cover depends on stress."""
        return self._cover is not None and self._cover.model != "patch"

    def touch(self, fingers: Iterable[RoundContact]) -> None:
        """Touch the sheet with these fingers, besides its scene, until the next call. Any thread may call this
        method."""
        placed = [
            contacts.Contact(shape=contacts.disc(one.radius_mm), x_mm=one.x_mm, y_mm=one.y_mm, force_n=one.force_n)
            for one in fingers
        ]
        scene = Scene(tuple(placed))
        self._touch, self._fingers = scene.on(self.skin, self._cover) if placed else None, scene
        if isinstance(self._units, UnitReadings):
            self._units.touching = scene

    def advance(self, cycles: int) -> None:
        """Run clock cycles with the current scene."""
        if self.clock() >= self._unplug_s:
            self.plug(False)
            self._unplug_s = math.inf
        touch, pressed = self._touch, self._scene(self.clock())
        self.pressed = pressed if touch is None else pressed | touch(self.clock())
        if self.skin.units:
            self._board.load(self._units(self.clock()))
        if self._cells is None:
            self._board.hold(self.pressed[None], cycles)
            return
        times_s = self._cells.times_s(self._cells.ohm(self._forces_n(), self.clock()))
        self._board.fall(times_s, self._cells.end, self._cells.threshold)
        self._board.hold(np.ones((1, *self.pressed.shape), bool), cycles)

    def plug(self, plugged: bool) -> None:
        """Plug the sheet in, or pull it off: no line reaches the board."""
        self._board.cut({} if plugged else dict.fromkeys(range(self.skin.row_lines), 0), {})

    def _forces_n(self) -> np.ndarray:
        """Forces on resistive cells; under a scene that knows none, four times their level on those pressed, or what a
        hand presses with."""
        assert self._cover is not None
        assert self._cells is not None
        now, fingers = self.clock(), self._fingers.forces_n(self.clock(), self.skin, self._cover)
        if self._contacts is None:
            each_n = 4 * self._cells.cell.level_n
            return fingers + (self._hand.force_n(each_n) if self._hand else each_n) * self._scene(now)
        return fingers + self._contacts.forces_n(now, self.skin, self._cover)

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
    """A board of several sheets, with the interface of :class:`VirtualBoard`.

    several: the sheets; scenes: an argument of :func:`contactfpga_sim.model.scenes.scene.scene` for each; unplug: a
    sheet's number, and the simulated time in s from which it is pulled off.
    """

    def __init__(self, several: Several, scenes: Sequence[Source], unplug: tuple[int, float] | None = None):
        self.several, self.skins = several, several.skins
        if unplug is not None and unplug[0] >= len(self.skins):
            raise ValueError(f"unplug names sheet {unplug[0]}; there are the sheets 0 to {len(self.skins) - 1}")
        self._unplug = unplug
        self._scenes = [make_scene(skin, scene) for skin, scene in zip(several.skins, scenes, strict=True)]
        self._board = CompiledSheets(several)
        self._chunk = max(1, round(CHUNK_S * several.clock_hz))

    def write(self, data: bytes) -> None:
        self._board.send(data)

    def read(self, seconds: float) -> bytes:
        left = round(seconds * self.several.clock_hz)
        while True:
            data = self._board.receive()
            if data or left <= 0:
                return data
            cycles = min(left, self._chunk)
            self.advance(cycles)
            left -= cycles

    def advance(self, cycles: int) -> None:
        if self._unplug is not None and self.clock() >= self._unplug[1]:
            self.plug(self._unplug[0], False)
            self._unplug = None
        for number, scene in enumerate(self._scenes):
            self._board.press(number, scene(self.clock()))
        self._board.run(cycles)

    def plug(self, number: int, plugged: bool) -> None:
        """Plug a sheet with its shift registers in, or pull it off."""
        self._board.plug(number, plugged)

    def clock(self) -> float:
        return self._board.cycle / self.several.clock_hz

    def close(self) -> None:
        self._board.close()


def board_at(name: str, skin: Skin | None = None) -> VirtualBoard | VirtualSheets:
    """The board at a ``sim://`` address, whatever its pace; ``skin``: default without a file. Raises
    :class:`~contactfpga.AddressError`, and the errors of its files."""
    address = Sim.parse(name)
    cover, circuit, units = None, None, None
    several = Several.load(address.sheets) if address.sheets is not None else None
    if address.skin is not None:
        skin = Skin.load(address.skin)
        cover, circuit = load_cover(address.skin), load_checked(address.skin, skin)
    try:
        if several is not None:
            return VirtualSheets(several, [address.scene] * len(several.skins), address.unplug)
        if address.units is not None:
            units = LoadCells.load(address.units)
        scene = _compared(address.scene, address.threshold)
        unplug_s = math.inf if address.unplug is None else address.unplug[1]
        return VirtualBoard(skin, scene, cover, circuit, units=units, unplug_s=unplug_s)
    except ValueError as error:  # a scene that is not known, or that does not fit the sheet
        raise AddressError(f"{name}: {error}") from None


def _compared(scene: str | None, threshold: float | None) -> str | Recording | None:
    if threshold is None:
        return scene
    if scene is None or not scene.endswith((".npy", ".npz")):
        raise ValueError(f"threshold is {threshold:g}; only numbers of a .npy or .npz file are compared with it")
    return Recording.load(scene, threshold)
