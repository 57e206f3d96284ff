"""The sheet and its touches, in viser's scene."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.design.cover import Cover
from contactfpga.robot.body import BodyError, ContactSurfaces
from contactfpga.robot.haptics import LoadCells
from contactfpga.tools.view import contacts, glow, picture, ruler
from contactfpga.tools.view.fingers import Hand
from contactfpga.tools.view.limb import FOAM_MM, Limb, add_plate
from contactfpga.tools.view.sources import Moment
from contactfpga.tools.view.tiles import MM, Tiles

if TYPE_CHECKING:
    import viser

NODE = "/sheet"
FILLED = 0.86
THICK = 0.08
LABELS = 24
ANCHORS: tuple[Any, ...] = ("bottom-left", "top-right", "bottom-right", "top-left")
"""Corners of the labels at their contacts, in turn, so that those of neighbors lie apart."""

BOX = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-1.0, 0.0)])
FACES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    + [(1, 5, 7), (1, 7, 3)]
)


class Stage:
    def __init__(
        self,
        server: viser.ViserServer,
        tiles: Tiles,
        load_cells: LoadCells | None = None,
        node: str = NODE,
        carried: bool = True,
        cover: Cover | None = None,
    ):
        """``carried``: on a limb or a plate, with numbered rows and columns. ``cover``: for polygons of contacts."""
        self._load_cells = load_cells
        self._arrows: Any = None
        self.rotation, self.point_m = np.eye(3), np.zeros(3)
        """Pose of the sheet's own frame in the world."""
        self._server, self.tiles, self._node = server, tiles, node
        sheet = tiles.sheet
        self._pitch_mm = min(sheet.pitch_x_mm, sheet.pitch_y_mm)
        self._surfaces: ContactSurfaces | None = None
        with contextlib.suppress(BodyError):  # under a cover too stiff, no polygon holds a contact
            self._surfaces = ContactSurfaces(sheet, cover, surface=tiles.surface)
        self.limb = Limb(server, tiles, node) if carried and sheet.closed else None
        under_mm = 0.0 if self.limb is None else FOAM_MM
        self._lift_mm = under_mm + 0.06 * self._pitch_mm
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
        self.labeled = contacts.MOST
        self._glow = glow.Glow(server, f"{node}/glow", tiles, under_mm) if carried else None
        self._trails = picture.Trails(tiles.surface, self._lift_mm + 0.03 * self._pitch_mm)
        self._colors: np.ndarray | None = None
        if carried:
            self._carry(under_mm)

    def _carry(self, under_mm: float) -> None:
        if self.limb is None:
            add_plate(self._server, self.tiles, self._node)
        ruler.add(self._server, self._node, self.tiles, under_mm + 0.2 * self._pitch_mm)
        light(self._server, (0.3, -0.5, 1.0))

    @property
    def points_m(self) -> np.ndarray:
        tiles = self.tiles
        if self.limb is not None:
            return self.limb.points_mm * MM
        sheet = tiles.sheet
        x = np.array([-1.4, sheet.columns + 0.4])[:, None] * sheet.pitch_x_mm
        y = np.array([-1.4, sheet.rows + 0.4]) * sheet.pitch_y_mm
        points, _ = tiles.surface.place(*(each.ravel() for each in np.broadcast_arrays(x, y)))
        return np.concatenate([points, tiles.points_mm]) * MM

    def draw(self, moment: Moment, link: str = "") -> None:
        """Draw a moment, sending only changes; ``link``: name of the robot's link, for the labels."""
        zones = moment.zones
        self._color(picture.tile_colors(zones, moment.truth))
        found = picture.spots(zones, self.tiles.surface, self._lift_mm)
        rims = found.circles
        if self._surfaces is not None:
            with contextlib.suppress(BodyError):  # neither cells nor extents came
                rims = picture.outlines(self._surfaces.supports(zones), self._lift_mm)
        self._draw_lines("rims", rims, picture.CIRCLE, 3.0)
        self._draw_points(found.points)
        self._trails.add(moment.tracks)
        self._draw_lines("trails", self._trails.lines, picture.TRAIL, 2.0)
        self._draw_labels(contacts.rows(moment, link))
        self._draw_arrows(self._forces(moment))

    def draw_no_data(self, arrows: np.ndarray | None = None) -> None:
        """Draw dark cells and only these forces: touches are unknown."""
        self._color(np.tile(np.array(picture.UNKNOWN, np.uint8), (len(self.tiles.points_mm), 1)))
        for handle in (*self._lines.values(), self._points, *self._labels, self._arrows):
            if handle is not None:
                handle.visible = False
        if arrows is not None:
            self._draw_arrows(arrows)

    def _color(self, colors: np.ndarray) -> None:
        if self._colors is None or not np.array_equal(colors, self._colors):
            self.cells.batched_colors = self._colors = colors
            if self._glow is not None:
                self._glow.show(colors)
            if self.limb is not None:
                self.limb.press(picture.lit(colors))

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
            point_size=(0.18 if self._glow is not None else 0.5) * self._pitch_mm * MM,  # robots are seen from afar
            point_shape="circle",
            precision="float32",
        )

    def _draw_labels(self, rows: Sequence[contacts.Row]) -> None:
        shown = [row for row in rows if row.id is not None and row.x_mm is not None][:LABELS]
        while len(self._labels) < len(shown):
            path = f"{self._node}/contact{len(self._labels)}"
            anchor = ANCHORS[len(self._labels) % len(ANCHORS)]
            self._labels.append(self._server.scene.add_label(path, "", anchor=anchor, font_screen_scale=0.8))
        for number, (label, row) in enumerate(zip(self._labels, shown)):
            assert row.x_mm is not None
            assert row.y_mm is not None
            point, normal = self.tiles.surface.place(row.x_mm, row.y_mm)
            label.position = (np.array(point) + (self._lift_mm + 0.9 * self._pitch_mm) * np.array(normal)) * MM
            label.text = "\n".join(row.lines) if number < self.labeled else row.name
            label.visible = True
        for label in self._labels[len(shown) :]:
            label.visible = False

    def _met(self, origin_m: Any, direction: np.ndarray) -> tuple[float, float] | None:
        return self.tiles.met((np.array(origin_m) - self.point_m) @ self.rotation / MM, direction @ self.rotation)

    def press_with(self, hand: Hand) -> None:
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


EVERYWHERE, KEY, RIM = 0.9, 2.0, 0.8


def light(server: viser.ViserServer, side: tuple[float, float, float]) -> None:
    """Light from all sides, most from this one and least from the opposite, to show forms."""
    scene = server.scene
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(None)
    scene.add_light_ambient("/light/all", intensity=EVERYWHERE)
    scene.add_light_directional("/light/key", intensity=KEY, position=side)
    scene.add_light_directional("/light/rim", intensity=RIM, position=(-side[0], -side[1], -0.2 * side[2]))
