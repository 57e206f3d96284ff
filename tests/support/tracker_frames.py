"""Frames for a tracker, from zones in cells or from what is pressed."""

import numpy as np

from contactfpga import Skin, Zones
from contactfpga.wire.protocol import Frame
from contactfpga_sim.model import golden

SKIN = Skin()
FINGER = 9
"""Cells."""


def frame(time_us, places, flags=(), skin=SKIN, total=None, **options):
    """A frame of zones, each (column, row) of its barycenter in cells, or with its area in cells after them."""
    areas = [place[2] if len(place) > 2 else FINGER for place in places]
    sums = [(area, round(x * area), round(y * area)) for area, (x, y, *_) in zip(areas, places)]
    return moments(time_us, sums, flags, skin, total, **options)


def moments(time_us, sums, flags=(), skin=SKIN, total=None, before=None):
    """The same from areas and sums."""
    return Zones(
        Frame(
            sequence=0,
            time_us=time_us % (1 << 24),
            flags=frozenset(flags),
            overwritten=0,
            heard=0,
            zones=len(sums) if total is None else total,
            cells=sum(area for area, _, _ in sums),
            moments=np.array(sums, np.int64).reshape(-1, 3),
            bitmap=None,
            barycenters=None,
        ),
        skin.sheet,
        time_us,
        before,
    )


def pressed(time_us, cells, flags=(), skin=SKIN):
    """The frame of (rows, columns) bool cells, by the golden model's zones."""
    return moments(time_us, golden.zones(cells, skin.connectivity), flags, skin)


def run(tracker, frames):
    """What the tracker says after each frame."""
    return [tracker.update(one) for one in frames]


def events(said):
    """(kind, id) of all events."""
    return [(event.kind, event.id) for tracks in said for event in tracks.events]


def ids(tracks):
    """Ids by the places of the zones, from left to right."""
    return [track.id for track in sorted(tracks.active, key=lambda one: (one.zone.x_mm, one.zone.y_mm))]
