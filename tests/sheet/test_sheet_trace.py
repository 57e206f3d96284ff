"""What the Gerbers' copper and drill join is what the Skin's wiring table says, traced by another library."""

import dataclasses
import random
import re

import pytest
from random_sheet import drawn, refused
from sample import sample

pytest.importorskip("gerbonara", reason="gerbonara is not installed")
pytest.importorskip("cv2", reason="OpenCV is not installed")

from traced_board import TracedBoard, lines_of, written

from contactfpga import Skin
from contactfpga.boards import BOARDS, wiring
from contactfpga.design import kits
from contactfpga.design.circuit import load_circuit

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::SyntaxWarning")

RULER_OHM, COLUMN_PF = 16_000.0, 220
"""Of the soft kit."""
TILE = {"pitch_x_mm": 6.4, "pitch_y_mm": 6.4}
CLOSED = {"surface": "cylinder", "closed": True}
SAME_PINS = {"74HC595": "74LVC595A", "74HC165": ""}
REGISTERS = {"row_drive": "74hc595", "column_read": "74hc165"}


def shuffled(count, seed):
    return tuple(random.Random(seed).sample(range(count), count))


SKINS = {
    "8x8": (Skin(rows=8, columns=8, **TILE), "dome"),
    "16x16 guard": (Skin(guard=True, **TILE), "dome"),
    "12x20 registers": (Skin(rows=12, columns=20, **REGISTERS), "dome"),
    "24x32 closed": (Skin(rows=24, columns=32, radius_mm=40.0, **CLOSED), "dome"),
    "12x20 chains": (Skin(rows=12, columns=20, row_chains=3, column_chains=2, guard=True, **REGISTERS), "tact"),
    "16x16 595": (Skin(row_drive="74hc595", column_order=shuffled(16, 1), row_order=shuffled(16, 2), **TILE), "dome"),
    "10x9 165": (Skin(rows=10, columns=9, column_read="74hc165", diodes="row2col", guard=True), "tact"),
    "6x5 reversal": (
        Skin(rows=6, columns=5, scan="reversal", precharge_us=0.25, guard=True, row_order=shuffled(6, 3)),
        "dome",
    ),
    "9x12 closed guard": (Skin(rows=9, columns=12, radius_mm=16.0, guard=True, pitch_y_mm=5.5, **CLOSED), "dome"),
    "7x4 bare": (Skin(rows=7, columns=4, diodes="none", connectivity=4), "dome"),
    "masked": (Skin(rows=5, columns=5, mask=(*((r, 2) for r in range(5)), *((4, c) for c in (0, 1, 3, 4)))), "tact"),
    "1x1": (Skin(rows=1, columns=1), "dome"),
    "20x2": (Skin(rows=20, columns=2, scan="reversal", precharge_us=0.25, diodes="row2col"), "dome"),
    "1x40": (Skin(rows=1, columns=40, guard=True), "dome"),
}
QUICK = {"8x8", "16x16 guard", "12x20 registers", "6x5 reversal", "10x9 165", "9x12 closed guard", "masked", "1x1"}
SLOW = {"24x32 closed"}


def wide_board(skin):
    """A board with a pin for every wire of any sheet."""
    pins = tuple(f"J:{number}" for number in range(130))
    return dataclasses.replace(BOARDS["ulx3s-85f"], row_side=pins, column_side=pins, clock_hz=skin.clock_hz)


def check_against_the_wiring_table(board, skin, series=33.0, pulls=None):
    """The traced board against :func:`contactfpga.boards.wiring.wires` and ``outputs``."""
    pulls = pulls or {"row": 5600.0, "column": 22000.0}
    assert board.disagreements() == []
    rows, columns = lines_of(board, skin)
    lines = {f"row {n}": one for n, one in rows.items()} | {f"column {n}": one for n, one in columns.items()}
    wires = board.connectors
    supply, ground = wires["3V3"], wires["GND"]
    assert supply != ground
    guarded(board, skin, rows, columns, lines)

    def leads(pin, line):
        """From a pin through the series resistor to the line, and its pull."""
        ends = [(other, ohms) for other, ohms in board.resistors[pin] if other not in (supply, ground)]
        ((copper, ohms),) = ends
        assert ohms == series
        assert copper == lines.setdefault(line.leads_to, copper), line
        at = {(other, ohms) for other, ohms in board.resistors[copper] if other in (supply, ground)}
        rail = {"up": supply, "down": ground}
        assert at == ({(rail[line.pull], pulls[line.kind])} if line.pull else set()), line

    chips = named_chips(board, skin, wires)
    seen = set()
    for wire in wiring.wires(wide_board(skin), skin):
        if wire.line.kind:
            leads(wires[wire.port], wire.line)
        elif found := re.match(r"[\w/']+ (\d+) of (every|chip 0, chain (\d+),) (74HC\d+)", wire.line.leads_to):
            pin, which, chain, kind = found.groups()
            for (name, of_chain, number), chip in chips.items():
                if name == kind and (which == "every" or (of_chain, number) == (int(chain), 0)):
                    assert board.pad(chip, pin) == wires[wire.port], wire
            if "10 kΩ" in wire.line.leads_to:
                assert (supply, 10_000.0) in board.resistors[wires[wire.port]]
        else:
            continue
        seen.add(wire.port)
    assert seen == set(wires) - {"3V3", "GND", "contact", "alive"}
    used = set()
    for output in wiring.outputs(skin):
        leads(board.pad(chips[output.chip, output.chain, output.number], output.pin), output.line)
        used.add((chips[output.chip, output.chain, output.number], output.pin))
    columns = {one for name, one in lines.items() if "column" in name}
    ties(board, chips, used, supply, ground, columns if skin.ruler else ())
    assert len(set(lines.values())) == len(lines)


def guarded(board, skin, rows, columns, lines):
    """Guard lines: a diode from the guard column to each row and from each column to the guard row, and no other."""
    flip = skin.diodes == "row2col"
    pairs = {(cathode, anode) if flip else (anode, cathode) for anode, cathode in board.diodes}
    between = {(a, b) for a, b in pairs if b in rows.values() and a not in columns.values()}
    switched = skin.rows * skin.columns - len(skin.mask)
    if skin.diodes == "none":
        assert pairs == set()
        return
    assert len(board.diodes) == switched + skin.guard * (skin.rows + skin.columns)
    if not skin.guard:
        return
    if skin.ruler:
        lines |= ruled(board, skin, rows, columns)
        return
    nodes = {board.pad(name, 2) for name in board.parts("SW")}
    ((guard_column),) = {a for a, b in between if a not in nodes}
    ((guard_row),) = {b for a, b in pairs if b not in rows.values()}
    assert {b for a, b in pairs if a == guard_column} == set(rows.values())
    assert {a for a, b in pairs if b == guard_row} == set(columns.values())
    lines |= {"guard row": guard_row, "guard column": guard_column}


def ruled(board, skin, rows, columns):
    """Guard lines whose crossings are a resistor of the ruler and a diode, found from those; returns both lines."""
    nodes = {board.pad(name, 2) for name in board.parts("SW")}
    crossings = {}  # (column's copper, row's copper): resistance
    for anode, cathode in board.diodes:
        if anode not in nodes:
            ((column, ohms),) = board.resistors[anode]
            crossings[column, cathode] = ohms
    assert set(crossings.values()) == {RULER_OHM}
    ((guard_column),) = {column for column, _ in crossings} - set(columns.values())
    ((guard_row),) = {row for _, row in crossings} - set(rows.values())
    below = {(column, guard_row) for column in columns.values()}
    assert set(crossings) == below | {(guard_column, row) for row in rows.values()}
    return {"guard row": guard_row, "guard column": guard_column}


def named_chips(board, skin, wires):
    """Reference of each shift register by (kind, chain, number), found by following its chain from the connector."""
    ways = {"74HC595": ("row_data", skin.row_chains, 14, 9), "74HC165": ("column_data", skin.column_chains, 9, 10)}
    found = {}
    for kind, (port, chains, first, after) in ways.items():
        names = [name for name in board.parts("U") if board.values[name] in (kind, SAME_PINS[kind])]
        starts = {board.pad(name, first): name for name in names}
        for chain in range(chains if names else 0):
            copper, number = wires[port if chains == 1 else f"{port}[{chain}]"], 0
            while copper in starts:
                found[kind, chain, number] = name = starts.pop(copper)
                copper, number = board.pad(name, after), number + 1
        assert not starts, f"{kind} in no chain"
    return found


def ties(board, chips, used, supply, ground, floating):
    """Supplies and inputs that are held, as docs/boards.md lists them; 100 nF at each chip, and a capacitor at each
    column that floats."""
    held = {"74HC595": {8: ground, 16: supply, 10: supply}, "74HC165": {8: ground, 16: supply, 15: ground}}
    for (kind, chain, number), name in chips.items():
        pins = dict(held[kind])
        if kind == "74HC165":
            pins |= {pin: ground for pin in (3, 4, 5, 6, 11, 12, 13, 14) if (name, pin) not in used}
            if (kind, chain, number + 1) not in chips:
                pins[10] = ground
        assert {pin: board.pad(name, pin) for pin in pins} == pins
    held, charged = [], []
    for name in board.parts("C"):
        ends = {board.pad(name, 1), board.pad(name, 2)}
        assert ground in ends
        (held if supply in ends else charged).append((*(ends - {ground}), board.values[name]))
    assert len(held) == len(chips)
    assert sorted(charged) == sorted((line, f"{COLUMN_PF}p") for line in floating)


@pytest.mark.parametrize("name", sample(list(SKINS), quick=QUICK, slow=SLOW))
def test_copper_is_the_wiring_table(tmp_path, name):
    skin, part = SKINS[name]
    written(tmp_path, skin, part)
    check_against_the_wiring_table(TracedBoard(tmp_path), skin)


RIBBON = {"1": 1, "7": 2, "2": 3, "8": 4, "3": 5, "9": 6, "4": 7, "10": 8, "5": 9, "11": 10, "6": 11, "12": 12}
"""Wire of a flat cable at each pin of a PMOD socket: 1 to 6 in one row, 7 to 12 in the other."""


@pytest.mark.parametrize(("name", "series"), [("starter", 33.0), ("soft", 4.7)])
def test_three_flat_cables_join_a_kit_to_its_board(tmp_path, name, series):
    kit = kits.kit(name)
    written(tmp_path, kit.skin, circuit=load_circuit(kit.skin_path), board=kit.board)
    board = TracedBoard(tmp_path)
    check_against_the_wiring_table(board, kit.skin, series, pulls={"column": 47_000.0})
    sockets = {"PMOD1A": "J1", "PMOD1B": "J2", "PMOD2": "J3"}
    for wire in wiring.wires(kit.board, kit.skin):
        if wire.pin:
            connector, number = kit.board.label(wire.pin).split()
            assert board.pad(sockets[connector], RIBBON[number]) == board.connectors[wire.port], wire
    for name in sockets.values():
        grounds, supplies = ({board.pad(name, RIBBON[pin]) for pin in pins} for pins in (("5", "11"), ("6", "12")))
        assert (grounds, supplies) == ({board.connectors["GND"]}, {board.connectors["3V3"]})
    for number, port in enumerate(("contact", "GND", "alive"), 1):
        assert board.pad("J4", number) == board.connectors[port]


@pytest.mark.parametrize("seed", sample(range(20), quick=[4], slow=[5, 6]))
def test_copper_of_random_sheets_is_the_wiring_table(tmp_path, seed):
    skin, part = drawn(seed)
    if not refused(skin, part):
        written(tmp_path, skin, part)
        check_against_the_wiring_table(TracedBoard(tmp_path), skin)
