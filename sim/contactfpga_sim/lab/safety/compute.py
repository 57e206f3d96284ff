"""Every fault at every place, in every scene: reports, their times, and earlier errors."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, Mapping

import numpy as np

from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim.lab.failures.rig import GUARDED, REFERENCE
from contactfpga_sim.lab.safety import trial
from contactfpga_sim.lab.safety.catalogue import FAULTS, SheetFault
from contactfpga_sim.lab.safety.trial import Told
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.sheet.matrix import Shorts

SKINS = {"plain": REFERENCE, "guarded": GUARDED}

PHASES = (0.03, 0.37, 0.71)
"""Shares of a scan at which faults begin; the longest time counts."""


@dataclasses.dataclass(frozen=True)
class Place:
    """A fault at a place, in all scenes."""

    name: str
    scenes: Mapping[str, Told]

    @property
    def harmful(self) -> bool:
        """Whether it causes a detected error."""
        return any(told.harmful for told in self.scenes.values())

    def us(self, by: str) -> int | None:
        """Time of the report by this means: untouched if possible, else in every scene with an error."""
        rest = self.scenes["rest"].by.get(by)
        if rest is not None:
            return rest
        times = [told.by.get(by) for told in self.scenes.values() if told.harmful]
        return None if not times or None in times else max(time for time in times if time is not None)

    @property
    def wrong(self) -> int:
        """Most wrong frames without a flag."""
        return max(told.wrong for told in self.scenes.values())

    @property
    def words(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(word for told in self.scenes.values() for word in told.words))


def places(skin: Skin, fault: str) -> Iterator[tuple[str, SheetFault]]:
    yield from FAULTS[fault].places(skin).items()


def at(skin: Skin, hurt: SheetFault, name: str = "", phase: float = PHASES[0]) -> Place:
    return Place(
        name, {scene: trial.run(skin, hurt, touched, phase) for scene, touched in trial.scenes(skin, hurt).items()}
    )


@functools.cache
def found(skin: str, fault: str) -> tuple[Place, ...]:
    """All places of a fault on the Skin of this name."""
    hurts = list(places(SKINS[skin], fault))
    return tuple(at(SKINS[skin], hurt, name, PHASES[number % len(PHASES)]) for number, (name, hurt) in enumerate(hurts))


def told(skin: str, fault: str, channels: tuple[str, ...]) -> tuple[int, int]:
    """Harmful places whose fault these channels report, and all harmful places."""
    harmful = [place for place in found(skin, fault) if place.harmful]
    return sum(any(place.us(channel) is not None for channel in channels) for place in harmful), len(harmful)


TESTED = Skin.load(examples() / "fast.toml").replace(guard=True, self_test=True, fail_safe=True, alive=True)

HOST = "self_test"


def clocks(skin: Skin) -> int:
    """Clocks of the self-test at power-up, and the pin after it; no row is driven until then."""
    derived = skin.derived
    slot = 2 * derived.project_clocks + derived.settle_clocks + 8
    return (1 + skin.rows + skin.columns) * slot + 2


def told_us(hurt: SheetFault, skin: Skin = TESTED) -> float | None:
    """Time of the pin's report in us from power-up, with shorted diodes' switches pressed; None: none."""
    cells = np.zeros((1, skin.rows, skin.columns), bool)
    for cell in hurt.bare:
        cells[0][cell] = True
    with CompiledBoard(skin, ("contact",)) as board:
        board.join(Shorts(rows=hurt.joined_rows, columns=hurt.joined_columns, bridged=hurt.bare))
        board.hold(cells, clocks(skin))
        rises = board.take("contact")
    return float(rises["cycle"][0]) / skin.derived.clocks_per_us if len(rises) else None


@functools.cache
def times_at_start(fault: str) -> dict[str, float | None]:
    """Self-test report times by place; empty for other faults."""
    if FAULTS[fault].host != HOST:
        return {}
    return {name: told_us(hurt) for name, hurt in places(TESTED, fault)}
