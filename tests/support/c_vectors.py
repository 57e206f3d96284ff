"""The test vectors in c/vectors.txt, by the golden encoder from what they are to say. Run it to write them anew."""

import random
from pathlib import Path

import numpy as np
from wire import Wire

from contactfpga import Skin
from contactfpga.wire.protocol import may_number
from contactfpga_sim.model.golden.request import command, request

PATH = Path(__file__).parents[2] / "c" / "vectors.txt"
HEAD = """\
# What a board sends (>, in hex) and what c/decode.c says of it, line for line. Made by the golden model's encoder,
# which shares no code with the readers: python tests/support/c_vectors.py
"""
SKINS = {
    "the reference Skin": Skin(),
    "64x64": Skin(rows=64, columns=64, settle_us=12.0),
    "barycenters": Skin(rows=5, columns=32, report="barycenter", barycenter_bits=8, name="elbow", settle_us=12.0),
    "cells on a cylinder": Skin(rows=4, columns=11, report="cells", surface="cylinder", radius_mm=40.0),
    "one cell": Skin(rows=1, columns=1, send="on_change"),
    "faults": Skin(rows=3, columns=4, guard=True),
    "pressure units": Skin(rows=5, columns=4, units=3),
    "overflow": Skin(rows=8, columns=8, zone_capacity=2, connectivity=4),
    "around a cylinder": Skin(rows=5, columns=7, surface="cylinder", radius_mm=30.0, closed=True),
    "extents": Skin(rows=5, columns=9, extent=True),
    "extents around a cylinder": Skin(rows=5, columns=7, surface="cylinder", radius_mm=9.0, closed=True, extent=True),
    "levels of force": Skin(
        rows=4, columns=11, report="cells", ruler=40, harder=(10, 2), guard=True, precharge_us=1.0, settle_us=40.0
    ),
}


def text() -> str:
    streams = (f"\n# {title}\n{_stream(skin, seed)}" for seed, (title, skin) in enumerate(SKINS.items()))
    return HEAD + "".join(streams) + _to_the_board()


def _to_the_board() -> str:
    """The numbers of a request, or of a command with what and value; whether it asks for a hello; whether as pulses."""
    lines, rng = [], random.Random(7)
    numbers = [129 * 128 + 1, 2**21 - 1, *(number for number in rng.sample(range(2**21), 60) if may_number(number))]
    for index, number in enumerate(numbers[:12]):
        hello, pulsed = index % 2, index // 2 % 2
        bit_clocks = 2 if pulsed else 8
        if index < 4:
            lines += [f"request {number} {hello} {pulsed}", f"< {request(number, bool(hello), bit_clocks).hex()}"]
            continue
        what, value = 1 + index % 5, rng.getrandbits(21) if index % 5 else 0
        lines.append(f"command {number} {what} {value} {hello} {pulsed}")
        lines.append(f"< {command(number, what, value, bool(hello), bit_clocks).hex()}")
    return (
        "\n# to the board (<): number, what and value of a command, with a hello, as pulses\n" + "\n".join(lines) + "\n"
    )


def _stream(skin: Skin, seed: int) -> str:
    rng = np.random.default_rng(seed)
    wire, known = Wire(skin), Wire(skin).known
    sent, epoch, heard, stuck = random.Random(seed).getrandbits(40) & ~0xFF, 1, 129 * 128 + 1, seed % 3
    lines = [_packet(wire.hello(sent=sent, epoch=epoch, heard=heard, stuck=stuck))]
    report = ["moments", "cells", "barycenter"].index(skin.report)
    bits = skin.barycenter_bits if known.divided else 0
    lines.append(
        f"hello {skin.rows}x{skin.columns} {skin.connectivity}{'c' * skin.closed}{'e' * skin.extent} {report} {bits} "
        f"{int(skin.send == 'on_change')} "
        f"{skin.zone_capacity} {int(skin.diodes == 'none')} {int(skin.guard)} "
        f"{int(skin.self_test)} {skin.pitch_x_mm:.17g} {skin.pitch_y_mm:.17g} "
        f"{skin.radius_mm or 0:.17g} {known.fingerprint.hex()} {skin.clock_hz} {skin.baud} {sent} {epoch} {heard} "
        f"{stuck} {skin.name}"
    )
    for index in range(5 if skin.zone_capacity == 2 else 4):
        data, words, cells, zones, flags = _frame(wire, rng, index, sent + index, heard)
        lines.append(_packet(data))
        fields = (2**22 + 100 * index, (sent + index) % 256, flags, heard % 8, cells, zones, 0)
        lines.append(" ".join(map(str, ("frame", *fields, *words))))
    if skin.units:
        lines.insert(2, "units 3 12 0 0 240 720")
        for index, readings in enumerate([(0, 2048, 4095), (1, 130, 4094)]):
            time = 2**22 + 250 + 100 * index
            lines.append(_packet(wire.sweep(readings, time, 254 + index, 3 * index)))
            said = (time, 254 + index, index, index, 5 if index == 0 else 0)
            lines.append(" ".join(map(str, ("sweep", *said, *readings))))
    if skin.guard:
        lines += [
            _packet(wire.report(1 << 1 | 1 << skin.rows + 2 | 1 << skin.rows + skin.columns + 4)),
            "faults row:1 column:2 stuck:4",
        ]
        lines += [_packet(wire.report(0)), "faults"]
    return "\n".join(lines) + "\n"


def _frame(wire: Wire, rng, index: int, sent: int, heard: int):
    skin, known = wire.skin, wire.known
    trailer = {"time": 2**22 + 100 * index, "sequence": sent, "heard": heard}
    if skin.report == "cells":
        bitmap = (rng.random((skin.rows, skin.columns)) < index / 3) * np.ones(1, int)
        if skin.levels > 1:
            bitmap *= rng.integers(1, skin.levels + 1, bitmap.shape)
        words = [f"{row}:{column}" for row, column in np.argwhere(bitmap) for _ in range(bitmap[row, column])]
        return wire.cells(bitmap.tolist(), **trailer), words, np.count_nonzero(bitmap), 0, 0
    whole = index == 3  # all cells are one zone
    count = 1 if whole else min(index, skin.max_zones())
    rows = [_zone(skin, rng, whole, known.divided) for _ in range(count)]
    carried, area = rows[: skin.zone_capacity], sum(row[0] for row in rows)
    flags = ["overflow"] if len(carried) < len(rows) else []
    data = wire.zones(carried, cells=area, zones=len(rows), flags=flags, **trailer)
    return data, [",".join(map(str, row)) for row in carried], area, len(rows), len(flags)


def _zone(skin: Skin, rng, whole: bool, divided: bool) -> tuple[int, ...]:
    columns, rows = skin.columns, skin.rows
    if skin.extent:
        return _reaching(skin, rng, whole)
    area = rows * columns if whole else int(rng.integers(1, max(2, min(9, rows * columns // 4))))
    x, y = (rng.integers(0, columns, area), rng.integers(0, rows, area)) if not whole else np.indices((columns, rows))
    sums = int(x.sum()), int(y.sum())
    if skin.closed:
        return area, *sums, [0, area, 63][int(rng.integers(3))]
    if not divided:
        return area, *sums
    return area, *((2 * total * 2**skin.barycenter_bits + area) // (2 * area) for total in sums)


def _reaching(skin: Skin, rng, whole: bool) -> tuple[int, ...]:
    """All cells, or a run of a row, on a closed sheet sometimes over the seam."""
    y = int(rng.integers(skin.rows))
    length, first = int(rng.integers(1, skin.columns)), int(rng.integers(skin.columns))
    top, bottom = (0, skin.rows - 1) if whole else (y, y)
    left, right = (0, skin.columns - 1) if whole else (first, first + length - 1)
    if not skin.closed:
        right = min(right, skin.columns - 1)
    lines, places = bottom - top + 1, range(left, right + 1)
    area, past = lines * len(places), lines * sum(x >= skin.columns for x in places)
    sums = lines * sum(x % skin.columns for x in places), len(places) * sum(range(top, bottom + 1))
    turned = [area if whole else past] if skin.closed else []
    return area, *sums, *turned, left, right % skin.columns, top, bottom


def _packet(data: bytes) -> str:
    return f"> {data.hex()}"


if __name__ == "__main__":
    PATH.write_text(text(), encoding="utf-8")
