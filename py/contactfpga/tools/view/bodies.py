"""A robot with sheets on its links, live or recorded."""

from __future__ import annotations

import abc
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from contactfpga.driver import driver, transport
from contactfpga.driver.board import Board
from contactfpga.robot.body import Body, LinkContact, LinkState, robot_texts
from contactfpga.robot.body.body import OpenBody
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.reader import open_board
from contactfpga.robot.body.snapshot import on_link
from contactfpga.tools.view import contacts, controls, page, picture
from contactfpga.tools.view.cameras import Cameras, Side
from contactfpga.tools.view.fingers import Hand, Touchable
from contactfpga.tools.view.panel import TimelineControls, as_markdown, shortened
from contactfpga.tools.view.playback import Playback
from contactfpga.tools.view.robot_stage import RobotStage
from contactfpga.tools.view.sources import Moment
from contactfpga.tools.view.stage import light
from contactfpga.tools.view.tiles import MM
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    import viser

    from contactfpga.tools.recordings.recording import Recording

STEP_S = 0.04
WRITTEN_S = 0.25
TURN_RAD = 3.15

OVERVIEW = "overview"
ROBOT_SIDES = {
    name: Side(np.array(toward), np.array([0.0, 0.0, 1.0]))
    for name, toward in {
        OVERVIEW: (0.85, 0.35, 0.35),
        "front": (1.0, 0.0, 0.1),
        "side": (0.0, 1.0, 0.1),
        "back": (-1.0, 0.0, 0.1),
    }.items()
}


class RobotSource(Protocol):
    """A robot with boards, or a recording of them."""

    title: str
    body: Body
    angles: dict[str, float]
    """Angles set by the sliders, in rad, in m for prismatic joints."""
    virtual: dict[str, Touchable]

    def states(self) -> dict[str, LinkState]:
        """Current states of all links."""


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
        return self._open.latest().links

    def close(self) -> None:
        self._open.close()


class DrawnRobot:
    """A robot's sheets with their touches, frame by frame."""

    def __init__(self, stage: RobotStage, links: Mapping[str, Plan]):
        self.stage, self._links = stage, links
        self._trackers = {name: Tracker(gate_mm=40.0, hold_ms=100.0) for name in links}
        self._felt: dict[str, LinkState] = {}

    def draw(
        self,
        name: str,
        state: LinkState,
        truth: np.ndarray | None = None,
        arrows: np.ndarray | None = None,
        label: str | None = None,
    ) -> list[contacts.Row]:
        """Draw a link's newest frame; returns its contacts. ``truth``: (rows, columns) closed switches, if known;
        ``arrows``: (n, 2, 3) forces in m in the sheet's frame, replacing those that units measure; ``label``: the
        link's name at its contacts and in their rows.
        """
        stage, plan = self.stage.stages[name], self._links[name]
        if state.zones is None:
            stage.draw_no_data(arrows)
            return []
        felt = self._measured(plan, state)
        pushed = [(one.zone, one.normal_n) for one in felt or () if one.zone.x_mm is not None]
        if arrows is None and felt is not None:
            arrows = pushes(plan, felt)
        moment = Moment(state.zones, self._trackers[name].update(state.zones), truth, pushes=pushed, arrows=arrows)
        named = name if label is None else label
        stage.draw(moment, named)
        return contacts.rows(moment, named)

    def _measured(self, plan: Plan, newest: LinkState) -> list[LinkContact] | None:
        """The newest contacts, of the previous frame until readings arrive."""
        before, self._felt[plan.name] = self._felt.get(plan.name), newest
        if plan.units is None:
            return None
        for state in (newest, before):
            if state is not None and state.zones is not None and state.zones.units is not None:
                return on_link(plan, state)
        return None


class RobotView(abc.ABC):
    """A robot in a server's page, with its contacts and further facts."""

    stage: RobotStage

    def __init__(self, server: viser.ViserServer, points: Callable[[], np.ndarray]):
        """``points``: (n, 3) in m, for cameras to hold."""
        page.dress(server)
        light(server, (1.0, -0.5, 1.0))
        self.cameras = Cameras(server, dict(ROBOT_SIDES), points)
        self._stepped_s = self._written_s = 0.0
        self._rows: list[contacts.Row] = []
        self._table = server.gui.add_html(contacts.table(()))

    def _add_rest(self, server: viser.ViserServer, title: str) -> None:
        controls.add(server, self.cameras, lambda: (f"contactfpga: {shortened(title)}", self._rows))
        self._facts = server.gui.add_markdown("")

    def step(self) -> None:
        time.sleep(max(0.0, STEP_S - (time.monotonic() - self._stepped_s)))
        self._stepped_s = time.monotonic()
        self._rows = self.draw()
        if self._stepped_s - self._written_s > WRITTEN_S:
            self._written_s = self._stepped_s
            self.tell()

    @abc.abstractmethod
    def draw(self) -> list[contacts.Row]:
        """Draw the next moment; returns all contacts."""

    def tell(self) -> None:
        self._table.content = contacts.table(self._rows)
        self._facts.content = as_markdown(self.facts())

    @abc.abstractmethod
    def facts(self) -> list[tuple[str, str]]:
        """Names and values in the panel."""


class BodyView(RobotView):
    def __init__(self, server: viser.ViserServer, source: RobotSource):
        self._source = source
        self.stage = RobotStage(server, source.body)
        self._robot = DrawnRobot(self.stage, source.body.links)
        self._moved: dict[str, float] | None = None
        self._move()
        super().__init__(server, self.stage.points_m)
        self._states: dict[str, LinkState] = {}
        self.hands: dict[str, Hand] = {}
        self._timeline = TimelineControls(server, source) if isinstance(source, Playback) else None
        self._add_rest(server, source.title)
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

    def draw(self) -> list[contacts.Row]:
        self._states = self._source.states()
        self._move()
        return [row for name, state in self._states.items() for row in self._draw(name, state)]

    def _move(self) -> None:
        if self._source.angles != self._moved:
            self._moved = dict(self._source.angles)
            self.stage.move(self._moved)

    def _draw(self, name: str, state: LinkState) -> list[contacts.Row]:
        virtual = self._source.virtual.get(name)
        if virtual is not None and name not in self.hands:
            self.hands[name] = Hand.on(virtual, self._source.body.links[name].skin.sheet)
            self.stage.stages[name].press_with(self.hands[name])
        return self._robot.draw(name, state, None if virtual is None else virtual.pressed)

    def tell(self) -> None:
        super().tell()
        if self._timeline is not None:
            self._timeline.write()

    def facts(self) -> list[tuple[str, str]]:
        source = self._source
        rows = [("source", shortened(source.title))]
        if isinstance(source, Playback):
            rows.append(("moment", f"{source.position_s:.3f} of {source.duration_s:.3f} s"))
        if left_out := self.stage.left_out():
            rows.append(("meshes", left_out))
        return rows + [(name, state_line(state)) for name, state in self._states.items()]


def state_line(state: LinkState) -> str:
    found = 0 if state.zones is None else len(state.zones)
    zones = "" if state.zones is None else f", {found} zone{'' if found == 1 else 's'}"
    return f"{state}{zones}"


def pushes(plan: Plan, contacts: Iterable[LinkContact]) -> np.ndarray:
    """(n, 2, 3) arrows in m in the sheet's own frame, one per contact with a force, from outside to its point."""
    arrows = []
    for one in contacts:
        if one.point_m is None or one.force_n is None or np.linalg.norm(one.force_n) < picture.LEAST_N:
            continue
        tip = (np.array(one.point_m) - plan.pose.point_m) @ plan.pose.rotation
        force = np.array(one.force_n) @ plan.pose.rotation
        arrows.append((tip - picture.MM_PER_N * MM * force, tip))
    return np.array(arrows) if arrows else np.zeros((0, 2, 3))


class BodyPlayer(Playback[tuple[str, Zones]]):
    """Plays all links of a robot. Raises :class:`~contactfpga.ContactFPGAError` for a recording without a robot."""

    def __init__(self, recording: Recording, clock: Callable[[], float] = time.monotonic):
        super().__init__(recording.duration_s, clock)
        self.title = recording.path.name
        self.virtual: dict[str, Touchable] = {}  # nobody can press what was recorded
        self._recording = recording
        self._folder = tempfile.TemporaryDirectory(prefix="contactfpga-")
        try:
            self.body = robot_texts.unpack(recording.texts(robot_texts.ROBOT)[0], Path(self._folder.name))
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
        """States of all links at the next moment."""
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
    """Whether a recording has a robot with all files of its table, which earlier versions omitted."""
    texts = recording.texts(robot_texts.ROBOT)
    return bool(texts) and set(texts[0]) != {robot_texts.TOML}
