"""From the user's request to its view."""

from __future__ import annotations

import atexit
import contextlib
import dataclasses
import math
import tempfile
import threading
import time
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from contactfpga.driver import driver, transport
from contactfpga.driver.address import SheetOf, Sim
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import names_robot
from contactfpga.robot.haptics import LoadCells
from contactfpga.skin import Skin
from contactfpga.tools.view import page, server
from contactfpga.tools.view.board_recording import Reading, is_recording, load, silent
from contactfpga.tools.view.bodies import BodyPlayer, BodySource, BodyView, RobotView, holds_robot
from contactfpga.tools.view.cameras import Cameras, sides_of
from contactfpga.tools.view.fingers import Hand
from contactfpga.tools.view.panel import Panel
from contactfpga.tools.view.playback import Player
from contactfpga.tools.view.pushing import SimulatedView
from contactfpga.tools.view.robot_source import SimulatedSource
from contactfpga.tools.view.server import Guard
from contactfpga.tools.view.sources import BoardSource, Moment, Source
from contactfpga.tools.view.stage import Stage
from contactfpga.tools.view.tiles import Tiles

if TYPE_CHECKING:
    import viser

PANEL_S = 0.25


class View:
    """A source shown in a server's page."""

    def __init__(self, server: viser.ViserServer, source: Source, hand: Hand | None = None):
        self._source = source
        page.dress(server)
        self.stage = Stage(server, Tiles(source.sheet), source.cells)
        self.cameras = Cameras(server, sides_of(self.stage.tiles), lambda: self.stage.points_m)
        self.panel = Panel(server, source, hand, self.cameras)
        self._written_s = 0.0
        self._moment: Moment | None = None
        self.drawn = 0
        if hand is not None:
            self.stage.press_with(hand)

    def step(self) -> None:
        moment = self._source.poll()
        if moment is not None:
            self._moment = moment
            self.stage.draw(moment)
            self.drawn += 1
        if (now := time.monotonic()) - self._written_s > PANEL_S:
            self._written_s = now
            self.panel.write(self._moment)


FOREARM = Skin(rows=16, columns=16, closed=True, surface="cylinder", radius_mm=45.0)


def own_skin(flat: bool = False) -> Skin:
    """The default virtual sheet's Skin, at a third of the usual clock to keep up with real time."""
    return (Skin() if flat else FOREARM).replace(clock_hz=4_000_000, baud=2_000_000, send="on_change")


@dataclasses.dataclass(frozen=True)
class ServedView:
    web: viser.ViserServer
    guard: Guard
    view: View | RobotView
    source: Source | BodySource | BodyPlayer | SimulatedSource
    hand: Hand | None
    url: str
    """Address with the token, which permits reading and pressing."""


@dataclasses.dataclass(frozen=True)
class ViewRequest:
    port: str | None = None
    """A port, ``sim://``, a recording; None: a virtual sheet."""
    skin: str | Path | None = None
    baud: int | None = None
    timeout: float = 1.0
    link: str | None = None
    units: str | Path | None = None
    """File of the pressure units; by default from ``sim://``."""
    flat: bool = False
    reading: Reading = silent
    """Receives the progress of reading a recording without index."""
    mujoco: str | None = None
    """File of a MuJoCo model that wears the sheets of the robot of :attr:`port`."""
    reflex: str | None = None
    gateware: bool = False


@contextlib.contextmanager
def opened(
    named: ViewRequest | None = None, host: str = server.LOCAL, http_port: int | None = None
) -> Iterator[ServedView]:
    """Open the request and serve a view of it; raises the errors of :func:`contactfpga.open`."""
    named = named or ViewRequest()
    _check(named)
    source, hand = _source(named)
    try:
        web, guard = server.serve(host, http_port)
        try:
            if isinstance(source, SimulatedSource):
                view: View | RobotView = SimulatedView(web, source)
            elif isinstance(source, (BodySource, BodyPlayer)):
                view = BodyView(web, source)
            else:
                view = View(web, source, hand)
            yield ServedView(web, guard, view, source, hand, guard.url(web.get_port()))
        finally:
            server.stop(web)
    finally:
        source.close()


def run(shown: ServedView, seconds: float | None = None) -> None:
    """Draw moments for this long; None: until interrupted."""
    until = math.inf if seconds is None else time.monotonic() + seconds
    while time.monotonic() < until:
        shown.view.step()


def _check(named: ViewRequest) -> None:
    """Raises :class:`~contactfpga.ContactFPGAError` for options that would be ignored."""
    port = named.port
    is_body = names_robot(port)
    recorded = port is not None and not is_body and is_recording(port)
    for name in ("skin", "baud", "units"):
        if getattr(named, name) is not None and (is_body or recorded):
            other = "sets it for each link" if is_body else "is a recording"
            raise ContactFPGAError(f"--{name} is for a board; {port} {other}")
    if named.flat and (port is not None or named.skin is not None):
        raise ContactFPGAError("--flat is for the sheet that is shown where nothing is named")
    if named.mujoco is not None and not is_body:
        raise ContactFPGAError(f"--mujoco needs ROBOT.toml, whose sheets the model wears, not {port or 'nothing'}")
    if named.mujoco is None and (named.reflex is not None or named.gateware):
        raise ContactFPGAError(f"--{'gateware' if named.reflex is None else 'reflex'} is for a robot of --mujoco")
    if named.link is not None and not recorded:
        raise ContactFPGAError(f"--link is for a recording; {'name one' if port is None else f'{port} is not one'}")


def _source(named: ViewRequest) -> tuple[Source | BodySource | BodyPlayer | SimulatedSource, Hand | None]:
    if named.mujoco is not None and named.port is not None:
        return SimulatedSource(named.port, named.mujoco, named.reflex, named.gateware), None
    if names_robot(named.port):
        return BodySource(named.port, named.timeout), None
    if named.port is not None and is_recording(named.port):
        recorded = load(named.port, named.link, named.reading)
        if not recorded.named and holds_robot(recorded.recording):
            return BodyPlayer(recorded.recording), None
        return Player(recorded), None
    if named.port is not None and (not _is_virtual(named.port) or SheetOf.parse(named.port) is not None):
        cells = _cells(named)
        board = driver.open(named.port, named.skin, baud=named.baud, timeout=named.timeout)
        return BoardSource(board, named.port, cells=cells, simulated=_is_virtual(named.port)), None
    virtual, cells = _virtual(named), _cells(named)
    board = driver.open(virtual, None if named.port is None else named.skin, timeout=named.timeout)
    source = BoardSource(board, named.port or "a virtual sheet", virtual, cells)
    return source, Hand.on(virtual, board.sheet)


def _is_virtual(port: str) -> bool:
    return port.startswith("sim:")


def _cells(named: ViewRequest) -> LoadCells | None:
    path = named.units
    if path is None and named.port is not None and _is_virtual(named.port):
        path = Sim.parse(named.port).units
    return None if path is None else LoadCells.load(path)


def _virtual(named: ViewRequest) -> Any:
    if named.port is not None:
        if Sim.parse(named.port).pace not in (None, 1.0):
            raise ContactFPGAError(f"{named.port}: the view shows a virtual board in real time; leave out pace")
        return transport.virtual_board(named.port)
    if named.skin is not None:  # with its cover and its circuit
        return transport.virtual_board(f"sim://?scene=nothing&skin={quote(str(named.skin), safe='/')}")
    return transport.virtual_board("sim://?scene=nothing", own_skin(named.flat))


def browse(url: str) -> None:
    """Open the address in the browser through a file that only this user can read, since command lines are public."""
    with tempfile.NamedTemporaryFile("w", suffix=".html", prefix="contactfpga-", delete=False) as file:
        file.write(f"<!doctype html><title>contactfpga</title><script>location.replace({url!r})</script>\n")
    atexit.register(Path(file.name).unlink, missing_ok=True)
    threading.Thread(target=webbrowser.open, args=(Path(file.name).as_uri(),), daemon=True).start()
