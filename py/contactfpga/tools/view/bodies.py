"""A robot with sheets on its links, live or from a recording: each link's newest frame, and sliders for its joints."""

from __future__ import annotations

import dataclasses
import itertools
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from contactfpga import picture_style
from contactfpga.driver import driver, transport
from contactfpga.driver.board import Board
from contactfpga.inputs.values import shown
from contactfpga.robot.body import Body, BodyError, LinkContact, LinkState, packed
from contactfpga.robot.body import urdf as urdf_file
from contactfpga.robot.body.body import OpenBody
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.reader import open_board
from contactfpga.robot.body.snapshot import on_link
from contactfpga.surfaces import SurfaceError, mesh_file
from contactfpga.tools.view import contacts, controls, page, picture
from contactfpga.tools.view.cameras import Cameras, Side
from contactfpga.tools.view.fingers import Hand, Touchable
from contactfpga.tools.view.panel import MOST_N, TimelineControls, as_markdown, shortened
from contactfpga.tools.view.picture import rgb
from contactfpga.tools.view.playback import Playback
from contactfpga.tools.view.simulated import NO_REFLEX, SimulatedSource, Solid
from contactfpga.tools.view.sources import KEEPS_UP, Moment
from contactfpga.tools.view.stage import Stage, light
from contactfpga.tools.view.tiles import MM, Tiles, quaternions
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    import viser

    from contactfpga.tools.recordings import Recording
if TYPE_CHECKING:
    from xml.etree import ElementTree

    import viser

STEP_S = 0.04
TOLD_S = 0.25
TURN_RAD = 3.15
PUSH_N = 5.0
"""Of the mouse's finger, at first."""


ROBOT_SIDES = {
    name: Side(np.array(toward), np.array([0.0, 0.0, 1.0]))
    for name, toward in {
        "overview": (0.85, 0.35, 0.35),
        "front": (1.0, 0.0, 0.1),
        "side": (0.0, 1.0, 0.1),
        "back": (-1.0, 0.0, 0.1),
    }.items()
}
"""A robot faces x, with z up."""


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
        self.stage = RobotStage(server, source.body, source.solids() if isinstance(source, SimulatedSource) else ())
        self._moved: dict[str, float] | None = None
        self._move()
        page.dress(server)
        cameras = Cameras(server, ROBOT_SIDES, self.stage.points_m)
        self._trackers = {name: Tracker(gate_mm=40.0, hold_ms=100.0) for name in source.body.links}
        self.hands: dict[str, Hand] = {}
        self._push_n = PUSH_N
        self._stepped_s = self._told_s = 0.0
        self._rows: list[contacts.Row] = []
        self._table = server.gui.add_html(contacts.table(()))
        self._timeline = TimelineControls(server, source) if isinstance(source, Playback) else None
        controls.add(server, cameras, lambda: (f"contactfpga: {shortened(source.title)}", self._rows))
        self._facts = server.gui.add_markdown("")
        self._felt: dict[str, LinkState] = {}
        if isinstance(source, SimulatedSource):
            self._add_pushing(server, source)
        else:
            self._add_sliders(server)

    def _add_pushing(self, server: viser.ViserServer, source: SimulatedSource) -> None:
        """How hard the mouse pushes, which reflex acts, and a new start."""
        with server.gui.add_folder("Robot"):
            force = server.gui.add_slider("force, N", 1.0, MOST_N, 0.5, PUSH_N)
            reflex = server.gui.add_dropdown("reflex", (NO_REFLEX, *source.reflexes), initial_value=source.reflex)
            again = server.gui.add_button("Start again")

        def resize(_: Any) -> None:
            self._push_n = force.value
            for hand in self.hands.values():
                hand.resize(force_n=force.value)

        def start(_: Any) -> None:
            for hand in self.hands.values():
                hand.lift()
            source.reflex = reflex.value
            source.restart()

        force.on_update(resize)
        reflex.on_update(start)
        again.on_click(start)
        # Whoever comes first sees it from its start.
        server.on_client_connect(lambda _: source.restart() if len(server.get_clients()) == 1 else None)

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
        states = source.states()
        self._move()
        self._rows = [row for name, state in states.items() for row in self._show(name, state)]
        if self._stepped_s - self._told_s > TOLD_S:
            self._told_s = self._stepped_s
            self._table.content = contacts.table(self._rows)
            self._facts.content = as_markdown(facts(source, states, self.stage.unread))
            if self._timeline is not None:
                self._timeline.write()

    def _move(self) -> None:
        """Draw the links where they are now."""
        source = self._source
        if isinstance(source, SimulatedSource):
            self.stage.place(source.poses())
        elif source.angles != self._moved:
            self._moved = dict(source.angles)
            self.stage.move(self._moved)

    def _show(self, name: str, state: LinkState) -> list[contacts.Row]:
        """Draw a link's newest frame, and return its contacts."""
        stage, virtual, plan = self.stage.stages[name], self._source.virtual.get(name), self._source.body.links[name]
        if virtual is not None and name not in self.hands:
            self.hands[name] = Hand.on(virtual, plan.skin.sheet)
            self.hands[name].force_n = self._push_n
            stage.press_with(self.hands[name])
        if state.zones is None:
            stage.draw_no_data()
            return []
        truth = None if virtual is None else virtual.pressed
        felt = self._measured(plan, state)
        pushed = [(one.zone, one.normal_n) for one in felt or () if one.zone.x_mm is not None]
        arrows = None if felt is None else pushes(plan, felt)
        if isinstance(self._source, SimulatedSource):
            arrows = pushes(plan, self._source.sheets[name].touches)
        moment = Moment(state.zones, self._trackers[name].update(state.zones), truth, pushes=pushed, arrows=arrows)
        stage.draw(moment)
        return contacts.rows(moment, name)

    def _measured(self, plan: Plan, newest: LinkState) -> list[LinkContact] | None:
        """The contacts of the newest frame, or of the one before, where its readings have not come yet."""
        before, self._felt[plan.name] = self._felt.get(plan.name), newest
        if plan.units is None:
            return None
        for state in (newest, before):
            if state is not None and state.zones is not None and state.zones.units is not None:
                return on_link(plan, state)
        return None


def pushes(plan: Plan, contacts: Iterable[LinkContact]) -> np.ndarray:
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
        forces = f"; {source.told(name)}" if isinstance(source, SimulatedSource) else ""
        rows.append((name, f"{state}{zones}{forces}"))
    if isinstance(source, SimulatedSource) and source.share <= KEEPS_UP:
        rows.append(("simulated", f"at {source.share:.0%} of real time"))
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


ROOT = "/robot"
BONE = rgb(picture_style.GRAY)
MESHES = (*mesh_file.SUFFIXES, mesh_file.COLLADA)
MAX_MESHES = 1000
MAX_MESH_BYTES = 100_000_000
"""Of all meshes of a robot; they may have as many triangles as one alone."""
REST = "what is beyond the limit of all meshes"


@dataclasses.dataclass(frozen=True)
class Visual:
    """A mesh of a link."""

    link: str
    pose: Pose
    path: Path
    scale: tuple[float, float, float]


def visuals(urdf: Path) -> list[Visual]:
    """The meshes that a URDF names and that are there; boxes, spheres and cylinders are left out. Raises
    :class:`BodyError`, OSError."""
    found = []
    links = urdf_file.tree(urdf).findall("link")
    try:
        for link in links:
            found += [_visual(one, link.get("name", ""), urdf.parent) for one in link.findall("visual")]
    except BodyError as error:
        raise BodyError(f"{urdf}: {error}") from None
    return [visual for visual in found if visual is not None]


def _visual(element: ElementTree.Element, link: str, folder: Path) -> Visual | None:
    mesh = element.find("geometry/mesh")
    path = None if mesh is None else _path(mesh.get("filename", ""), folder)
    if path is None:
        return None
    where, origin = f"a mesh of link {shown(link)}", element.find("origin")
    shift, turn = (urdf_file.vector(origin, key, where) for key in ("xyz", "rpy"))
    return Visual(link, Pose.of(shift, turn), path, urdf_file.vector(mesh, "scale", where, "1 1 1"))


def _path(name: str, folder: Path) -> Path | None:
    try:
        path = urdf_file.located(name.removeprefix("file://"), folder)
    except BodyError:  # of a package that is not installed: the sheets can be shown all the same
        return None
    return path if path.is_file() else None


class RobotStage:
    """Links as meshes where these can be read, else as lines between joints; and a stage for each sheet."""

    def __init__(self, server: viser.ViserServer, body: Body, solids: Sequence[Solid] = ()):
        """``solids``: what is drawn in the place of the URDF's links."""
        self._server, self._body = server, body
        self._frames: dict[str, Any] = {}
        self.unread: set[str] = set()
        """Kinds of mesh files that could not be read."""
        self._meshes = self._mesh_bytes = self._triangles = 0
        self._corners: list[tuple[str, np.ndarray]] = []
        """Links with the corners of a box around a mesh, (8, 3) in m in the link's frame."""
        self._poses: Mapping[str, Pose] = {}
        scene = server.scene
        light(server, (1.0, -0.5, 1.0))
        names = [plan.frame for plan in body.links.values()]
        if solids:
            names += [solid.link for solid in solids]
        elif body.kinematics is not None:
            names = list(body.kinematics.robot.links)
        for name in dict.fromkeys(names):
            self._frames[name] = scene.add_frame(f"{ROOT}/{name}", show_axes=False)
        for visual in visuals(body.urdf) if body.urdf is not None and not solids else ():
            self._add_mesh(visual)
        for solid in solids:
            self._add(solid)
        self.stages = {name: self._add_sheet(plan) for name, plan in body.links.items()}
        self._bones: Any = None
        for name, plan in body.links.items():
            self.stages[name].rotation, self.stages[name].point_m = plan.pose.rotation, plan.pose.point_m

    def _add_mesh(self, visual: Visual) -> None:
        try:
            self._meshes += 1
            self._mesh_bytes += visual.path.stat().st_size
            if self._meshes > MAX_MESHES or self._mesh_bytes > MAX_MESH_BYTES:
                raise SurfaceError(REST)
            mesh = mesh_file.read(visual.path, "view", MESHES)
            self._triangles += len(mesh.faces)
            if self._triangles > mesh_file.MAX_TRIANGLES:
                raise SurfaceError(REST)
        except (SurfaceError, OSError) as error:
            self.unread.add(REST if str(error) == REST else visual.path.suffix)
            return
        mesh.merge_vertices()
        vertices, faces = np.asarray(mesh.vertices) * visual.scale, np.asarray(mesh.faces)
        self._add(Solid(visual.link, visual.pose, vertices, faces, rgb(picture_style.SHEET)))

    def _add(self, solid: Solid) -> None:
        box = np.array(list(itertools.product(*zip(solid.vertices_m.min(0), solid.vertices_m.max(0)))))
        self._corners.append((solid.link, solid.pose.apply(box)))
        count = len(self._frames)
        self._frames[f"{solid.link}#{count}"] = self._server.scene.add_mesh_simple(
            f"{ROOT}/{solid.link}/mesh{count}",
            solid.vertices_m,
            solid.faces,
            color=solid.color,
            wxyz=quaternions(solid.pose.rotation[None])[0],
            position=solid.pose.point_m,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _add_sheet(self, plan: Plan) -> Stage:
        node = f"{ROOT}/{plan.frame}/{plan.name}"
        wxyz = quaternions(plan.pose.rotation[None])[0]
        self._server.scene.add_frame(node, show_axes=False, wxyz=wxyz, position=plan.pose.point_m)
        return Stage(self._server, Tiles(plan.skin.sheet, plan.laid), node=node, carried=False)

    def move(self, angles: Mapping[str, float]) -> None:
        """Draw all links at these angles."""
        kinematics = self._body.kinematics
        if kinematics is None:
            return
        poses = kinematics.poses(angles)
        self.place(poses)
        joints = kinematics.robot.joints.values()
        if not joints:
            return
        bones = np.array([(poses[joint.parent].point_m, poses[joint.child].point_m) for joint in joints])
        if self._bones is None:
            self._bones = self._server.scene.add_line_segments(
                f"{ROOT}/bones", bones, BONE, thickness=2.0, thickness_units="screen"
            )
        self._bones.points = bones.astype(np.float32)

    def place(self, poses: Mapping[str, Pose]) -> None:
        """Draw the links at these poses."""
        self._poses = poses
        orientations = quaternions(np.array([pose.rotation for pose in poses.values()]))
        for name, plan in self._body.links.items():
            mine = poses[plan.frame] @ plan.pose
            self.stages[name].rotation, self.stages[name].point_m = mine.rotation, mine.point_m
        for (name, pose), wxyz in zip(poses.items(), orientations):
            if (frame := self._frames.get(name)) is not None:
                frame.wxyz, frame.position = wxyz, pose.point_m

    def points_m(self) -> np.ndarray:
        """(n, 3) around all that is drawn, where the joints put it."""
        sheets = [stage.tiles.points_mm * MM @ stage.rotation.T + stage.point_m for stage in self.stages.values()]
        meshes = [self._poses[link].apply(corners) for link, corners in self._corners]
        return np.concatenate([*sheets, *meshes])
