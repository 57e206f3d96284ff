"""What a sheet's files say is joined: Gerbers and drill read by gerbonara, drawn as images, and their copper labeled.

The reading shares no code with the layout. Which pad lies where comes from the file for the board's electrical test,
read by gerbonara as well; what is joined comes from the copper alone.
"""

import csv
import functools
import itertools
import math
import warnings
import zipfile
from collections import defaultdict

import cv2
import numpy as np
from gerbonara import ExcellonFile, GerberFile
from gerbonara.ipc356 import Netlist, PadType
from gerbonara.utils import MM

from contactfpga.design.sheet import files, lay_out
from contactfpga.design.sheet.caps import caps

PIXEL_MM = 0.05
"""A quarter of the clearance."""
SHIFT = 6


def _points(primitive):
    """The outline of a gerbonara primitive: (points, 2) in mm."""
    name = type(primitive).__name__
    if name == "Circle":
        angles = np.linspace(0, 2 * math.pi, 48, endpoint=False)
        return np.column_stack([primitive.x + primitive.r * np.cos(angles), primitive.y + primitive.r * np.sin(angles)])
    if name == "Rectangle":
        w, h = primitive.w / 2, primitive.h / 2
        c, s = math.cos(primitive.rotation), math.sin(primitive.rotation)
        corners = np.array([(-w, -h), (w, -h), (w, h), (-w, h)])
        return corners @ np.array([(c, s), (-s, c)]) + (primitive.x, primitive.y)
    assert name == "ArcPoly"
    assert not any(primitive.arc_centers)
    return np.array(primitive.outline)


class _Image:
    def __init__(self, low, high):
        self.low = np.array(low)
        self.pixels = np.zeros(np.ceil((np.array(high) - low) / PIXEL_MM).astype(int)[::-1] + 1, np.uint8)

    def _scaled(self, points):
        return np.round((np.asarray(points) - self.low) / PIXEL_MM * 2**SHIFT).astype(np.int32)

    def draw(self, primitive):
        assert primitive.polarity_dark
        if type(primitive).__name__ != "Line":
            cv2.fillPoly(self.pixels, [self._scaled(_points(primitive))], 255, shift=SHIFT)
            return
        a, b = np.array([primitive.x1, primitive.y1]), np.array([primitive.x2, primitive.y2])
        half = primitive.width / 2
        along = (b - a) / np.linalg.norm(b - a) * half
        across = np.array([-along[1], along[0]])
        cv2.fillPoly(self.pixels, [self._scaled([a + across, b + across, b - across, a - across])], 255, shift=SHIFT)
        for end in (a, b):
            center, radius = self._scaled(end), round(half / PIXEL_MM * 2**SHIFT)
            cv2.circle(self.pixels, tuple(int(v) for v in center), radius, 255, -1, shift=SHIFT)

    def labels(self):
        return cv2.connectedComponents(self.pixels, connectivity=4, ltype=cv2.CV_32S)[1]

    def at(self, labels, x, y):
        column, row = np.round((np.array([x, y]) - self.low) / PIXEL_MM).astype(int)
        return int(labels[row, column])


def drawn_layer(path, low, high):
    """A Gerber file as an image from one corner to the other."""
    image = _Image(low, high)
    for thing in GerberFile.open(path).objects:
        for primitive in thing.to_primitives(MM):
            image.draw(primitive)
    return image


def written(folder, skin, part="dome", **given):
    """Lay out a sheet and write its files into a folder, those for the board house unpacked."""
    layout = lay_out(skin, part=None if skin.ruler else part, **given)
    files.write(folder, layout, None if skin.ruler else caps(skin, layout.switch), "")
    zipfile.ZipFile(folder / "sheet-board.zip").extractall(folder)
    return layout


class TracedBoard:
    """The board in a folder of files; ``folder`` may have been tampered with."""

    def __init__(self, folder, name="sheet"):
        self.folder, self.name = folder, name
        left, bottom, right, top = self._edge()
        self._layers, self._images = {}, {}
        for side, copper in (("top", "F_Cu.gtl"), ("bottom", "B_Cu.gbl")):
            image = drawn_layer(folder / f"{name}-{copper}", (left, bottom), (right, top))
            self._layers[side], self._images[side] = image.labels(), image
        self._join()
        self._read_pads()

    def _edge(self):
        (a, b), (c, d) = GerberFile.open(self.folder / f"{self.name}-Edge_Cuts.gm1").bounding_box(MM)
        return a, b, c, d

    def _join(self):
        """Union of the labels of both sides, by the plated holes."""
        self._parent = {}
        holes = ExcellonFile.open(self.folder / f"{self.name}-PTH.drl").objects
        for hole in holes:
            x, y = MM(hole.x, hole.unit), MM(hole.y, hole.unit)
            ends = [(side, self._label(side, x, y)) for side in self._layers]
            assert all(label for _, label in ends), f"a plated hole at {x}, {y} misses its copper"
            self._parent[self._root(ends[0])] = self._root(ends[1])
        self.holes = len(holes)

    def _label(self, side, x, y):
        return self._images[side].at(self._layers[side], x, y)

    def _root(self, node):
        while self._parent.get(node, node) != node:
            node = self._parent[node]
        return node

    def copper(self, side, x, y):
        """Which piece of joined copper is at this place."""
        label = self._label(side, x, y)
        assert label, f"no copper on {side} at {x}, {y}"
        return self._root((side, label))

    def _read_pads(self):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            records = Netlist.open(self.folder / f"{self.name}.ipc").test_records
        self.pads, self.said, self.places, self._spots = defaultdict(list), {}, {}, defaultdict(list)
        for one in records:
            side = "bottom" if one.access_layer == 2 else "top"
            where = self.copper(side, MM(one.x, one.unit), MM(one.y, one.unit))
            if one.is_via:
                self.said.setdefault(where, set()).add(one.net_name)
                continue
            assert one.pad_type in (PadType.SMD_PAD, PadType.THROUGH_HOLE)
            self.pads[one.ref_des, one.pin].append(where)
            self.places[one.ref_des, one.pin] = MM(one.x, one.unit), MM(one.y, one.unit)
            self._spots[one.ref_des].append(self.places[one.ref_des, one.pin])
            self.said.setdefault(where, set()).add(one.net_name)

    def pad(self, reference, pin):
        """The copper of a part's pad; pads of the same number must be one piece."""
        (found,) = set(self.pads[reference, str(pin)])
        return found

    def rows(self, name):
        with open(self.folder / f"{self.name}-{name}.csv") as file:
            return list(csv.DictReader(file))

    @functools.cached_property
    def values(self):
        """The value of each part in the assembler's list."""
        return {name: row["Comment"] for row in self.rows("bom") for name in row["Designator"].split(",")}

    @functools.cached_property
    def switches(self):
        """Middle of each switch, by reference, in mm from the board's lower left corner."""
        return {name: self.middle(name) for name in self.parts("SW")}

    def middle(self, name):
        """Mean place of a part's pads in mm."""
        return tuple(np.mean(self._spots[name], axis=0))

    def parts(self, letter):
        """References that begin with this letter and a digit."""
        return sorted({name for name, _ in self.pads if name.rstrip("0123456789") == letter})

    @functools.cached_property
    def resistors(self):
        """By the copper at one end: (copper at the other, ohms)."""
        found = defaultdict(list)
        for name in self.parts("R"):
            a, b = self.pad(name, 1), self.pad(name, 2)
            ohms = float(self.values[name])
            found[a].append((b, ohms))
            found[b].append((a, ohms))
        return found

    @functools.cached_property
    def diodes(self):
        """Pairs of copper: anode, cathode."""
        return [(self.pad(name, 2), self.pad(name, 1)) for name in self.parts("D")]

    @functools.cached_property
    def connectors(self):
        """Copper of each wire's pins, by the wire's name."""
        found = defaultdict(set)
        for row in self.rows("connectors"):
            found[row["wire"]].add(self.pad(row["connector"], row["pin"]))
        return {name: one for name, (one,) in ((name, list(pieces)) for name, pieces in found.items())}

    def disagreements(self):
        """Nets of the electrical test's file that are not one piece of copper, or share one."""
        pieces = defaultdict(set)
        for piece, names in self.said.items():
            for name in names - {None}:
                pieces[name].add(piece)
        opened = [f"{name} is in {len(found)} pieces" for name, found in sorted(pieces.items()) if len(found) > 1]
        shorted = [f"joined: {sorted(map(str, names))}" for names in self.said.values() if len(names) > 1]
        return opened + shorted


def lines_of(board, skin):
    """Copper of each row, and of each column, found from where the switches are and how their diodes lie; and the guard
    row's and column's. Asserts that each cell has its switch and its diode."""
    masked = set(skin.mask)
    cells = set(itertools.product(range(skin.rows), range(skin.columns))) - masked
    at = {place: name for name, place in board.switches.items()}
    corner = at and (  # of cell (0, 0)
        min(x for x, _ in at) - min(column for _, column in cells) * skin.pitch_x_mm,
        max(y for _, y in at) + min(row for row, _ in cells) * skin.pitch_y_mm,
    )
    by_node = defaultdict(list)
    for anode, cathode in board.diodes:
        by_node[anode].append(("out", cathode))
        by_node[cathode].append(("in", anode))
    rows, columns = defaultdict(set), defaultdict(set)
    for row, column in itertools.product(range(skin.rows), range(skin.columns)):
        wanted = corner and (corner[0] + column * skin.pitch_x_mm, corner[1] - row * skin.pitch_y_mm)
        place = min(at, key=lambda xy: math.dist(xy, wanted), default=None)
        near = place and math.dist(place, wanted) < 2e-3
        assert bool(near) == ((row, column) not in masked), f"switch at {row}, {column}"
        if not near:
            continue
        name = at.pop(place)
        columns[column].add(board.pad(name, 1))
        node = board.pad(name, 2)
        if skin.diodes == "none":
            rows[row].add(node)
            continue
        ((way, other),) = by_node[node]
        assert way == ("out" if skin.diodes == "col2row" else "in"), f"diode at {row}, {column} lies the wrong way"
        rows[row].add(other)
    assert not at, "switches where no cell is"
    return {n: one for n, (one,) in rows.items()}, {n: one for n, (one,) in columns.items()}
