"""Proofs that mutants change nothing in any clock from power-up.

Gateware and mutant have the same inputs. Only registers that the mutant may affect are doubled; the question is whether
an output or any other register can ever differ. Registers that differ at the end of a counterexample are doubled too,
and the question is repeated.

Some registers are cut to keep the problem small: they may hold anything, which only adds behavior.
"""

from __future__ import annotations

import math
import re
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from pathlib import Path
from types import TracebackType

from contactfpga.errors import ContactFPGAError
from contactfpga_sim.model.board import native
from contactfpga_sim.verify import aig
from contactfpga_sim.verify.aig import reached
from contactfpga_sim.verify.mutants.netlist import PREPARE, STAGES, Design, Mutant, in_sheet, module_of, plain, switches

QUICK_S, LONG_S = 4, 45
"""CPU seconds for one question."""

# What lies beyond the last word of a memory reads 0, as in the compiled board.
_GATES = (
    "memory_map; setundef -undriven -zero; opt_expr; opt_merge; opt_clean; techmap; dffunmap; simplemap; opt_expr; "
    "opt_merge; opt_clean; aigmap; opt_merge; opt_clean; write_aiger -zinit -map names.txt design.aig"
)
_STORE = "link.store["  # the frames' memory, by far the most registers
# Registers that count clocks between events.
_CLOCKS = ("scan.clock", "scan.frame_clock.time", "scan.frame_clock.prescaler")
# Outputs that say what is handed over, and the one that says when.
_HANDED = {
    "row_cells": "row_transfer",
    "row_last": "row_transfer",
    "record_data": "record_transfer",
    "record_end": "record_transfer",
    "byte_data": "byte_transfer",
}


class Contradiction(ContactFPGAError):
    """The proof is wrong; the message has details."""


class Prover:
    """Gateware and mutants as one circuit, selected by the input ``mutant``."""

    def __init__(self, design: Design, mutants: Sequence[Mutant]):
        self._mutants = list(mutants)
        self._folder = tempfile.TemporaryDirectory(prefix="contactfpga-")
        folder = Path(self._folder.name)
        (folder / "model.il").write_text(native.rtlil(plain(design).elaborate()))
        native.yosys("\n".join(("read_rtlil model.il", native.FLATTEN, PREPARE, *switches(mutants), _GATES)), folder)
        self._circuit = aig.read(folder / "design.aig", folder / "names.txt")
        self._graph = aig.Graph(len(self._circuit.inputs) + len(self._circuit.latches))
        count = len(self._circuit.inputs)
        self._inputs = [2 * (1 + i) for i in range(count)]
        self._latches = [2 * (1 + count + i) for i in range(len(self._circuit.latches))]
        self._nexts, self._driven = self._placed(0, self._latches)

    def __enter__(self) -> Prover:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, traceback: TracebackType | None) -> None:
        self._folder.cleanup()

    def equivalent(self, mutant: Mutant, limit_s: int, until: float = math.inf) -> bool:
        """Whether the mutant is proved equivalent, with at most ``limit_s`` processor seconds per question, and none
        after ``until``, a :func:`time.monotonic`."""
        number = self._mutants.index(mutant) + 1
        return any(self._never_differs(number, cut, limit_s, until) for cut in self._cuts(mutant))

    def _cuts(self, mutant: Mutant) -> Iterator[frozenset[int]]:
        """Sets of cut registers, the largest first."""
        every, store = frozenset(range(len(self._latches))), self._named(_STORE)
        inside = self._inside(STAGES[mutant.stage]) - store
        yield every - inside
        yield every - inside - (self._named("scan.") - self._named(*_CLOCKS))
        yield store

    def _never_differs(self, number: int, cut: frozenset[int], limit_s: int, until: float) -> bool:
        twins: dict[int, int] = {}
        while time.monotonic() < until:  # it ends, as each turn doubles a register
            latches = list(self._latches)
            for index, twin in twins.items():
                latches[index] = twin
            nexts, driven = self._placed(number, latches)
            differing = self._differing(nexts, twins)
            bad = self._graph.any([*differing.values(), *self._seen(driven)])
            takes = {old >> 1: new for i, (old, new) in enumerate(zip(self._latches, self._nexts)) if i not in cut}
            takes |= {twin >> 1: nexts[index] for index, twin in twins.items()}
            answer = reached(self._graph, takes, bad, limit_s, Path(self._folder.name))
            if answer.outcome != "reached":
                return answer.outcome == "never"
            values = self._last(takes, answer.path, [bad, *differing.values()])
            if not _value(values, bad):
                raise Contradiction("the solver's path does not lead where gateware and mutant differ")
            found = {index for index, differ in differing.items() if _value(values, differ)}
            if not found or found & cut:
                return False
            twins |= {index: self._graph.variable() for index in sorted(found)}
        return False

    def _placed(self, number: int, latches: Sequence[int]) -> tuple[Sequence[int], Sequence[int]]:
        inputs = list(self._inputs)
        for index, name in enumerate(self._circuit.inputs):
            if found := re.fullmatch(r"mutant\[(\d+)\]", name):
                inputs[index] = number >> int(found[1]) & 1
        placed = self._graph.place(self._circuit, inputs, latches)
        return placed.nexts, placed.driven

    def _differing(self, nexts: Sequence[int], twins: Collection[int]) -> dict[int, int]:
        pairs = enumerate(zip(self._nexts, nexts))
        return {i: self._graph.differ(one, other) for i, (one, other) in pairs if one != other and i not in twins}

    def _seen(self, driven: Sequence[int]) -> Iterable[int]:
        """Payloads count only during a transfer."""
        names = self._circuit.outputs
        for name, one, other in zip(names, self._driven, driven):
            when = _HANDED.get(name.partition("[")[0])
            looked_at = self._driven[names.index(f"{when}[0]")] if when else 1
            yield self._graph.both(self._graph.differ(one, other), looked_at)

    def _last(self, takes: dict[int, int], path: list[dict[int, int]], roots: list[int]) -> dict[int, int]:
        state: dict[int, int] = {}
        for inputs in path[:-1]:
            values = self._graph.values({**state, **inputs}, takes.values())
            state = {node: _value(values, literal) for node, literal in takes.items()}
        return self._graph.values({**state, **path[-1]}, roots)

    def _inside(self, modules: Collection[str]) -> frozenset[int]:
        names = enumerate(self._circuit.latches)
        return self._named("?") | {index for index, some in names if any(module_of(name) in modules for name in some)}

    def _named(self, *prefixes: str) -> frozenset[int]:
        names = enumerate(self._circuit.latches)
        return frozenset(index for index, some in names if any(in_sheet(name).startswith(prefixes) for name in some))


def _value(values: dict[int, int], literal: int) -> int:
    return values[literal >> 1] ^ literal & 1


def equivalent(
    design: Design,
    mutants: Sequence[Mutant],
    limit_s: int = QUICK_S,
    done: Callable[[], None] = lambda: None,
    until: float = math.inf,
) -> list[bool]:
    """Whether each mutant is proved equivalent; ``done()`` is called after each. Limits are those of
    :meth:`Prover.equivalent`."""
    verdicts: list[bool] = []
    if not mutants or time.monotonic() >= until:
        return [False] * len(mutants)
    with Prover(design, mutants) as prover:
        for mutant in mutants:
            verdicts.append(prover.equivalent(mutant, limit_s, until))
            done()
    return verdicts
