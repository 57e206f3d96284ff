"""Predictions of a kit with 95 % intervals.

Gateware and bridge times are exact up to crystal and touches. Circuit and cover are drawn within assumed tolerances
(:func:`drawn_circuit`, :func:`drawn_cover`), from 2.5 to 97.5 %.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import functools
import math
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from contactfpga.design import kits, predictions
from contactfpga.design.circuit import Circuit, Needs, load_circuit, needed_by
from contactfpga.design.cover import load_cover
from contactfpga.design.cover.cells import Cells
from contactfpga.design.cover.felt import LENGTH_M, WIDTH_M, Force, Sheet, feel
from contactfpga.design.cover.patch import Ellipse
from contactfpga.design.cover.press import Cover, Load
from contactfpga.design.kits import Kit
from contactfpga.design.predictions import Prediction
from contactfpga.design.sheet import lay_out
from contactfpga.design.sheet.extract import extracted
from contactfpga.driver import health
from contactfpga.inputs.files import write_text
from contactfpga.skin import Skin
from contactfpga_sim.apps.latency import stages
from contactfpga_sim.apps.latency.spread import MixedTimes
from contactfpga_sim.apps.latency.usb import BridgeSettings, delivered
from contactfpga_sim.model.board.compiled import CompiledBoard

DRAWS = 200
TOUCHES = 100
"""Touches or breaks in a builder's measurement."""
AWAKE_US, LONGEST_US = 700, 2000
"""First line check, and latest report of a break."""
CRYSTAL = 1e-4
PRESSED_N = 2.0
PLACES = tuple((x / 4, y / 4) for y in range(3) for x in range(3))
"""Finger middles, in pitches from a switch: on it, between two, among four, halfway."""
AROUND = 7
"""Rows and columns that take force."""


def predicted(kit: Kit) -> dict[str, Prediction]:
    """All predictions of a kit by name; takes a minute or two."""
    found = [*_times(kit), *_circuit(kit), *_cover(kit)]
    return {one.name: one for one in found}


def _made(name: str, what: str, unit: str, values: Sequence[float], model: str, command: str) -> Prediction:
    """The first value to five digits, with the interval of the others, widened to hold it."""
    low, high = np.quantile(values[1:] or values, [0.025, 0.975])
    value, low, high = (float(f"{one:.5g}") for one in (values[0], min(low, values[0]), max(high, values[0])))
    today = datetime.date.today()
    return Prediction(name, what, unit, value, low, high, model, command, today, _commit())


def _commit() -> str:
    done = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def _times(kit: Kit) -> Iterator[Prediction]:
    command = f"contactfpga latency --kit {kit.name} --exact"
    bridge = BridgeSettings(kit.board.bridge, health.LATENCY_MS, health.EVENT_CHAR & 0xFF)
    found = stages.measure(kit.skin, bridge, host_touches=0)
    board, us = found.board, kit.skin.clock_hz / 1e6
    usb = MixedTimes.mixed(delivered(bridge, kit.skin.clock_hz, one.stream, one.byte) for one in board.recorded)
    pin, last = (MixedTimes.of([getattr(one, name) / us for one in board.recorded]) for name in ("pin", "last"))
    broken, here = reported(kit.skin), f"python -m contactfpga_sim.lab.kits.predict {kit.name}"
    each = {
        "contact": ("touch to the pin `contact`", "touches", "gateware", pin, command),
        "last_byte": ("touch to the last byte on the wire", "touches", "gateware", last, command),
        "host": ("touch to the host's USB controller", "touches", "bridge", usb, command),
        "break": ("a line that breaks at the board to the pin `contact`", "breaks", "gateware", broken, here),
    }
    rng = np.random.default_rng(0)
    for name, (what, tries, model, times, by) in each.items():
        for statistic, share in (("median", 0.5), ("worst", 1.0)):
            tried = rng.random((DRAWS, TOUCHES))
            shares = np.quantile(tried, share, axis=1)
            values = [times.quantile(share), *(times.quantile(one) for one in shares)]
            near = [values[0] * (1 - CRYSTAL), values[0] * (1 + CRYSTAL)]
            said = f"{what}, {statistic} of {TOUCHES} {tries}"
            yield _made(f"{name}_{statistic}_us", said, "us", values + near, model, by)
    rate = board.frames_per_s
    yield _made(
        "frames_per_s", "frames while a contact moves", "1/s", [rate, 0.99 * rate, 1.01 * rate], "gateware", command
    )
    yield _made("frame_bytes", "bytes of a frame with one contact", "bytes", [board.bytes], "gateware", command)
    edges = [1.0, 1 - CRYSTAL, 1 + CRYSTAL]
    yield _made(
        "alive_ms", "time between two edges of `alive`", "ms", edges, "gateware", f"contactfpga build --kit {kit.name}"
    )


def reported(skin: Skin) -> MixedTimes:
    """Time from a break of a row or column of an untouched sheet until `contact` reports it with `fail_safe`, at any
    instant between two checks."""
    with CompiledBoard(skin, ["contact"]) as board:
        return MixedTimes.mixed([_between_checks(board, {0: 0}, {}), _between_checks(board, {}, {0: 0})])


def _between_checks(board: CompiledBoard, rows: dict[int, int], columns: dict[int, int]) -> MixedTimes:
    def told(start: int) -> int:
        board.cut({}, {})
        board.restart()
        board.run(start)
        board.take("contact")
        board.cut(rows, columns)
        board.run(LONGEST_US * clocks)
        return int(board.take("contact")["cycle"][0])

    clocks = board.skin.clock_hz // 10**6
    found = AWAKE_US * clocks
    check = missed = told(found)
    while missed - found > 1:
        middle = (found + missed) // 2
        found, missed = (middle, missed) if told(middle) == check else (found, middle)
    us = np.array([check - found, told(missed) - missed]) / clocks
    return MixedTimes(us[:1], us[1:], np.ones(1))


def _near(rng: np.random.Generator, share: float) -> float:
    return float(rng.uniform(1 - share, 1 + share))


def drawn_circuit(circuit: Circuit, rng: np.random.Generator) -> Circuit:
    """A sheet within tolerances: lines 30 %, pins 25, pulls and series resistors 1; switches from 1 ohm to the
    stated value; the diode's capacitance 30, its current a factor of 3."""
    near = functools.partial(_near, rng)
    diode = dataclasses.replace(
        circuit.diode,
        junction_pf=circuit.diode.junction_pf * near(0.3),
        saturation_a=circuit.diode.saturation_a * math.exp(rng.uniform(-1, 1) * math.log(3)),
    )
    return circuit.replace(
        line_pf=circuit.line_pf * near(0.3),
        crossing_pf=circuit.crossing_pf * near(0.3),
        neighbor_pf=circuit.neighbor_pf * near(0.3),
        line_ohm=circuit.line_ohm * near(0.2),
        pin_ohm=circuit.pin_ohm * near(0.25),
        series_ohm=circuit.series_ohm * near(0.01),
        column_pull_ohm=circuit.column_pull_ohm * near(0.01),
        row_pull_ohm=circuit.row_pull_ohm * near(0.01),
        switch_ohm=math.exp(rng.uniform(0, math.log(circuit.switch_ohm))),
        supply_v=circuit.supply_v * near(0.03),
        diode=diode,
    )


def _circuit(kit: Kit) -> Iterator[Prediction]:
    skin, stated = kit.skin, load_circuit(kit.skin_path)
    nominal = extracted(lay_out(skin, stated)).circuit
    rng = np.random.default_rng(1)
    drawn = [nominal, *(drawn_circuit(nominal, rng) for _ in range(DRAWS))]
    needs = [needed_by(skin, one) for one in drawn]
    values: dict[str, tuple[str, str, Callable[[Needs], float]]] = {
        "settle_us": (
            "a row selected until the slowest column reads right",
            "us",
            lambda one: 1e6 * one.settle.seconds,
        ),
        "precharge_us": ("columns driven until they are charged", "us", lambda one: 1e6 * one.precharge.seconds),
        "pulled_release_us": (
            "pull-ups alone lift the columns after a pressed row",
            "us",
            lambda one: 1e6 * one.pulled_release.seconds,
        ),
        "pressed_v": ("a pressed column while its whole row is pressed", "V", lambda one: one.pressed.level_v),
        "unpressed_v": ("a column that neighbors pull after a precharge", "V", lambda one: one.unpressed_v),
        "row_ma": ("the pin of a row whose switches are all pressed", "mA", lambda one: one.pressed.pin_ma),
        "row_peak_ma": ("the pin of a row while lines are charged", "mA", lambda one: one.row_peak_ma),
        "column_peak_ma": ("the pin of a column while it is charged", "mA", lambda one: one.column_peak_ma),
    }
    if skin.reads_rows:
        values |= {
            "project_us": ("rows let go until all read right", "us", lambda one: 1e6 * one.project.seconds),
            "touched_v": ("a touched row while one column feeds all rows", "V", lambda one: one.touched.level_v),
            "feeding_ma": ("the pin of a column that feeds all rows", "mA", lambda one: one.touched.pin_ma),
        }
    command = f"contactfpga settle --kit {kit.name} --margin 1"
    for name, (what, unit, of) in values.items():
        yield _made(name, what, unit, [of(one) for one in needs], "circuit", command)


def drawn_cover(cover: Cover, rng: np.random.Generator) -> Cover:
    """A cover within tolerances: domes 10 % of force and 25 of travel, foam 30 % of modulus and 10 of thickness."""
    near = functools.partial(_near, rng)
    switch = dataclasses.replace(
        cover.switch, force_n=cover.switch.force_n * near(0.1), travel_m=cover.switch.travel_m * near(0.25)
    )
    return dataclasses.replace(
        cover, switch=switch, modulus_pa=cover.modulus_pa * near(0.3), thickness_m=cover.thickness_m * near(0.1)
    )


def _cover(kit: Kit) -> Iterator[Prediction]:
    skin, nominal = kit.skin, load_cover(kit.skin_path)
    assert nominal is not None
    pitch_m = 1e-3 * skin.pitch_x_mm
    rng = np.random.default_rng(2)
    covers = [nominal, *(drawn_cover(nominal, rng) for _ in range(DRAWS))]
    closing = np.array([closing_n(cover, pitch_m, seed) for seed, cover in enumerate(covers)])
    command = f"contactfpga cover felt --kit {kit.name}"
    for number, (x, y) in enumerate(PLACES):
        what = f"force of a fingertip whose middle is {x:g} and {y:g} pitches from a switch's when it is felt"
        yield _made(f"closing_{number}_n", what, "N", list(closing[:, number]), "cover", command)
    sheet = Sheet(skin.rows, skin.columns, pitch_m, 1e-3 * skin.pitch_y_mm)
    felt = [feel(cover, sheet, places=400) for cover in covers[: 1 + DRAWS // 10]]
    for name, what in (("half", "half of all fingertips"), ("most", "99 % of all fingertips")):
        values = [force.value_n for one in felt if isinstance(force := getattr(one, name), Force)]
        yield _made(f"felt_{name}_n", f"force from which {what} are felt, anywhere", "N", values, "cover", command)
    shares = [float((100 * (one <= PRESSED_N)).mean()) for one in closing]
    what = f"touches of {PRESSED_N:g} N that are felt, at those nine places"
    yield _made("felt_share", what, "%", shares, "cover", command)


def closing_n(cover: Cover, pitch_m: float, seed: int) -> np.ndarray:
    """First closing force at each of :data:`PLACES`; the first cover has no spread."""
    if not seed:
        cover = dataclasses.replace(cover, switch=dataclasses.replace(cover.switch, spread=0.0))
    cells = Cells(cover, AROUND, AROUND, pitch_m, pitch_m, seed)
    middle = AROUND // 2 * pitch_m
    found = []
    for x, y in PLACES:
        finger = Ellipse(LENGTH_M / 2, WIDTH_M / 2, middle + x * pitch_m, middle + y * pitch_m, 0.0)
        taken = cells.forces_n([Load((finger,), 1.0)])
        with np.errstate(divide="ignore"):
            found.append(cells.thresholds_n / np.where(taken > 0, taken, np.nan))
    return np.nanmin(np.array(found), axis=(1, 2))


def main(argv: Sequence[str] | None = None) -> int:
    """Add predictions to each kit's file if they differ."""
    parser = argparse.ArgumentParser(description="Add predictions that have changed to a kit's file.")
    parser.add_argument("kit", nargs="*", metavar="KIT", help="Default: all.")
    for name in parser.parse_args(argv).kit or kits.names():
        kit = kits.kit(name)
        path = kit.folder / predictions.FILE
        before = path.read_text(encoding="utf-8") if path.exists() else HEAD.format(name=name)
        write_text(path, predictions.added(before, predicted(kit)))
        print(path)
    return 0


HEAD = """# What the {name} kit will be found to do, if the models are right; 95 % intervals. Nobody has built it yet.
# A prediction that changes is a new entry at the end: nothing above is edited.
#     python -m contactfpga_sim.lab.kits.predict {name}
"""

if __name__ == "__main__":
    sys.exit(main())
