"""Forces at the zones of a board with pressure units, for commands."""

from __future__ import annotations

from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.robot.haptics import AloneWatch, Contacts, Drift, DriftWatch, HapticsError, LoadCells, felt
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones


def cells_of(board: Board, path: str) -> LoadCells:
    """The units in a file, as many as the board has. Raises :class:`HapticsError`, OSError."""
    cells = LoadCells.load(path)
    facts = board.hello.units
    if facts is None:
        raise ContactFPGAError(f"{board.port}: this board has no pressure units; build its Skin with units")
    if len(cells.units) != facts.count:
        raise HapticsError(f"{path}: there are {len(cells.units)} units; the board has {facts.count}")
    return cells


class Forces:
    """The contacts of the last frame, and units with drifting zeros."""

    def __init__(self, cells: LoadCells, friction: float):
        self._cells, self._friction = cells, friction
        self._watch = DriftWatch(cells)
        self._alone = AloneWatch(cells)
        self.drift: Drift | None = None
        """None: no readings yet."""
        self.contacts: Contacts | None = None
        """None: the frame has no readings."""

    @classmethod
    def of(cls, board: Board, path: str | None, friction: float | None) -> Forces | None:
        """The forces requested by a command; None without a file. Raises :class:`HapticsError`, OSError."""
        return None if path is None else cls(cells_of(board, path), 0.5 if friction is None else friction)

    def take(self, zones: Zones, tracks: Tracks | None) -> None:
        self._alone.take(zones)
        self.contacts = felt(self._cells, zones, self._friction, tracks=tracks, alone=self._alone)
        if zones.units is not None:
            self.drift = self._watch.update(zones.time_us / 1e6, zones.units.readings, len(zones))

    def of_frame(self, zones: Zones, tracks: Tracks | None) -> Contacts | None:
        """Add the next frame; returns its contacts."""
        self.take(zones, tracks)
        return self.contacts

    def to_dict(self) -> dict[str, object]:
        found = self.contacts
        if found is None:
            return {"contacts": None}
        rest = found.unexplained
        return {
            "contacts": [one.to_dict() for one in found],
            "model": found.model,
            "chi2": found.chi2,
            "alarm": found.alarm,
            "wrench": {"force_n": list(found.wrench.force_n), "moment_nm": list(found.wrench.moment_nm)},
            "unexplained": rest and {"force_n": list(rest.force_n), "moment_nm": list(rest.moment_nm)},
            "saturated": list(found.wrench.saturated),
            "lifted": list(found.wrench.lifted),
            "drifted": [] if self.drift is None else list(self.drift.drifted),
        }

    def sentences(self) -> list[str]:
        """Warnings for a display."""
        found = self.contacts
        if found is None:
            return ["no readings of the units yet"]
        of_units = {"saturated": found.wrench.saturated, "lifted": found.wrench.lifted}
        said = [f"unit {unit} {what}" for what, units in of_units.items() for unit in units]
        if self.drift is not None:
            said += [f"unit {unit} drifted by {self.drift.deviations_n[unit]:.2g} N" for unit in self.drift.drifted]
        if found.beyond_friction:
            said.append("more friction than given")
        if found.alarm:
            x, y, z = found.wrench.force_n if found.unexplained is None else found.unexplained.force_n
            said.append(f"force that no zone explains: ({x:.2f}, {y:.2f}, {z:.2f}) N")
        return said
