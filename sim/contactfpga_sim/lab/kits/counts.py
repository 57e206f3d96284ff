"""Shares of scenes in which contacts are miscounted, on the kits' own sheets and on the paper's parts beside them."""

from __future__ import annotations

import functools
from concurrent.futures import Executor
from typing import NamedTuple

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.apps import errors, result_cache
from contactfpga_sim.apps.stats import Rate
from contactfpga_sim.model.scenes.families import placements

PIECE = 250
SEED = 0


class Drawn(NamedTuple):
    name: str
    family: str
    scenes: int
    """How many are drawn."""
    force_n: tuple[float, float] | None = None
    """Range of each finger's force; None: the family's own."""


FINGERS = Drawn("two to five fingers of 2 to 20 N", "fingers", 4000, (2.0, 20.0))
SCENES = (
    FINGERS,
    Drawn("two to five fingers of 1 to 3 N", "fingers", 4000, (1.0, 3.0)),
    Drawn("two fingers 10 mm apart, 5 to 20 N", "pair", 1000),
    Drawn("a forearm, 5 to 50 N", "bumper", 1000),
    Drawn("the edge of a box, 10 to 60 N", "edge", 1000),
    Drawn("a flat hand, 20 to 80 N", "palm", 500),
)


def miscounted(skin: Skin, cover: Cover | None, drawn: Drawn, workers: Executor) -> Rate:
    """Scenes whose number of zones is not that of their contacts."""
    piece = functools.partial(_wrong, skin, cover, drawn)
    return Rate(sum(workers.map(piece, range(0, drawn.scenes, PIECE))), drawn.scenes)


def share(rate: Rate) -> str:
    """A share in % with its 95 % interval."""
    low, high = rate.interval()
    return f"{100 * rate.hits / rate.of:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def _wrong(skin: Skin, cover: Cover | None, drawn: Drawn, first: int) -> int:
    def new() -> int:
        options = {} if drawn.force_n is None else {"force_n": drawn.force_n}
        scenes = placements(drawn.family, min(PIECE, drawn.scenes - first), SEED, skin, first, **options)
        looks = (errors.look(scene, 0.0, skin, cover) for scene in scenes)
        return sum(len(errors.method_zones(cells, skin)) != len(there) for cells, there in looks)

    key = f"{result_cache.made_by(__name__, skin)} {drawn} {SEED} {first} {cover}"
    found: int = result_cache.cached("miscounts", key, new)
    return found
