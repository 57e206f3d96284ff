"""Models of other sensors under the same mechanics. Analog readings, microcontroller times and part costs are assumed,
not measured."""

from __future__ import annotations

import dataclasses
import functools
import math
import zlib
from collections.abc import Callable

import numpy as np

from contactfpga.design.cover import Cap, Cover, Switch, cells_of
from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES
from contactfpga.zones import labels
from contactfpga_sim.lab.chart import errors
from contactfpga_sim.lab.chart.errors import Blob
from contactfpga_sim.model.scenes.scene import Scene

Random = np.random.Generator
Readings = Callable[[Scene, float, Skin, Cover | None, Random], np.ndarray]
"""(R, C) readings at a time in s, above 0 where touched."""

STRIPS = 4
"""Groups of rows, each read at the middle of its time."""

HALVINGS = 14

# ---- an analog array

BITS = 8
FULL_N = 10.0
NOISE_COUNTS = 1.0
CROSSTALK = 0.01
"""Share of a force read by each of four neighbors."""
GAIN_SPREAD = 0.05
"""Relative standard deviation of calibrated gains."""
THRESHOLD_N = 0.4
"""Force that touches an element, the closing force of the studies' domes."""
HEAD_BYTES = 4
"""Header of an array's frame, which has a byte per element."""

# ---- a microcontroller: 64 pins, about 50 of them for lines; USB is full speed

MCU_HZ = 100e6
ROW_CYCLES = 60
"""Cycles to drive a row, wait, and read a port or two."""
CELL_CYCLES = 15
"""Cycles to store and label a cell in software."""
SEND_CYCLES = 500
"""Cycles to make a frame for UART or USB; sending it overlaps the next scan."""
USB_SLOT_US, USB_BIT_US = 1000.0, 1 / 12

# ---- rough prices of parts in USD, boards and the elements themselves not counted: assumed, no offers

FPGA_USD, MCU_USD, CONVERTER_USD = 8.0, 4.0, 6.0
DIODE_USD, AMPLIFIER_USD = 0.02, 0.8


@dataclasses.dataclass(frozen=True)
class Pace:
    """Times in us; scans repeat, and the newest ready one is sent."""

    scan_us: float
    """Time from first row to last, evenly spread."""
    work_us: float
    """Time from a scan's end until its frame is ready."""
    loop_us: float
    wire_us: float
    slot_us: float = 0.0
    """Interval of sending instants; 0: any."""


@dataclasses.dataclass(frozen=True)
class Rival:
    note: str
    readings: Readings
    pace: Callable[[Skin], Pace]
    cost_usd: Callable[[Skin], float]

    def wires(self, skin: Skin) -> int:
        return skin.rows + skin.columns

    def zones(self, scene: Scene, skin: Skin, cover: Cover | None) -> list[Blob]:
        """Zones once all forces have risen; the scene seeds the noise."""
        rng = np.random.default_rng(zlib.crc32(repr(scene).encode()))
        return _blobs(self.readings(scene, scene.settled_s, skin, cover, rng), skin)

    def errors(self, scene: Scene, skin: Skin, cover: Cover | None) -> errors.Errors:
        there = errors.contacts(scene.truth(scene.settled_s, skin))
        return errors.errors(self.zones(scene, skin, cover), there)

    def time_us(self, scene: Scene, skin: Skin, cover: Cover | None, rng: Random) -> float:
        """Time from the foam's first touch, at 0 s of a scene with rising forces, to the last byte of the first
        frame with a contact; infinite if none. ``rng`` draws the scan's phase."""
        first_s = self._first_s(scene, skin, cover, rng)
        if not math.isfinite(first_s):
            return math.inf
        pace = self.pace(skin)
        late, slot = rng.random() * pace.loop_us, rng.random() * pace.slot_us
        latest = pace.scan_us + pace.work_us - late  # when the scan with number 0 is ready
        number = max(0, math.floor((first_s * 1e6 + late) / pace.loop_us) - 1)
        free = number * pace.loop_us + rng.random() * pace.wire_us
        end = scene.settled_s * 1e6 + 20 * (pace.loop_us + pace.wire_us + pace.slot_us)
        while free < end:
            ready = max(free, number * pace.loop_us + latest)
            sent = slot + math.ceil((ready - slot) / pace.slot_us) * pace.slot_us if pace.slot_us else ready
            number = max(number, math.floor((sent - latest) / pace.loop_us))
            free = sent + pace.wire_us
            if self._scanned(scene, number * pace.loop_us - late, pace.scan_us, skin, cover, rng).any():
                return free
            number += 1
        return math.inf

    def _first_s(self, scene: Scene, skin: Skin, cover: Cover | None, rng: Random) -> float:
        """Time in s at which the first element is touched; infinite if never."""

        def touched(seconds: float) -> bool:
            return bool(self.readings(scene, seconds, skin, cover, rng).any())

        before, first = 0.0, scene.settled_s
        if not touched(first):
            return math.inf
        for _ in range(HALVINGS if first else 0):
            middle = (before + first) / 2
            before, first = (before, middle) if touched(middle) else (middle, first)
        return before

    def _scanned(
        self, scene: Scene, begin_us: float, scan_us: float, skin: Skin, cover: Cover | None, rng: Random
    ) -> np.ndarray:
        found = np.zeros((skin.rows, skin.columns))
        for number, rows in enumerate(np.array_split(np.arange(skin.rows), STRIPS)):
            seconds = (begin_us + (number + 0.5) / STRIPS * scan_us) * 1e-6
            if len(rows) and seconds >= 0:
                found[rows] = self.readings(scene, seconds, skin, cover, rng)[rows]
        return found


def _blobs(readings: np.ndarray, skin: Skin) -> list[Blob]:
    numbers = labels.label(readings > 0, skin.connectivity).ravel()
    count = int(numbers.max(initial=0))
    rows, columns = (axis.ravel() for axis in np.indices(readings.shape))
    weight = np.bincount(numbers, readings.ravel(), count + 1)[1:]
    x, y = (np.bincount(numbers, readings.ravel() * axis, count + 1)[1:] / weight for axis in (columns, rows))
    area = np.bincount(numbers, minlength=count + 1)[1:] * skin.pitch_x_mm * skin.pitch_y_mm
    places = zip(area.tolist(), (x * skin.pitch_x_mm).tolist(), (y * skin.pitch_y_mm).tolist(), strict=True)
    return [Blob(*one) for one in places]


def switches(scene: Scene, seconds: float, skin: Skin, cover: Cover | None, rng: Random) -> np.ndarray:
    """1 for a closed switch. On a bare sheet, all contacts close at the touch."""
    bare = cover is None or cover.model == "patch"
    return scene.pressed(scene.settled_s if bare else seconds, skin, cover).astype(float)


def analog(scene: Scene, seconds: float, skin: Skin, cover: Cover | None, rng: Random) -> np.ndarray:
    """Converter steps of each element, 0 below the threshold.

    A rigid element takes the force of a switch's face or cap. On a bare sheet elements are adjacent.
    """
    taken = cells_of(_elements(skin, cover), skin.rows, skin.columns, skin.pitch_x_mm * 1e-3, skin.pitch_y_mm * 1e-3)
    forces = taken.forces_n(scene.loads(seconds)) * _gains(skin.rows, skin.columns)
    beside = np.pad(forces, 1)
    neighbors = beside[2:, 1:-1] + beside[:-2, 1:-1] + beside[1:-1, 2:] + beside[1:-1, :-2]
    steps = (forces + CROSSTALK * neighbors) / FULL_N * (2**BITS - 1) + NOISE_COUNTS * rng.standard_normal(forces.shape)
    steps = np.clip(np.round(steps), 0, 2**BITS - 1)
    return np.where(steps >= THRESHOLD_N / FULL_N * (2**BITS - 1), steps, 0.0)


def _elements(skin: Skin, cover: Cover | None) -> Cover:
    if cover is None or cover.model == "patch":
        side = min(skin.pitch_x_mm, skin.pitch_y_mm) * 1e-3
        return Cover("foam", 1e-3, cap=Cap(side), cut=True)
    return dataclasses.replace(cover, switch=Switch(area_m2=cover.switch.area_m2))


@functools.lru_cache(maxsize=32)
def _gains(rows: int, columns: int) -> np.ndarray:
    return 1 + GAIN_SPREAD * np.random.default_rng(0).standard_normal((rows, columns))


def _array_pace(rate_hz: float, skin: Skin) -> Pace:
    wire = 10e6 * (HEAD_BYTES + skin.rows * skin.columns) / skin.baud
    return Pace(1e6 / rate_hz, 0.0, max(1e6 / rate_hz, wire), wire)


def _array_usd(skin: Skin) -> float:
    return MCU_USD + CONVERTER_USD + AMPLIFIER_USD * skin.columns


def _mcu_pace(usb: bool, skin: Skin) -> Pace:
    scan = skin.rows * (skin.settle_us + 1e6 * ROW_CYCLES / MCU_HZ)
    work = 1e6 * (skin.rows * skin.columns * CELL_CYCLES + SEND_CYCLES) / MCU_HZ
    size = frame_bytes(skin, 1)
    if usb:
        return Pace(scan, work, scan + work, 8 * size * USB_BIT_US, USB_SLOT_US)
    return Pace(scan, work, scan + work, 10e6 * size / skin.baud)


def _mcu_usd(skin: Skin) -> float:
    return MCU_USD + DIODE_USD * skin.rows * skin.columns


def _cells_pace(skin: Skin) -> Pace:
    sent = skin.replace(report="cells")
    derived = sent.derived
    scan = 1e6 * derived.frame_clocks / sent.clock_hz
    return Pace(scan, 0.0, scan, 10e6 * frame_bytes(sent, skin.rows) * derived.bit_clocks / sent.clock_hz)


def _cells_usd(skin: Skin) -> float:
    return FPGA_USD + DIODE_USD * skin.rows * skin.columns


def frame_bytes(skin: Skin, items: int) -> int:
    """Bytes of a frame with this many items in our protocol."""
    plain = items * skin.derived.item_bytes + skin.derived.trailer_bytes
    return plain + math.ceil(plain / 254) + CHECK_BYTES + 1


_ARRAY = (
    f"model: {BITS} bits to {FULL_N:g} N an element, noise {NOISE_COUNTS:g} step rms, crosstalk {100 * CROSSTALK:g} %"
    f" to each neighbor, gains within {100 * GAIN_SPREAD:g} % rms, touched from {THRESHOLD_N:g} N on, centroid"
    " weighted by force; a byte per element on the wire"
)
_MCU = (
    f"model: {MCU_HZ / 1e6:g} MHz, {ROW_CYCLES} cycles and the settle time per row, {CELL_CYCLES} cycles per cell for"
    f" labels, {SEND_CYCLES} per frame; no debounce; frames as ours; lines beyond 50 by shift registers that"
    " take no time"
)

RIVALS: dict[str, Rival] = {
    "analog array, 100 Hz": Rival(_ARRAY, analog, functools.partial(_array_pace, 100.0), _array_usd),
    "analog array, 1 kHz": Rival(_ARRAY, analog, functools.partial(_array_pace, 1000.0), _array_usd),
    "microcontroller, UART": Rival(_MCU, switches, functools.partial(_mcu_pace, False), _mcu_usd),
    "microcontroller, USB": Rival(
        f"{_MCU}; full-speed USB, a frame every {USB_SLOT_US / 1e3:g} ms",
        switches,
        functools.partial(_mcu_pace, True),
        _mcu_usd,
    ),
    "OpenCV, cells from the board": Rival(
        "model: our board scans and sends the cells; connected components on the host, whose time is not counted",
        switches,
        _cells_pace,
        _cells_usd,
    ),
}
