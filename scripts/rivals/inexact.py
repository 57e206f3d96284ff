"""What four public labellers do that are not exact: models of their published ideas, with none of their code.

Each takes the cells of a frame, (R, C) bool, and gives its zones as (area, sum x, sum y), in any order.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable

import numpy as np

Zone = tuple[int, int, int]
Cells = np.ndarray


@dataclasses.dataclass(frozen=True)
class Inexact:
    """A labeller of other people that gives wrong zones."""

    name: str
    url: str
    fault: str
    """What its model does wrong, a clause."""
    model: Callable[[Cells], list[Zone]]


def sums_stay(cells: Cells) -> list[Zone]:
    """Merges wait on a stack until the row is over, and sums that a label already has are not moved."""
    table, sums, above = [0], [(0, 0, 0)], [0] * (cells.shape[1] + 2)
    for y, row in enumerate(cells):
        here, stack = [0] * len(above), []
        for x in np.flatnonzero(row).tolist():
            near = {*above[x : x + 3], here[x]} - {0}
            if not near:
                table.append(len(table))
                sums.append((0, 0, 0))
            elif len(near) > 1:
                stack.append((max(near), min(near)))
            label = table[min(near, default=len(table) - 1)]
            here[x + 1], sums[label] = label, _with(sums[label], x, y)
        for merged, into in reversed(stack):
            table[merged] = into
        above = here
    return [zone for label, zone in enumerate(sums) if label and table[label] == label]


def merges_forgotten(cells: Cells, labels: int = 64) -> list[Zone]:
    """Each cell points all labels around it to the least of them, whatever they pointed to before."""
    table, sums, above = list(range(labels)), [(0, 0, 0)] * labels, [0] * (cells.shape[1] + 2)
    new = 1
    for y, row in enumerate(cells):
        here = [0] * len(above)
        for x in np.flatnonzero(row).tolist():
            near = {*above[x : x + 3], here[x]} - {0}
            label = min(near, default=new)
            if not near:
                new = min(new + 1, labels - 1)
            for one in near:
                table[one] = label
            here[x + 1], sums[label] = label, _with(sums[label], x, y)
        above = here
    zones = dict.fromkeys(range(labels), (0, 0, 0))
    for label, found in enumerate(sums):
        while table[label] != label:
            label = table[label]
        zones[label] = tuple(map(sum, zip(zones[label], found, strict=True)))  # type: ignore[assignment]
    return [zone for zone in zones.values() if zone[0]]


def few_labels(cells: Cells, labels: int = 49, names: int = 64) -> list[Zone]:
    """Two rows at a time, a label to each pair of cells; all labels that meet are renamed. The table has fewer places
    than there are labels, and cells whose label has none are lost."""
    height, width = cells.shape
    strips = np.zeros((height + height % 2, width + 2), bool)
    strips[:height, 1:-1] = cells
    table: dict[int, int] = {}
    label_of, above, opened = np.zeros(strips.shape, int), [0] * (width + 2), 0
    for y in range(0, len(strips), 2):
        before, here = 0, [0] * (width + 2)
        for x in range(1, width + 1):
            top, bottom = strips[y : y + 2, x].tolist()
            near = [before, *(above[x - 1 : x + 2] if top else ())] if top or bottom else []
            near = [one for one in near if one]
            if (top or bottom) and not near:
                near, opened = [opened % names + 1], opened + 1
                table[near[0]] = near[0]
            for one in near[1:]:
                _rename(one, near[0], table, above, here)
            label_of[y : y + 2, x] = np.where([top, bottom], near[0], 0) if near else 0
            before, here[x] = (near[0] if near else 0), (near[0] if bottom else 0)
        above = here
    kept = {name: table[name] for name in table if name <= labels}
    return _zones((kept.get(label_of[y, x + 1], 0), x, y) for y, x in np.argwhere(cells).tolist())


def _rename(old: int, new: int, table: dict[int, int], *rows: list[int]) -> None:
    for name, meant in table.items():
        if meant == old:
            table[name] = new
    for row in rows:
        row[:] = [new if one == old else one for one in row]


def short_stack(cells: Cells, depth: int = 512) -> list[Zone]:
    """Cells around a cell go onto a stack, each as often as it is seen before its turn. The counter of the stack wraps,
    and at 0 the zone counts as whole."""
    left = np.pad(cells, 1)
    stack, found, zone = [(0, 0)] * depth, [], 0
    for start in np.argwhere(left).tolist():
        if not left[tuple(start)]:
            continue
        zone, count, place = zone + 1, 0, tuple(start)
        while True:
            if left[place]:
                left[place] = False
                found.append((zone, place[1] - 1, place[0] - 1))
                for step in np.argwhere(left[place[0] - 1 : place[0] + 2, place[1] - 1 : place[1] + 2]).tolist():
                    count = (count + 1) % depth
                    stack[count] = (place[0] + step[0] - 1, place[1] + step[1] - 1)
            if not count:
                break
            place, count = stack[count], count - 1
    return _zones(found)


def _with(zone: Zone, x: int, y: int) -> Zone:
    return zone[0] + 1, zone[1] + x, zone[2] + y


def _zones(labelled: Iterable[tuple[int, int, int]]) -> list[Zone]:
    """From (label, x, y) of each cell; 0 is no label."""
    zones: dict[int, Zone] = {}
    for label, x, y in labelled:
        zones[label] = _with(zones.get(label, (0, 0, 0)), x, y)
    return [zone for label, zone in zones.items() if label]


INEXACT = (
    Inexact(
        "detectinator",
        "https://github.com/ngemily/detectinator",
        "when two labels meet, the sums of one of them stay where they are",
        sums_stay,
    ),
    Inexact(
        "ObNoDog",
        "https://github.com/jca0/ObNoDog-final",
        "a label forgets which one it was merged into when it is merged once more, and there are 63",
        merges_forgotten,
    ),
    Inexact(
        "High Throughput CLE",
        "https://github.com/richardyilin/High_Throughput_Component_Labeling_Engine",
        "its table of labels has 49 places",
        few_labels,
    ),
    Inexact(
        "CLE of the CVSD course",
        "https://github.com/harry878710/Connected-component_Labeling_CVSDproject",
        "its stack of cells to visit holds 511, and a large zone needs more",
        short_stack,
    ),
)
