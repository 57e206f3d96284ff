"""A robot with sheets on its links, live or from a recording: each link's newest frame, and sliders for its joints."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from contactfpga.driver import driver, transport
from contactfpga.driver.board import Board
from contactfpga.robot.body import Body, Contact, LinkState, packed
from contactfpga.robot.body.body import OpenBody
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.reader import open_board
from contactfpga.robot.body.snapshot import on_link
from contactfpga.tools.view import picture
from contactfpga.tools.view.fingers import Hand, Touchable
from contactfpga.tools.view.panel import TimelineControls, as_markdown, shortened
from contactfpga.tools.view.playback import Playback
from contactfpga.tools.view.robot import RobotStage
from contactfpga.tools.view.sources import Moment
from contactfpga.tools.view.tiles import MM
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    import viser

    from contactfpga.tools.recordings import Recording

STEP_S = 0.04
TOLD_S = 0.25
TURN_RAD = 3.15


class RobotSource(Protocol):
    """A robot with boards, or a recording of them."""

    title: str
    body: Body
    angles: dict[str, float]
    """In rad, of prismatic joints in m; what the sliders set."""
    virtual: dict[str, Touchable]
    """Virtual boards, by their links."""

    def states(self) -> dict[str, LinkState]:
        """Of all links, now."""


class BodySource:
    """An open body, whose virtual boards the mouse can press."""

    def __init__(self, path: str | Path, timeout: float = 1.0):
        self.title = str(path)
        self.body = Body.load(path)
        kinematics = self.body.kinematics
        self.angles: dict[str, float] = dict.fromkeys(kinematics.joint_names if kinematics else (), 0.0)
        self.virtual: dict[str, Touchable] = {}
        self._timeout = timeout
        self._open = OpenBody(self.body, lambda _: self.angles, timeout=timeout, opened=self._opened)

    def _opened(self, plan: Plan) -> Board:
        if plan.port is None or not plan.port.startswith("sim:"):
            return open_board(plan, self._timeout)
        virtual: Any = transport.virtual_board(plan.port, plan.skin)
        self.virtual[plan.name] = virtual
        return driver.open(virtual, plan.skin, timeout=self._timeout)

    def states(self) -> dict[str, LinkState]:
        """Of all links, now."""
        return self._open.latest().links

    def close(self) -> None:
        """Give all ports back."""
        self._open.close()


class BodyView:
    """Shows a body in a server's page."""

    def __init__(self, server: viser.ViserServer, source: RobotSource):
        self._source = source
        self.stage = RobotStage(server, source.body)
        self._moved = dict(source.angles)
        self.stage.move(source.angles)
        self.stage.look(source.angles)
        self._trackers = {name: Tracker(gate_mm=40.0, hold_ms=100.0) for name in source.body.links}
        self.hands: dict[str, Hand] = {}
        self._stepped_s = self._told_s = 0.0
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.set_panel_label("contactfpga")
        self._facts = gui.add_markdown("")
        self._timeline = TimelineControls(server, source) if isinstance(source, Playback) else None
        self._felt: dict[str, LinkState] = {}
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

    def step(self) -> None:
        """Wait for a moment and draw it."""
        time.sleep(max(0.0, STEP_S - (time.monotonic() - self._stepped_s)))
        self._stepped_s = time.monotonic()
        source = self._source
        if source.angles != self._moved:
            self._moved = dict(source.angles)
            self.stage.move(self._moved)
        states = source.states()
        for name, state in states.items():
            stage, virtual = self.stage.stages[name], source.virtual.get(name)
            if virtual is not None and name not in self.hands:
                self.hands[name] = Hand.on(virtual, source.body.links[name].skin.sheet)
                stage.press_with(self.hands[name])
            if state.zones is None:
                stage.draw_no_data()
            else:
                truth = None if virtual is None else virtual.pressed
                tracks = self._trackers[name].update(state.zones)
                stage.draw(Moment(state.zones, tracks, truth, arrows=self._arrows(source.body.links[name], state)))
        if self._stepped_s - self._told_s > TOLD_S:
            self._told_s = self._stepped_s
            self._facts.content = as_markdown(facts(source, states, self.stage.unread))
            if self._timeline is not None:
                self._timeline.write()

    def _arrows(self, plan: Plan, newest: LinkState) -> np.ndarray | None:
        """Forces of the newest frame, or of the one before, where its readings have not come yet."""
        before, self._felt[plan.name] = self._felt.get(plan.name), newest
        if plan.units is None:
            return None
        for state in (newest, before):
            if state is not None and state.zones is not None and state.zones.units is not None:
                return pushes(plan, on_link(plan, state))
        return None


def pushes(plan: Plan, contacts: Iterable[Contact]) -> np.ndarray:
    """(n, 2, 3) arrows in m in the sheet's own frame, one for each contact with a force, from outside to its point."""
    arrows = []
    for one in contacts:
        if one.point_m is None or one.force_n is None or np.linalg.norm(one.force_n) < picture.LEAST_N:
            continue
        tip = (np.array(one.point_m) - plan.pose.point_m) @ plan.pose.rotation
        force = np.array(one.force_n) @ plan.pose.rotation
        arrows.append((tip - picture.MM_PER_N * MM * force, tip))
    return np.array(arrows) if arrows else np.zeros((0, 2, 3))


def facts(source: RobotSource, states: dict[str, LinkState], unread: set[str]) -> list[tuple[str, str]]:
    """Names and values, as the panel shows them."""
    rows = [("source", shortened(source.title))]
    if isinstance(source, Playback):
        rows.append(("moment", f"{source.position_s:.3f} of {source.duration_s:.3f} s"))
    if unread:
        rows.append(("meshes", f"{', '.join(sorted(unread))} cannot be read; lines between joints are drawn"))
    for name, state in states.items():
        found = 0 if state.zones is None else len(state.zones)
        zones = "" if state.zones is None else f", {found} zone{'' if found == 1 else 's'}"
        rows.append((name, f"{state}{zones}"))
    return rows


class BodyPlayer(Playback[tuple[str, Zones]]):
    """Plays all links of a robot. Raises :class:`~contactfpga.ContactFPGAError` where the recording holds no robot."""

    def __init__(self, recording: Recording, clock: Callable[[], float] = time.monotonic):
        super().__init__(recording.duration_s, clock)
        self.title = recording.path.name
        self.virtual: dict[str, Touchable] = {}  # nobody can press what was recorded
        self._recording = recording
        self._folder = tempfile.TemporaryDirectory(prefix="contactfpga-")
        try:
            self.body = packed.unpack(recording.texts(packed.ROBOT)[0], Path(self._folder.name))
        except BaseException:
            self._folder.cleanup()
            raise
        kinematics = self.body.kinematics
        self.angles: dict[str, float] = dict.fromkeys(kinematics.joint_names if kinematics else (), 0.0)
        self._newest: dict[str, tuple[float, Zones]] = {}

    def begin(self, start_s: float) -> Iterator[tuple[float, tuple[str, Zones]]]:
        self._newest = {}
        return ((seconds, (link, zones)) for seconds, link, zones in self._recording.frames(start_s))

    def follow(self, seconds: float, item: tuple[str, Zones]) -> None:
        link, zones = item
        if link in self.body.links:
            self._newest[link] = seconds, zones

    def states(self) -> dict[str, LinkState]:
        """Of all links, at the next moment."""
        self.step()
        return {name: self._state(plan) for name, plan in self.body.links.items()}

    def _state(self, plan: Plan) -> LinkState:
        if plan.name not in self._newest:
            return LinkState(None, None, "silent", "no frame up to here")
        seconds, zones = self._newest[plan.name]
        age_s = max(0.0, self.position_s - seconds)
        if zones.sheet != plan.skin.sheet:
            return LinkState(None, age_s, "mismatch", "a board of another Skin was recorded")
        if age_s > plan.silent_s:
            return LinkState(None, age_s, "silent", f"no frame for {age_s:.3f} s")
        return LinkState(zones, age_s, "ok" if age_s <= plan.late_s else "late", "", seconds)

    def close(self) -> None:
        super().close()
        self._folder.cleanup()


def holds_robot(recording: Recording) -> bool:
    """Whether a recording holds a robot with all files of its table; those of earlier versions hold the table alone."""
    texts = recording.texts(packed.ROBOT)
    return bool(texts) and set(texts[0]) != {packed.TOML}
