"""A robot with sheets on its links: each link's newest frame, and sliders for its joints."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contactfpga.body import Body
from contactfpga.body.open_body import OpenBody
from contactfpga.body.plan import Plan, text
from contactfpga.body.snapshot import LinkState
from contactfpga.body.urdf import located
from contactfpga.driver import driver, transport
from contactfpga.driver.board import Board
from contactfpga.inputs import tomlfile
from contactfpga.tracking.tracker import Tracker
from contactfpga.view.fingers import Hand, Touchable
from contactfpga.view.robot import RobotStage
from contactfpga.view.sources import Moment

if TYPE_CHECKING:
    import viser

TURN_S = 0.04
TOLD_S = 0.25
FINGER = 0.9
TURN_RAD = 3.15


class BodySource:
    """An open body, whose virtual boards the mouse can press."""

    def __init__(self, path: str | Path, timeout: float = 1.0):
        self.title = str(path)
        self.body = Body.load(path)
        self.urdf = _urdf(Path(path))
        kinematics = self.body.kinematics
        self.angles: dict[str, float] = dict.fromkeys(kinematics.joint_names if kinematics else (), 0.0)
        """In rad, of prismatic joints in m; what the sliders set."""
        self.virtual: dict[str, Touchable] = {}
        """Virtual boards, by their links."""
        self._timeout = timeout
        self._lock = threading.Lock()
        self._open = OpenBody(self.body, lambda _: self.angles, timeout=timeout, opened=self._opened)

    def _opened(self, plan: Plan) -> Board:
        if plan.port is None or not plan.port.startswith("sim:"):
            return driver.open(plan.port, plan.skin, timeout=self._timeout)
        virtual: Any = transport.virtual_board(plan.port, plan.skin)
        self.virtual[plan.name] = virtual
        return driver.open(virtual, plan.skin, timeout=self._timeout)

    def states(self) -> dict[str, LinkState]:
        """Of all links, now."""
        return self._open.latest().links

    def close(self) -> None:
        """Give all ports back."""
        self._open.close()


def _urdf(path: Path) -> Path | None:
    from contactfpga.body.answer import BodyError

    values = tomlfile.load(path, BodyError)
    return located(text(values, "urdf"), path.parent) if "urdf" in values else None


class BodyView:
    """Shows a body in a server's page."""

    def __init__(self, server: viser.ViserServer, source: BodySource):
        self._source = source
        self.stage = RobotStage(server, source.body, source.urdf)
        self._moved = dict(source.angles)
        self.stage.move(source.angles)
        self.stage.look(source.angles)
        self._trackers = {name: Tracker(gate_mm=40.0, hold_ms=100.0) for name in source.body.links}
        self.hands: dict[str, Hand] = {}
        self._turned_s = self._told_s = 0.0
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.set_panel_label("contactfpga")
        self._facts = gui.add_markdown("")
        self._add_sliders(server)

    def _add_sliders(self, server: viser.ViserServer) -> None:
        body, angles = self._source.body, self._source.angles
        if body.kinematics is None:
            return
        needed = {joint for plan in body.links.values() for joint in body.kinematics.needed(plan.frame)}
        with server.gui.add_folder("Joints, rad"):
            for name in [name for name in angles if name in needed]:
                slider = server.gui.add_slider(name, -TURN_RAD, TURN_RAD, 0.01, 0.0)
                slider.on_update(lambda event: angles.__setitem__(event.target.label, event.target.value))

    def turn(self) -> None:
        """Wait for a moment and draw it."""
        time.sleep(max(0.0, TURN_S - (time.monotonic() - self._turned_s)))
        self._turned_s = time.monotonic()
        source = self._source
        if source.angles != self._moved:
            self._moved = dict(source.angles)
            self.stage.move(self._moved)
        states = source.states()
        for name, state in states.items():
            stage, virtual = self.stage.stages[name], source.virtual.get(name)
            if virtual is not None and name not in self.hands:
                sheet = source.body.links[name].skin
                self.hands[name] = Hand(virtual, FINGER * max(sheet.pitch_x_mm, sheet.pitch_y_mm))
                stage.press_with(self.hands[name])
            if state.zones is not None:
                truth = None if virtual is None else virtual.pressed
                stage.draw(Moment(state.zones, self._trackers[name].update(state.zones), truth))
        if self._turned_s - self._told_s > TOLD_S:
            self._told_s = self._turned_s
            self._facts.content = facts(source, states, self.stage.unread)


def facts(source: BodySource, states: dict[str, LinkState], unread: set[str]) -> str:
    """As the panel shows them."""
    lines = [f"**source** {source.title}  "]
    if unread:
        lines.append(f"**meshes** {', '.join(sorted(unread))} cannot be read; lines between joints are drawn  ")
    for name, state in states.items():
        zones = "" if state.zones is None else f", {len(state.zones)} zones"
        lines.append(f"**{name}** {state}{zones}  ")
    return "\n".join(lines)
