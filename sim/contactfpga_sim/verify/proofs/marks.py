"""Two marked cells of each frame in place of moments.

Moments are sums over cells, so they are right if each cell of the zone is added once, and no other.
"""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

from amaranth.hdl import Cat, Const, Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.zones import OpenRow

_MOMENTS = ("area", "sum_x")
"""Moments that have a bit for a mark each."""


def marked_skin(skin: Skin) -> Any:
    """For a labeller, in place of the Skin: its zones have a bit for each of two marks, its rows a number."""
    return SimpleNamespace(derived=_MarkedDerived(skin))


class _MarkedDerived(Derived):
    area_bits = sum_x_bits = 1
    sum_y_bits = 0
    skips = True  # rows come with their numbers


class Marks:
    """Two cells of each frame, in columns that the solver chooses once; a row's number has a bit for each one in it."""

    def __init__(self, proof: Proof, columns: int):
        self._proof = proof
        self.columns = [proof.chosen(range(columns), name) for name in ("one", "other")]
        self.passed = Signal(len(self.columns))
        """Marks that were handed over in this frame."""

    def numbers(self, dut: Any, handed: Value, last: Value) -> Signal:
        """Choose the numbers of the labeller's rows: each mark comes once in a frame at most."""
        m, y = self._proof.m, self._proof.free(len(self.columns), "y")
        m.d.comb += dut.rows.payload.y.eq(y)
        self._proof.given(~handed | (y & self.passed == 0))
        with m.If(handed):
            m.d.sync += self.passed.eq(Mux(last, 0, self.passed | y))
        return y

    def within(self, start: Value, past: Value, y: Value) -> Value:
        """Marks in columns from ``start`` to before ``past`` of row ``y``."""
        return Cat((start <= x) & (x < past) & y[i] for i, x in enumerate(self.columns))

    def weights(self, y: Value, columns: int) -> dict[str, Sequence]:
        """What each column's pressed cell of row ``y`` adds to its zone."""
        return {name: [y[i] & (self.columns[i] == x) for x in range(columns)] for i, name in enumerate(_MOMENTS)}

    def in_one_zone(self, open_row: OpenRow, met: Value) -> None:
        """Lemma: each mark is in one open zone at most, and in none unless ``met``."""
        for i, name in enumerate(_MOMENTS):
            zones = sum((leader & open_row.moments[x][name] for x, leader in enumerate(open_row.leaders())), Const(0))
            self._proof.lemma(zones <= met[i])
