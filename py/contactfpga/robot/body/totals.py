"""What came of all links of a body: counted, and as arrays."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, overload

from contactfpga.driver.stats import Stats, total
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from contactfpga.robot.body.snapshot import Snapshot


@dataclasses.dataclass
class BodyStats(Stats):
    """Counters of all links together, since the body was opened. A board that came back goes on counting."""

    links: dict[str, Stats] = dataclasses.field(default_factory=dict)
    """Each link's own."""

    @classmethod
    def of(cls, links: Mapping[str, Stats]) -> BodyStats:
        """The sum of these."""
        return cls(**vars(total(links.values())), links=dict(links))

    def to_dict(self) -> dict[str, object]:
        return super().to_dict() | {"links": {name: one.to_dict() for name, one in self.links.items()}}


class SnapshotBatch(Sequence["Snapshot"]):
    """Consecutive snapshots, and the frames in them as arrays."""

    def __init__(self, snapshots: Iterable[Snapshot]):
        self._snapshots = tuple(snapshots)
        self.links: dict[str, Batch] = {}
        """Of each link every frame once, in order, as :class:`~contactfpga.Batch`; a link without one is left out."""
        for name in self._snapshots[0].links:
            frames = _frames(name, self._snapshots)
            if frames:
                self.links[name] = Batch.of(frames)

    @overload
    def __getitem__(self, index: int) -> Snapshot: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Snapshot]: ...
    def __getitem__(self, index: int | slice) -> Snapshot | Sequence[Snapshot]:
        return self._snapshots[index]

    def __len__(self) -> int:
        return len(self._snapshots)


def _frames(link: str, snapshots: Iterable[Snapshot]) -> list[Zones]:
    found: list[Zones] = []
    for snapshot in snapshots:
        zones = snapshot.links[link].zones
        if zones is not None and (not found or zones is not found[-1]):
            found.append(zones)
    return found
