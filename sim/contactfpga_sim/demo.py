"""The demo of ``make sim``: scenes through the gateware, each compared clock by clock with the golden model."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from contactfpga import terminal
from contactfpga.design import kits
from contactfpga.design.circuit import load_circuit
from contactfpga.design.cover import load_cover
from contactfpga.driver import driver
from contactfpga.robot.haptics import LoadCells, WithReadings, felt
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga.tools.console import interrupt, outputs, tables
from contactfpga.wire.protocol import Frame
from contactfpga_sim.apps import pool
from contactfpga_sim.model.board.receiver import frames_in
from contactfpga_sim.model.board.virtual import VirtualBoard
from contactfpga_sim.model.golden import Timeline, Trace, predict
from contactfpga_sim.model.scenes import drawing
from contactfpga_sim.model.scenes import scene as scenes
from contactfpga_sim.model.scenes.felt import UnitReadings
from contactfpga_sim.model.sheet.falling import FallingSheet
from contactfpga_sim.verify.cosim import bench_amaranth, bench_cocotb, bench_native
from contactfpga_sim.verify.cosim.compare import Mismatch, compare

FORCED, PRESSED = "pushing", "palm_and_fingers"
"""Scenes on a sheet with pressure units, and on one whose cells tell levels of force."""

LOOKS = 240
"""Clocks between two samples of the forces."""

SCANS = 4
"""Scans per run: an untouched one, then the scene."""

TOUCH_SCAN = 1

ENGINES: dict[str, Callable[[Skin, Timeline, int], Trace]] = {
    "compiled": bench_native.run,
    "Amaranth": bench_amaranth.run,
    "cocotb, Verilator": bench_cocotb.run,
}

RUNS = {
    "fingertip": ("compiled", "Amaranth", "cocotb, Verilator"),
    **{name: ("compiled",) for name in (*scenes.NAMES,) if name not in ("fingertip", "nothing")},
}
"""Engines by scene."""


@dataclasses.dataclass(frozen=True)
class DemoResult:
    skin: Skin
    scene: str
    engine: str
    cells: np.ndarray
    frame: Frame | None
    last_record: int | None
    """Clocks from the frame's last row to its last record."""
    first_byte_us: float
    last_byte_us: float
    size: int
    events: int
    """Compared events at the stage boundaries."""
    difference: str


def run(name: str, engine: str, skin: Skin) -> DemoResult:
    """Run the scene, and compare all cycles from the second scan on."""
    scan = skin.derived.frame_clocks
    scene = scenes.scene(skin, name)
    untouched = np.zeros((skin.rows, skin.columns), bool)
    frames = [untouched, *(scene(index * scan / skin.clock_hz) for index in range(SCANS - 1))]
    if skin.ruler:
        timeline = Timeline.falling(skin, _falls(name, skin))
    else:
        timeline = dataclasses.replace(Timeline.frames(skin, frames), units=_readings(name, skin, scan))
    cycles = SCANS * scan + skin.derived.max_frame_bytes * 10 * skin.derived.bit_clocks
    trace = ENGINES[engine](skin, timeline, cycles)
    try:
        events, difference = compare(predict(skin, timeline, cycles), trace), ""
    except Mismatch as mismatch:
        events, difference = 0, str(mismatch)
    first, last, size, frame = _first_touched(trace, skin)
    us = skin.clock_hz / 1e6
    touch = TOUCH_SCAN * scan
    return DemoResult(
        skin=skin,
        scene=name,
        engine=engine,
        cells=frames[TOUCH_SCAN],
        frame=frame,
        last_record=_last_record(trace, skin),
        first_byte_us=(first - touch) / us,
        last_byte_us=(last - touch) / us,
        size=size,
        events=events,
        difference=difference,
    )


def _readings(name: str, skin: Skin, scan: int) -> list[tuple[int, Sequence[int]]]:
    if not skin.units:
        return []
    read = UnitReadings(scenes.CONTACTS[name](skin), load_cells(), skin)
    return [(cycle, read(cycle / skin.clock_hz)) for cycle in range(0, SCANS * scan, LOOKS)]


def _falls(name: str, skin: Skin) -> list[np.ndarray]:
    """Clocks for :meth:`Timeline.falling`: of the kit's film at rest, then under the scene."""
    kit = kits.kit("soft")
    cover, circuit = load_cover(kit.skin_path), load_circuit(kit.skin_path)
    assert cover is not None
    assert cover.cell is not None
    assert circuit is not None
    sheet, scene = FallingSheet(skin, circuit, cover.cell), scenes.CONTACTS[name](skin)
    forces = [scenes.nothing(skin).forces_n(0.0, skin, cover), *[scene.forces_n(0.0, skin, cover)] * (SCANS - 1)]
    seconds = [sheet.times_s(sheet.ohm(force, 0.0))[:, : skin.columns] for force in forces]
    return [np.ceil(np.minimum(one, 1.0) * skin.clock_hz).astype(int) for one in seconds]


def skin_of(name: str) -> Skin:
    if name == PRESSED:
        return kits.kit("soft").skin
    if name in scenes.AROUND:
        return forearm()
    return with_force() if name == FORCED else Skin()


def with_force() -> Skin:
    return Skin.load(examples() / "force.toml")


def forearm() -> Skin:
    return Skin.load(examples() / "forearm.toml")


def load_cells() -> LoadCells:
    """Pressure units of the scene with force."""
    return LoadCells.load(examples() / "units-flat.toml")


def feel() -> str:
    """Run the scene with force through the driver; returns true and estimated forces as text."""
    skin, cells = with_force(), load_cells()
    with driver.open(VirtualBoard(skin, FORCED, units=cells), skin) as board:
        frames = WithReadings(board)
        zones = next(zones for zones in iter(frames.next, None) if len(zones) and zones.units is not None)
    found = felt(cells, zones)
    pushes = [contact.load(zones.time_us / 1e6) for contact in scenes.CONTACTS[FORCED](skin).contacts]
    true = " and ".join(f"{load.force_n:.1f} N" for load in pushes if load)
    stated = " and ".join(f"{one.normal_n:.1f} N" for one in found or ())
    return f"{FORCED}: contacts push with {true}; zones and three pressure units of 0.05 N of noise say {stated}."


def _first_touched(trace: Trace, skin: Skin) -> tuple[int, int, int, Frame | None]:
    """Cycle of the frame's first start bit, cycle of its last byte's end, bytes on the wire, and the frame."""
    for got in frames_in(skin, trace.bytes):
        if got.frame.cells:
            return got.first + 1, got.last + 1 + 10 * skin.derived.bit_clocks, got.size, got.frame
    return 0, 0, 0, None


def _last_record(trace: Trace, skin: Skin) -> int | None:
    last_rows = [cycle for cycle, _, last in trace.rows if last]
    begin, end = last_rows[TOUCH_SCAN - 1], last_rows[TOUCH_SCAN]
    window = [cycle for cycle, _, mark in trace.records if not mark and begin < cycle <= end + 4 * skin.columns]
    return window[-1] - end if window else None


SHOWN = (
    "Each scene touches a virtual sheet. The simulated gateware reads it clock by clock, and so does a plain Python "
    "model. The verdict is whether each row, zone and byte was the same, in the same clock."
)

LEGEND = (
    "last record after last row: below 0 where all zones ended before the frame's last row.",
    'touch to first and last byte: here each touch comes just as a scan begins. "touch to last byte" in README.md is '
    "the median and the worst of touches at any instant of a scan.",
)

TITLE = (
    "Reference Skin: 16x16, 12 MHz, 5 us settle, 1 us release, 3 Mbaud; pushing: on three pressure units, 6 Mbaud; "
    f"{', '.join(scenes.AROUND)}: on a closed sheet; {PRESSED}: on the soft kit, 24 MHz, 6 Mbaud"
)

HEADS = (
    *("scene", "engine", "verdict", "zones", "last record after last row", "touch to first byte", "touch to last byte"),
    *("bytes", "events compared"),
)
VERDICT = HEADS.index("verdict")


def rows_of(outcomes: list[DemoResult]) -> list[list[str]]:
    rows = [list(HEADS)]
    for out in outcomes:
        zones = "-" if out.frame is None else str(drawing.zones(out))
        late = "-" if out.last_record is None else f"{out.last_record} clocks"
        times = (f"{out.first_byte_us:.1f} us", f"{out.last_byte_us:.1f} us")
        verdict = "differs" if out.difference else "the same"
        rows.append([out.scene, out.engine, verdict, zones, late, *times, str(out.size), str(out.events)])
    return rows


def main() -> int:
    """Run every scene; returns 1 if gateware and golden model differ."""
    parser = argparse.ArgumentParser(prog="make sim", description=__doc__)
    parser.add_argument("--picture", type=Path, default=Path("build/scenes.png"), help="where the scenes are drawn")
    picture = parser.parse_args().picture
    try:
        outputs.file(picture, "--picture")
    except outputs.OutputError as error:
        terminal.say(f"make sim: {error}", sys.stderr, hang=2)
        return 1
    outcomes = _run_all()
    scenes_run = [out for out in outcomes if out.engine == "compiled"]
    terminal.console().print(drawing.in_terminal(scenes_run, terminal.of().unicode))
    wrong = [out for out in outcomes if out.difference or out.frame is None]
    terminal.say(SHOWN)
    styles = {number: "red" for number, out in enumerate(outcomes) if out in wrong}
    tables.show(rows_of(outcomes), keys=3, title=TITLE, texts=(VERDICT,), styles=styles)
    for line in LEGEND:
        terminal.say(line, hang=2)
    if FORCED in RUNS:
        terminal.say(feel(), hang=2)
    for out in wrong:
        terminal.say(f"{out.scene}, {out.engine}: {out.difference or 'no touched frame came'}", hang=2)
    if wrong:
        terminal.say(f"{len(wrong)} of {len(outcomes)} runs differ from the golden model")
    else:
        terminal.say(f"All {len(outcomes)} runs agree with the golden model in every clock.")
    drawing.to_file(scenes_run, picture)
    terminal.say(f"Scenes and their zones: {picture}")
    if not wrong:
        terminal.say("Next, a virtual sheet in your browser, which the mouse presses:\n.venv/bin/contactfpga view")
    return 1 if wrong else 0


def _run_all() -> list[DemoResult]:
    runs = [(name, engine) for name, engines in RUNS.items() for engine in engines if _available(engine)]
    outcomes = []
    with pool.progress() as step:
        for name, engine in runs:
            outcomes.append(run(name, engine, skin_of(name)))
            step("scenes", len(runs))
    return outcomes


def _available(engine: str) -> bool:
    if engine.startswith("cocotb") and not bench_cocotb.available("verilator"):
        terminal.say(
            f"{engine}: left out: it needs Verilator, perl, make and c++, and a path without spaces and quotes"
        )
        return False
    return True


if __name__ == "__main__":
    interrupt.leave(interrupt.guarded(main))
