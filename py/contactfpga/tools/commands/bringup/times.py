"""The bring-up's steps that measure settle times and fit the circuit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from contactfpga.design.circuit import CircuitError
from contactfpga.design.circuit.fit import SettleReading, fit_circuit
from contactfpga.design.circuit.values import LIMITS
from contactfpga.driver.health import Finding
from contactfpga.errors import ContactFPGAError
from contactfpga.instruments.settling import NEAR, Settling
from contactfpga.tools.commands.bringup.bench import Bench, Step
from contactfpga.tools.commands.wire import settle


def settling(bench: Bench) -> Step:
    """Times of cells to read pressed, with half of the columns and with all."""
    skin, per_us = bench.skin, bench.skin.derived.clocks_per_us
    found: list[Finding] = []
    measured: dict[str, float] = {}
    wanted = (
        ("card", "Lay a stiff card over the first half of the columns, on all rows, and press it down."),
        ("plate", "Lay a plate over the whole sheet and press it down."),
    )
    for does, words in wanted:
        seconds = bench.person.asked(does, words)
        bench.images[does] = image = settle.settling(bench.board, skin)
        _, end = settle.follow(bench.board, image, bench.timeout, seconds, enough=_Rested(bench, image))
        found += end
        known = image.clocks[image.clocks > 0]
        if not len(known):
            found.append(
                Finding("fault", f"no cell read pressed for long enough under the {does}; press it down evenly")
            )
            continue
        found.append(Finding("ok", f"{len(known)} cells under the {does}: {known.max() / per_us:.3f} us at most"))
    if "plate" in bench.images and (plate := bench.images["plate"].clocks).any():
        measured["settle_us"] = float(plate.max() - 0.5) / per_us
        measured["settle_us_step"] = 1 / per_us
        found += _slow(bench.images["plate"], per_us)
        if plate.max() > NEAR * skin.derived.settle_clocks:
            found.append(
                Finding("fault", f"settle_us = {skin.settle_us:g} leaves too little room; `contactfpga wire --settle`")
            )
    return Step("settle times", tuple(found), measured)


class _Rested:
    """Whether an image is complete and unchanged for a person's rest time."""

    def __init__(self, bench: Bench, image: Settling):
        self._bench, self._image = bench, image
        self._since_s = bench.board.clock()

    def __call__(self) -> bool:
        now_s = self._bench.board.clock()
        if self._image.next_clocks() is not None or not self._image.clocks.any():
            self._since_s = now_s
        return now_s - self._since_s > self._bench.person.rest_s


def _slow(image: Settling, per_us: int) -> Iterator[Finding]:
    slow = image.slow()
    if 2 * len(slow.cells) > (image.clocks > 0).sum():
        yield Finding("fault", "most cells take nearly the whole settle time: it is short for this sheet")
        return
    for kind, numbers in (("row", slow.rows), ("column", slow.columns)):
        for number in numbers:
            yield Finding("fault", f"slow {kind} {number}: a long or thin line, a cold joint, or a weak pin")
    for row, column in slow.cells:
        if row not in slow.rows and column not in slow.columns:
            us = image.clocks[row, column] / per_us
            yield Finding("fault", f"slow cell ({row}, {column}), {us:.2f} us: a contact of high resistance")


def circuit(bench: Bench) -> Step:
    """The values of [circuit] by the settle images."""
    skin = bench.skin
    if bench.stated is None:
        return Step("circuit", (Finding("note", "the kit states no [circuit] to compare with"),))
    faults = bench.board.faults
    alone = faults is not None and "guard column open" in faults.names
    broken = () if faults is None or alone else faults.rows_open
    guard = skin.guard and not alone
    readings = [_reading(image, broken, guard) for image in bench.images.values() if image.clocks.any()]
    fast = [one for one in readings if (one.clocks[one.clocks > 0] <= one.first).any()]
    found = [
        Finding(
            "note", f"with {one.pressed} switches pressed in a row, cells are too fast for the board's clock to tell"
        )
        for one in fast
    ]
    try:
        usable = [one for one in readings if one not in fast]
        if not usable:
            raise CircuitError("no settle image tells anything")
        lines = skin.row_lines, skin.column_lines
        bench.fitted = fit_circuit(bench.stated, usable, skin.clock_hz, *lines, skin.diodes, bench.probability)
    except ContactFPGAError as error:
        found.append(Finding("note", f"[circuit] is not fitted: {error}"))
        return Step("circuit", tuple(found))
    values = {}
    for one in bench.fitted.values:
        if not one.determined:
            unit = LIMITS[one.name][2]
            vague = f"{one.name} cannot be told better than {one.low:.4g} to {one.high:.4g} {unit} with this clock"
            found.append(Finding("note", vague))
            continue
        values[one.name] = one.value
        given = getattr(bench.stated, one.name)
        inside = "as stated" if one.low <= given <= one.high else f"not the {given:g} that the kit states"
        found.append(Finding("ok", f"{one.name} = {one.value:.4g} ({one.low:.4g} to {one.high:.4g}), {inside}"))
    if len(bench.fitted.values) < 2:
        found.append(Finding("note", "switch_ohm cannot be told from one settle image; it was taken as stated"))
    return Step("circuit", tuple(found), values)


def _reading(image: Settling, broken: Sequence[int], guard: bool) -> SettleReading:
    """Rows with the most common number of pressed switches, without slow or broken lines. ``guard``: each row also
    drives a guard column.
    """
    counts = (image.clocks > 0).sum(axis=1)
    usual = int(np.bincount(counts[counts > 0]).argmax())
    clocks, slow = image.clocks.copy(), image.slow()
    clocks[counts != usual], clocks[[*slow.rows, *broken]], clocks[:, slow.columns] = 0, 0, 0
    return SettleReading(usual + guard, clocks, image.first)
