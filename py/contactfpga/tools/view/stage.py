"""The sheet and what touches it, in viser's scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.robot.haptics import LoadCells
from contactfpga.tools.view import picture
from contactfpga.tools.view.fingers import Hand
from contactfpga.tools.view.sources import Moment
from contactfpga.tools.view.tiles import MM, Tiles
from contactfpga.tracking.tracks import Tracks

if TYPE_CHECKING:
    import viser

NODE = "/sheet"
FILLED = 0.9
"""Share of the pitch that a tile takes."""
THICK = 0.08
"""Its height, of the pitch."""
AMBIENT, SIDE = 1.2, 0.7
"""Lights: mostly from all sides, so that a color means the same everywhere."""
FAR, PANEL = 0.9, 0.14
"""How far the camera is from the sheet, of its diagonal, and how far it looks past it, of that."""
LABELS = 24
"""Contacts that have their number written beside them."""

BOX = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-1.0, 0.0)])
FACES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    + [(1, 5, 7), (1, 7, 3)]
)


class Stage:
    """Draws moments of one sheet."""

    def __init__(self, server: viser.ViserServer, tiles: Tiles, load_cells: LoadCells | None = None, node: str = NODE):
        self._load_cells = load_cells
        self._arrows: Any = None
        self.rotation, self.point_m = np.eye(3), np.zeros(3)
        """Where the sheet's own frame lies in the world."""
        self._server, self.tiles, self._node = server, tiles, node
        sheet = tiles.sheet
        self._pitch_mm = min(sheet.pitch_x_mm, sheet.pitch_y_mm)
        self._lift_mm = 0.06 * self._pitch_mm
        scene = server.scene
        size = np.array([sheet.pitch_x_mm * FILLED, sheet.pitch_y_mm * FILLED, self._pitch_mm * THICK])
        self.cells = scene.add_batched_meshes_simple(
            f"{node}/cells",
            BOX * size * MM,
            FACES,
            tiles.wxyzs,
            tiles.points_mm * MM,
            batched_colors=np.tile(np.array(picture.OPEN, np.uint8), (len(tiles.points_mm), 1)),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._lines: dict[str, Any] = {}
        self._points: Any = None
        self._labels: list[Any] = []
        self._trails = picture.Trails(tiles.surface, 1.5 * self._lift_mm)
        self._colors: np.ndarray | None = None

    def look(self) -> None:
        """Set light and camera of those who come so that the sheet is in view and its colors are as chosen."""
        scene = self._server.scene
        light(self._server, (0.3, -0.5, 1.0))
        tiles, camera = self.tiles, self._server.initial_camera
        normal, away, aside = (mean(each) for each in (tiles.normals, tiles.along_y, tiles.along_x))
        far = FAR * tiles.size_mm * MM
        middle = tiles.middle_mm * MM + PANEL * far * aside  # beside the panel, not under it
        camera.look_at = tuple(middle)
        camera.position = tuple(middle + far * (0.9 * normal - 0.45 * away))
        camera.near = 0.02 * far
        scene.set_up_direction(tuple(away) if abs(normal[2]) < 0.5 else (0.0, 0.0, 1.0))

    def draw(self, moment: Moment) -> None:
        """Show it. Only what differs is sent."""
        zones = moment.zones
        self._color(picture.tile_colors(zones, moment.truth))
        found = picture.spots(zones, self.tiles.surface, self._lift_mm)
        self._draw_lines("circles", found.circles, picture.CIRCLE, 3.0)
        self._draw_points(found.points)
        self._trails.add(moment.tracks)
        self._draw_lines("trails", self._trails.lines, picture.TRAIL, 2.0)
        self._draw_labels(moment.tracks)
        self._draw_arrows(self._forces(moment))

    def draw_no_data(self) -> None:
        """Dark cells and nothing on them: nobody knows what touches."""
        self._color(np.tile(np.array(picture.UNKNOWN, np.uint8), (len(self.tiles.points_mm), 1)))
        for handle in (*self._lines.values(), self._points, *self._labels, self._arrows):
            if handle is not None:
                handle.visible = False

    def _color(self, colors: np.ndarray) -> None:
        if self._colors is None or not np.array_equal(colors, self._colors):
            self.cells.batched_colors = self._colors = colors

    def _draw_lines(self, name: str, lines: np.ndarray, color: tuple[int, int, int], width: float) -> None:
        handle = self._lines.get(name)
        if not len(lines):
            if handle is not None:
                handle.visible = False
            return
        if handle is None or len(handle.points) != len(lines):
            path = f"{self._node}/{name}"
            self._lines[name] = self._server.scene.add_line_segments(
                path, lines, color, thickness=width, thickness_units="screen"
            )
            return
        handle.points = lines.astype(np.float32)
        handle.visible = True

    def _forces(self, moment: Moment) -> np.ndarray:
        """(n, 2, 3) arrows."""
        if moment.felt is not None and self._load_cells is not None:
            return picture.pushes(*moment.felt, self._load_cells, self.tiles.surface)
        return np.zeros((0, 2, 3)) if moment.arrows is None else moment.arrows

    def _draw_arrows(self, arrows: np.ndarray) -> None:
        if len(arrows):
            radius = 0.08 * self._pitch_mm * MM
            self._arrows = self._server.scene.add_arrows(
                f"{self._node}/forces",
                arrows,
                picture.PUSH,
                shaft_radius=radius,
                head_radius=2.2 * radius,
                head_length=5 * radius,
            )
        elif self._arrows is not None:
            self._arrows.visible = False

    def _draw_points(self, points: np.ndarray) -> None:
        if not len(points):
            if self._points is not None:
                self._points.visible = False
            return
        self._points = self._server.scene.add_point_cloud(
            f"{self._node}/barycenters",
            points,
            picture.CIRCLE,
            point_size=0.18 * self._pitch_mm * MM,
            point_shape="circle",
            precision="float32",
        )

    def _draw_labels(self, tracks: Tracks) -> None:
        shown = [track for track in tracks.active if track.zone.x_mm is not None][:LABELS]
        while len(self._labels) < len(shown):
            path = f"{self._node}/contact{len(self._labels)}"
            self._labels.append(self._server.scene.add_label(path, "", anchor="bottom-left"))
        for label, track in zip(self._labels, shown):
            x_mm, y_mm = track.zone.x_mm, track.zone.y_mm
            assert x_mm is not None
            assert y_mm is not None
            point, normal = self.tiles.surface.place(x_mm, y_mm)
            label.position = (np.array(point) + 0.4 * self._pitch_mm * np.array(normal)) * MM
            area = track.zone.area_cells
            label.text = f"#{track.id}: {area} cell{'' if area == 1 else 's'}"
            label.visible = True
        for label in self._labels[len(shown) :]:
            label.visible = False

    def _met(self, origin_m: Any, direction: np.ndarray) -> tuple[float, float] | None:
        """Where a ray of the world meets the sheet."""
        return self.tiles.met((np.array(origin_m) - self.point_m) @ self.rotation / MM, direction @ self.rotation)

    def press_with(self, hand: Hand) -> None:
        """Have the mouse press this sheet."""

        @self.cells.on_click
        async def click(event: Any) -> None:
            place = self._met(event.ray_origin, np.array(event.ray_direction))
            if place is not None:
                hand.click(*place)

        @self.cells.on_drag("left")
        async def drag(event: Any) -> None:
            if event.phase == "end":
                hand.drop(event.client_id)
                return
            eye = np.array(event.client.camera.position)
            begins = event.phase == "start"
            to = event.start_position if begins else event.end_position
            place = self._met(eye, np.array(to) - eye)
            if place is not None:
                hand.drag(event.client_id, *place)


def light(server: viser.ViserServer, side: tuple[float, float, float]) -> None:
    """From all sides, and a little from this one."""
    scene = server.scene
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(None)
    scene.add_light_ambient("/light/all", intensity=AMBIENT)
    scene.add_light_directional("/light/side", intensity=SIDE, position=side)


def mean(directions: np.ndarray) -> np.ndarray:
    """The direction between them, or the first one where they turn all around."""
    found = directions.mean(0)
    length = float(np.linalg.norm(found))
    unit: np.ndarray = found / length if length > 0.1 else directions[0]
    return unit
