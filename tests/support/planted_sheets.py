"""Virtual sheets with faults that are known, and a hand that touches them as `contactfpga bringup` asks."""

import dataclasses

import numpy as np

import contactfpga
from contactfpga import Skin
from contactfpga.design.circuit import Circuit
from contactfpga.tools.commands.bringup import steps
from contactfpga.tools.commands.bringup.bench import Bench
from contactfpga_sim.model.board.virtual import VirtualBoard
from contactfpga_sim.model.scenes.hand import Hand
from contactfpga_sim.model.sheet.matrix import Shorts

SIZE = 8
SKIN = Skin(rows=SIZE, columns=SIZE, report="cells", guard=True, settle_us=6.0, precharge_us=0.5)
LARGE = SKIN.replace(rows=12, columns=12, settle_us=10.0)
CIRCUIT = Circuit(line_pf=150, pin_ohm=85, series_ohm=200, switch_ohm=1000)
TESTED = Skin(
    rows=4, columns=4, report="cells", scan="reversal", guard=True, self_test=True, settle_us=2.0, precharge_us=0.25
)
HOLDS_S = 5.0
"""At most, what the hand keeps doing."""


@dataclasses.dataclass
class Faults:
    """What is wrong with a sheet; lines are counted from 0."""

    rows_open: tuple = ()
    columns_open: tuple = ()
    columns_stuck: tuple = ()
    stuck: tuple = ()
    """(row, column) of switches that stay closed."""
    dead: tuple = ()
    """(row, column) of switches that never close."""
    bouncing: tuple = ()
    """(row, column) of switches that bounce for :data:`BOUNCE_S`."""
    slow_rows: tuple = ()
    slow_columns: tuple = ()
    shorts: object = None
    """A :class:`~contactfpga_sim.model.sheet.matrix.Shorts`."""
    lost: float = 0.0
    """Share of the bytes that are lost on the way."""


BOUNCE_S, CHATTER_S = 3e-3, 0.6e-3
SLOW = 2.6


class FaultySwitches:
    """What switches make of a hand."""

    def __init__(self, hand, faults):
        self.hand, self._faults = hand, faults
        self._asked = None
        self._since_s = {}

    def __call__(self, seconds):
        cells = self.hand(seconds).copy()
        asked = cells.copy()
        for cell in self._faults.bouncing:
            if self._asked is not None and asked[cell] != self._asked[cell]:
                self._since_s[cell] = seconds
            past_s = seconds - self._since_s.get(cell, -1.0)
            if past_s < BOUNCE_S and int(past_s / CHATTER_S) % 2:
                cells[cell] = not cells[cell]
        self._asked = asked
        for cell in self._faults.stuck:
            cells[cell] = True
        for cell in self._faults.dead:
            cells[cell] = False
        return cells


class PlantedBoard(VirtualBoard):
    """A virtual board of a sheet with these faults, whose lines scatter by this share."""

    def __init__(self, skin, faults, circuit, scatter, rng):
        self.hand = Hand(skin.rows, skin.columns)
        rows, columns = (
            {line: float(np.exp(rng.normal(0, scatter))) * (SLOW if line in slow else 1) for line in range(count)}
            for count, slow in ((skin.rows, faults.slow_rows), (skin.columns, faults.slow_columns))
        )
        slow = {"slow_rows": rows, "slow_columns": columns} if circuit else {}
        super().__init__(skin, FaultySwitches(self.hand, faults), circuit=circuit, **slow)
        self._board.cut(dict.fromkeys(faults.rows_open, 0), dict.fromkeys(faults.columns_open, 0))
        if faults.columns_stuck:
            self._board.stick(np.isin(np.arange(skin.columns), faults.columns_stuck))
        if faults.shorts is not None:
            self._board._check_pins = lambda fights: None  # pins drive against each other on such a sheet
            self._board.join(faults.shorts)
        self._lost, self._rng = faults.lost, rng

    def read(self, seconds):
        data = super().read(seconds)
        kept = self._rng.random(len(data)) >= self._lost
        return bytes(np.frombuffer(data, np.uint8)[kept])


class Person:
    """Has the hand do what is asked."""

    stuck_s, rest_s = 0.03, 0.01

    def __init__(self, hand):
        self._hand = hand

    def asked(self, does, words):
        assert words.endswith(".")
        return self._hand.does(does) or HOLDS_S


def brought_up(faults=None, skin=SKIN, circuit=None, scatter=0.0, seed=0, only=None, stated=None):
    """The steps of a bring-up of a sheet with these faults, by name, and the bench; ``only``: these steps."""
    rng = np.random.default_rng(seed)
    port = PlantedBoard(skin, faults or Faults(), circuit, scatter, rng)
    with contactfpga.open(port, skin=skin) as board:
        bench = Bench(board, skin, Person(port.hand), stated or circuit, seconds=0.05)
        found = [step(bench) for step in only] if only else list(steps.run(bench))
    return {step.name: step for step in found}, bench


def faults_of(found):
    """All sentences that tell a fault."""
    return [one.sentence for step in found.values() for one in step.findings if one.verdict == "fault"]


def drawn(seed):
    """A sheet of :data:`LARGE` with one fault, or none, and values of its circuit that are drawn: the kind and the
    faults, what the sentences that are expected begin with, and the circuit."""
    rng = np.random.default_rng(1000 + seed)
    row, column = (int(line) for line in rng.integers(0, LARGE.rows, 2))
    beside = (column + 1) % LARGE.columns
    joined = tuple(sorted((column, beside)))
    alike = f"columns {joined[0]} and {joined[1]} always read alike: "
    never = f"cell ({row}, {column}) never read pressed: "
    pressed = f"cell ({row}, {column}) pressed "
    slow = "a long or thin line"
    kinds = {
        "nothing": (Faults(), []),
        "open row": (Faults(rows_open=(row,)), [f"row {row} open: ", f"row {row} never read pressed: "]),
        "open column": (
            Faults(columns_open=(column,)),
            [f"column {column} open: ", f"column {column} never read pressed: "],
        ),
        "open guard row": (Faults(rows_open=(LARGE.rows,)), ["guard row open: "]),
        "open guard column": (Faults(columns_open=(LARGE.columns,)), ["guard column open: "]),
        "stuck switch": (Faults(stuck=((row, column),)), [f"{pressed}though nothing touches: ", f"{pressed}for "]),
        "dead switch": (Faults(dead=((row, column),)), [never]),
        "bouncing switch": (Faults(bouncing=((row, column),)), [f"cell ({row}, {column}) bounces for "]),
        "slow row": (Faults(slow_rows=(row,)), [f"slow row {row}: {slow}"]),
        "slow column": (Faults(slow_columns=(column,)), [f"slow column {column}: {slow}"]),
        "joined columns": (Faults(shorts=Shorts(columns=(joined,))), [alike]),
        "lossy link": (Faults(lost=0.0005), [" lost, "]),
    }
    name = [*kinds][seed % len(kinds)]
    circuit = CIRCUIT.replace(line_pf=float(rng.uniform(110, 200)), switch_ohm=float(rng.uniform(500, 2000)))
    return name, *kinds[name], circuit
