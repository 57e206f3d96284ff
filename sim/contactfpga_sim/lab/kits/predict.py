"""Predictions of a kit with 95 % intervals.

Gateware and bridge times are exact up to crystal and touches. Circuit, cover and finger are drawn within
:data:`CIRCUIT` and :data:`COVER`, from 2.5 to 97.5 %.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import math
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from contactfpga.design import kits, predictions
from contactfpga.design.circuit import Circuit, falling, needed_by
from contactfpga.design.cover import load_cover
from contactfpga.design.cover.cells import Cells
from contactfpga.design.cover.felt import BODY, LENGTH_M, WIDTH_M, Force, Sheet, Touch, feel, spread_evenly
from contactfpga.design.cover.layers import BODIES, Body
from contactfpga.design.cover.patch import Ellipse, Rectangle
from contactfpga.design.cover.press import Cover
from contactfpga.design.kits import Kit
from contactfpga.design.predictions import Prediction
from contactfpga.design.sheet.extract import extracted
from contactfpga.inputs.files import write_text
from contactfpga.skin import Skin
from contactfpga_sim.apps.latency import stages
from contactfpga_sim.apps.latency.spread import MixedTimes
from contactfpga_sim.apps.latency.usb import BridgeSettings, delivered
from contactfpga_sim.lab.kits.film import LevelReader
from contactfpga_sim.model.board.compiled import CompiledBoard

DRAWS = 200
TOUCHES = 100
"""Touches or breaks in a builder's measurement."""
AWAKE_US, LONGEST_US = 700, 2000
"""First line check, and latest report of a break."""
CRYSTAL = 1e-4
PRESSED_N = 2.0
SPEED_MM_S = 150.0
"""Speed of the finger whose time until it is felt is predicted: the middle of those of the scenes."""
PLACES = tuple((x / 4, y / 4) for y in range(3) for x in range(3))
"""Finger middles, in pitches from a switch: on it, between two, among four, halfway."""
ANYWHERE = 200
"""Places of each drawn finger on its sheet."""
ROD_MM, PLATE_MM, PLATE_N = 4.0, 30.0, 20.0
"""Width of the rod on a cap, side of the plate, and the force on it."""
FINGER = f"a finger of {1e3 * LENGTH_M:g} x {1e3 * WIDTH_M:g} mm at a depth of {1e3 * BODY.depth_m:g} mm"


class Tolerance(NamedTuple):
    """What is not known of a value: a factor."""

    what: str
    low: float
    high: float
    source: str = "assumed"

    def drawn(self, rng: np.random.Generator) -> float:
        """Uniform between the limits; from a factor of two between them on, its logarithm is."""
        if self.high < 2 * self.low:
            return float(rng.uniform(self.low, self.high))
        return math.exp(rng.uniform(math.log(self.low), math.log(self.high)))


CIRCUIT = {
    "junction_pf": Tolerance("a diode's capacitance", 0.7, 1.3),
    "saturation_a": Tolerance("a diode's saturation current", 1 / 3, 3.0),
    "line_pf": Tolerance("a line's capacitance to ground", 0.7, 1.3),
    "crossing_pf": Tolerance("a crossing's capacitance", 0.7, 1.3),
    "neighbor_pf": Tolerance("capacitance between neighbors", 0.7, 1.3),
    "line_ohm": Tolerance("a line's resistance", 0.8, 1.2),
    "pin_ohm": Tolerance("a pin's resistance", 0.75, 1.25),
    "series_ohm": Tolerance("series resistors", 0.99, 1.01, "1 % parts"),
    "column_pull_ohm": Tolerance("pull-ups of columns", 0.99, 1.01, "1 % parts"),
    "row_pull_ohm": Tolerance("pull-ups of rows", 0.99, 1.01, "1 % parts"),
    "switch_ohm": Tolerance("a closed switch's resistance", 0.01, 1.0),
    "supply_v": Tolerance("the supply", 0.97, 1.03),
}
COVER = {
    "flesh": Tolerance(
        "stiffness of the finger's flesh",
        0.6,
        1.7,
        "0.07 to 0.2 MPa by 'Experimental determination of the Young's modulus for the fingers'",
    ),
    "patch": Tolerance("length and width of the finger's contact", 0.75, 1.25, "assumed: 9 to 15 mm long"),
    "depth": Tolerance("depth at which the finger has this contact", 0.75, 1.25),
    "foam": Tolerance("the foam's modulus", 0.7, 1.3),
    "curve": Tolerance("the foam's curve", 0.75, 1.25, "points of the named foams, at most 23 % off E e/(1 - e)"),
    "thickness": Tolerance("the foam's thickness", 0.9, 1.1),
    "force": Tolerance("closing force of a batch of domes", 0.9, 1.1),
    "travel": Tolerance("the domes' travel", 0.75, 1.25),
    "tilt": Tolerance("closing force of each cap as it tilts", 0.96, 1.04, "frame that holds caps within 0.05 mm"),
}
"""Tolerances by key of :func:`pressing`. Closing forces of a sheet's domes differ by the cover's ``spread`` besides."""
FILM = {
    "force": Tolerance("forces at which a batch of film reaches a resistance", 0.5, 2.0, "no maker states a curve"),
    "exponent": Tolerance("exponent of the film's law", 0.7, 1.3, "no maker states a curve"),
    "spread": Tolerance("spread from cell to cell", 0.5, 2.0, "no maker states one"),
}
"""Tolerances of resistive cells; the first stands for that of domes."""
FALLING = {
    "column_pf": Tolerance("capacitors of columns", 0.95, 1.05, "5 % parts"),
    "threshold_v": Tolerance("the pins' threshold", 1.1 / 1.4, 1.7 / 1.4, "between VIL and VIH"),
    "ruler_ohm": Tolerance("resistors of the ruler", 0.99, 1.01, "1 % parts"),
}
TRIED_OHM = 3e3, 1.5e5
"""Range of the resistors that are tried in the cells' places."""
TILT = (COVER["tilt"].high - COVER["tilt"].low) / math.sqrt(12)
"""Standard deviation of the factor that each cap has of its own."""


def predicted(kit: Kit) -> dict[str, Prediction]:
    """All predictions of a kit by name; takes some six minutes, most of them for circuits."""
    found = [*_times(kit), *_circuit(kit), *_cover(kit)]
    return {one.name: one for one in found}


UNITS = {"v": "V", "ma": "mA", "n": "N", "share": "%", "s": "1/s", "1n": "ohm", "exponent": "1", "spread": "1"}
"""Units by the end of a prediction's name, where they differ."""


def _unit(name: str) -> str:
    end = name.rpartition("_")[2]
    return UNITS.get(end, end)


def _made(name: str, what: str, values: Sequence[float], model: str, command: str) -> Prediction:
    """The first value to five digits, with the interval of the others, widened to hold it."""
    low, high = np.quantile(values[1:] or values, [0.025, 0.975])
    value, low, high = (float(f"{one:.5g}") for one in (values[0], min(low, values[0]), max(high, values[0])))
    today = datetime.date.today()
    return Prediction(name, what, _unit(name), value, low, high, model, command, today, _commit())


def _commit() -> str:
    done = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def _times(kit: Kit) -> Iterator[Prediction]:
    command = f"contactfpga latency --kit {kit.name} --exact"
    bridge = BridgeSettings(kit.board.bridge)
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
            yield _made(f"{name}_{statistic}_us", said, values + near, model, by)
    rate = board.frames_per_s
    yield _made("frames_per_s", "frames while a contact moves", [rate, 0.99 * rate, 1.01 * rate], "gateware", command)
    yield _made("frame_bytes", "bytes of a frame with one contact", [board.bytes], "gateware", command)
    edges = [1.0, 1 - CRYSTAL, 1 + CRYSTAL]
    yield _made(
        "alive_ms", "time between two edges of `alive`", edges, "gateware", f"contactfpga build --kit {kit.name}"
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


def drawn_circuit(circuit: Circuit, rng: np.random.Generator) -> Circuit:
    """A sheet within :data:`CIRCUIT`."""
    factors = {name: one.drawn(rng) for name, one in CIRCUIT.items()}
    diode = {name: getattr(circuit.diode, name) * factors.pop(name) for name in ("junction_pf", "saturation_a")}
    values = {name: getattr(circuit, name) * factor for name, factor in factors.items()}
    if circuit.falling is not None:
        parts = {name: getattr(circuit.falling, name) * one.drawn(rng) for name, one in FALLING.items()}
        values |= {"falling": dataclasses.replace(circuit.falling, **parts), "column_pull_ohm": circuit.column_pull_ohm}
    return circuit.replace(diode=dataclasses.replace(circuit.diode, **diode), **values)


NEEDED = {
    "settle_us": ("a row selected until the slowest column reads right", "settle.seconds"),
    "precharge_us": ("columns driven until they are charged", "precharge.seconds"),
    "pulled_release_us": ("pull-ups alone lift the columns after a pressed row", "pulled_release.seconds"),
    "pressed_v": ("a pressed column while its whole row is pressed", "pressed.level_v"),
    "unpressed_v": ("a column that neighbors pull after a precharge", "unpressed_v"),
    "row_ma": ("the pin of a row whose switches are all pressed", "pressed.pin_ma"),
    "row_peak_ma": ("the pin of a row while lines are charged", "row_peak_ma"),
    "column_peak_ma": ("the pin of a column while it is charged", "column_peak_ma"),
}
PROJECTED = {
    "project_us": ("rows let go until all read right", "project.seconds"),
    "touched_v": ("a touched row while one column feeds all rows", "touched.level_v"),
    "feeding_ma": ("the pin of a column that feeds all rows", "touched.pin_ma"),
}
"""Sentence and value of what :class:`~contactfpga.design.circuit.Needs` tell, the latter of a scan that reads rows."""


def _circuit(kit: Kit) -> Iterator[Prediction]:
    skin, nominal = kit.skin, extracted(kit.layout).circuit
    rng = np.random.default_rng(1)
    drawn = [nominal, *(drawn_circuit(nominal, rng) for _ in range(DRAWS))]
    if nominal.falling is not None:
        yield from _falling(kit, drawn, rng)
        return
    needs = [needed_by(skin, one) for one in drawn]
    command = f"contactfpga settle --kit {kit.name} --margin 1"
    for name, (what, value) in (NEEDED | (PROJECTED if skin.reads_rows else {})).items():
        found = [float(attrgetter(value)(one)) for one in needs]
        yield _made(name, what, [1e6 * one for one in found] if _unit(name) == "us" else found, "circuit", command)


def _falling(kit: Kit, drawn: list[Circuit], rng: np.random.Generator) -> Iterator[Prediction]:
    """What an oscilloscope, and a resistor in a cell's place, tell of columns that fall."""
    skin, lines = kit.skin, (kit.skin.row_lines, kit.skin.columns)
    here = f"python -m contactfpga_sim.lab.kits.predict {kit.name}"
    ruler_us = [1e6 * falling.ruler_s(one, *lines) for one in drawn]
    yield _made("ruler_us", "a guard row selected until the columns fall", ruler_us, "circuit", here)
    reader = LevelReader(skin)
    tried = np.geomspace(*TRIED_OHM, skin.rows * skin.columns).reshape(skin.rows, skin.columns)
    # the first circuit is the nominal one
    leaks_a = [1e-6 * falling.parts(one).leak_ua * rng.uniform(-1, 1) * (one is not drawn[0]) for one in drawn]
    maps = [reader.read(tried, one, leak_a) for one, leak_a in zip(drawn, leaks_a, strict=True)]
    for level, sixteenths in enumerate(skin.derived.rulers, 1):
        name, of = (f"_{level}", f" for level {level}") if level > 1 else ("", "")
        us = [sixteenths / falling.SIXTEENTHS * one for one in ruler_us]
        yield _made(f"sample{name}_us", f"a row selected until it is sampled{of}", us, "circuit", here)
        found = [float(tried[one >= level].max()) for one in maps]
        what = f"the largest resistor in a cell's place that the board reads at level {level}, alone"
        yield _made(f"level{name}_ohm", what, found, "gateware", here)


class Pressing(NamedTuple):
    """A cover, and the finger on it."""

    cover: Cover
    finger: Ellipse
    """Its contact at the body's depth, long along the rows."""
    body: Body


def pressing(cover: Cover, factors: Mapping[str, float]) -> Pressing:
    """A cover and a finger with values multiplied by factors.

    The keys are those of :data:`COVER`, and ``spread``; ``tilt`` is a standard deviation, such as :data:`TILT`.
    """
    of = {**dict.fromkeys([*COVER, "spread"], 1.0), "tilt": 0.0, **factors}
    switch = dataclasses.replace(
        cover.switch,
        force_n=cover.switch.force_n * of["force"],
        travel_m=cover.switch.travel_m * of["travel"],
        spread=math.hypot(cover.switch.spread * of["spread"], of["tilt"]),
    )
    flesh = BODY.flesh and BODY.flesh._replace(modulus_pa=BODY.flesh.modulus_pa * of["flesh"])
    modulus, thickness = cover.modulus_pa * of["foam"] * of["curve"], cover.thickness_m * of["thickness"]
    return Pressing(
        dataclasses.replace(cover, switch=switch, modulus_pa=modulus, thickness_m=thickness),
        Ellipse(LENGTH_M / 2 * of["patch"], WIDTH_M / 2 * of["patch"]),
        BODY._replace(depth_m=BODY.depth_m * of["depth"], flesh=flesh),
    )


def drawn_factors(rng: np.random.Generator) -> dict[str, float]:
    """Factors within :data:`COVER` for :func:`pressing`."""
    return {name: one.drawn(rng) for name, one in COVER.items()} | {"tilt": TILT}


MEASURED = {
    **{
        f"closing_{number}_n": (
            f"force of {FINGER}, long along the rows, {x:g} and {y:g} pitches off a switch's middle, when it is felt"
        )
        for number, (x, y) in enumerate(PLACES)
    },
    "closing_rod_n": f"force of a rigid rod of {ROD_MM:g} mm on the middle of a cell's cap or tile when it is felt",
    "felt_half_n": f"force from which half of all touches by {FINGER} are felt, anywhere",
    "felt_most_n": f"force from which 99 % of all touches by {FINGER} are felt, anywhere",
    "felt_share": f"touches of {PRESSED_N:g} N by {FINGER} that are felt, at those nine places",
    "first_closing_ms": (
        f"time from the first touch of the foam, on a switch, by {FINGER} at {SPEED_MM_S:g} mm/s until it is felt"
    ),
    "finger_mm": f"way of {FINGER} from its first touch of the foam to {PRESSED_N:g} N",
    "plate_mm": f"depth to which {PLATE_N:g} N press a rigid plate of {PLATE_MM:g} x {PLATE_MM:g} mm",
}
"""What a builder can measure of a cover."""


def _cover(kit: Kit) -> Iterator[Prediction]:
    stated = load_cover(kit.skin_path)
    assert stated is not None
    rng, film = np.random.default_rng(2), stated.cell
    factors = [drawn_factors(rng) for _ in range(DRAWS)]
    if film is not None:
        films = [{name: one.drawn(rng) for name, one in FILM.items()} for _ in range(DRAWS)]
        factors = [one | {"force": of["force"], "tilt": 0.0} for one, of in zip(factors, films, strict=True)]
        of_1n = [film.ohm_at_1n, *(film.ohm_at_1n * of["force"] ** film.exponent for of in films)]
        command = f"contactfpga bringup --kit {kit.name}"
        yield _made(
            "film_ohm_at_1n", "resistance of the usual cell under 1 N, by the fitted law", of_1n, "cover", command
        )
        for name, what in (("exponent", "exponent of the fitted law"), ("spread", "spread of the cells' resistances")):
            values = [getattr(film, name) * one for one in (1.0, *(of[name] for of in films))]
            yield _made(f"film_{name}", what, values, "cover", command)
    drawn = [measured(pressing(stated, one), kit.skin, seed) for seed, one in enumerate(factors)]
    usual = measured(pressing(stated, {"spread": 0.0}), kit.skin, 0) | _felt(stated, kit.skin)
    for name, what in MEASURED.items():
        command = f"contactfpga cover felt --kit {kit.name}"
        if not name.startswith("felt_"):
            command = f"python -m contactfpga_sim.lab.kits.predict {kit.name}"
        yield _made(name, what, [one[name] for one in (usual, *drawn)], "cover", command)


def _felt(cover: Cover, skin: Skin) -> dict[str, float]:
    """What the command says."""
    felt = feel(cover, sheet(skin))
    found = {"felt_half_n": felt.half, "felt_most_n": felt.most}
    return {name: force.value_n for name, force in found.items() if isinstance(force, Force)}


def sheet(skin: Skin) -> Sheet:
    return Sheet(skin.rows, skin.columns, 1e-3 * skin.pitch_x_mm, 1e-3 * skin.pitch_y_mm)


def measured(one: Pressing, skin: Skin, seed: int) -> dict[str, float]:
    """What a builder measures on the sheet of this seed, by key of :data:`MEASURED`."""
    on = sheet(skin)
    cells = Cells(one.cover, on.rows, on.columns, on.pitch_x_m, on.pitch_y_m, seed)
    indentation, plate = (
        cells.indentation([part], body)
        for part, body in (
            (one.finger, one.body),
            (Rectangle(5e-4 * PLATE_MM, 5e-4 * PLATE_MM), BODIES["rigid"]),
        )
    )
    touch = Touch(cells, one.finger, one.body)

    def closing_n(touch: Touch, *place: float) -> float:
        return float(touch.closing_n(cells.thresholds_n[None], *place)[0][0])

    x_m, y_m = on.columns // 2 * on.pitch_x_m, on.rows // 2 * on.pitch_y_m
    places = [closing_n(touch, x_m + x * on.pitch_x_m, y_m + y * on.pitch_y_m, 0.0) for x, y in PLACES]
    anywhere = [closing_n(touch, *place) for place in spread_evenly(ANYWHERE, on).tolist()]
    half, most = np.quantile(anywhere, [0.5, 0.99], method="inverted_cdf")
    return {f"closing_{number}_n": force for number, force in enumerate(places)} | {
        "closing_rod_n": closing_n(Touch(cells, Ellipse(ROD_MM / 2e3, ROD_MM / 2e3), BODIES["rigid"]), x_m, y_m, 0.0),
        "felt_half_n": float(half),
        "felt_most_n": float(most),
        "felt_share": 100 * float(np.mean(np.array(places) <= PRESSED_N)),
        "first_closing_ms": 1e6 * indentation.depth_m(places[0]) / SPEED_MM_S,
        "finger_mm": 1e3 * indentation.depth_m(PRESSED_N),
        "plate_mm": 1e3 * plate.depth_m(PLATE_N),
    }


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
