"""Whether claims of a circuit hold: forever, by induction over its clocks, or for some clocks from power-up.

A program of its own, so that it can be ended: ``python -m contactfpga_sim.verify.proofs.induction FILES CLOCKS``.
CaDiCaL, a SAT solver, chooses all inputs and, in an induction, the first clock's registers.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path

from pysat.solvers import Solver

from contactfpga_sim.verify import aig

REST = "rest"
"""Name of the output for :meth:`~contactfpga_sim.verify.proofs.proof.Proof.rests`."""


class Unrolling:
    """A circuit unrolled over successive clocks, as clauses of a solver."""

    def __init__(self, circuit: aig.Circuit, power_up: bool):
        """``power_up``: all registers start at 0; otherwise the solver chooses."""
        self._circuit = circuit
        self._graph = aig.Graph(0)
        self._solver = Solver(name="cadical195")
        self._clauses = 0
        self._latches: Sequence[int] = [0 if power_up else self._graph.variable() for _ in circuit.latches]
        self._variables: list[tuple[Sequence[int], Sequence[int]]] = []
        self._bad = 0
        self.rest = 0
        """Literal of the newest clock: the circuit is at rest."""

    def add(self) -> None:
        """Add a clock. In the one before, all claims hold."""
        self.assume(self._bad ^ 1)
        inputs = [self._graph.variable() for _ in self._circuit.inputs]
        placed = self._graph.place(self._circuit, inputs, self._latches)
        self._variables.append((inputs, self._latches))
        for literal in placed.given:
            self.assume(literal)
        self._latches, self._bad = placed.nexts, self._graph.any(placed.bad)
        self.rest = next((at for name, at in zip(placed.outputs, placed.driven) if name == f"{REST}[0]"), 0)

    def assume(self, literal: int) -> None:
        self._define()
        if literal != 1:
            self._solver.add_clause([_signed(literal)] if literal else [])

    def satisfiable(self, *literals: int) -> bool:
        """Whether the literals can hold together."""
        self._define()
        if 0 in literals:
            return False
        return bool(self._solver.solve([_signed(literal) for literal in literals if literal != 1]))

    def violated(self) -> bool:
        """Whether a claim can fail in the newest clock of a run that repeats no state, as no shortest counterexample
        from power-up does."""
        while self.satisfiable(self._bad):
            holds, seen = self._holds(), dict[tuple[bool, ...], Sequence[int]]()
            for _, latches in self._variables:
                state = tuple(map(holds, latches))
                if state in seen:
                    pairs = zip(seen[state], latches, strict=True)
                    self.assume(self._graph.any(self._graph.differ(*pair) for pair in pairs))
                    break
                seen[state] = latches
            else:
                return True
        return False

    def trace(self) -> str:
        """The solver's last choice: inputs and registers that are not 0, a line per clock."""
        holds, lines = self._holds(), []
        for number, (inputs, latches) in enumerate(self._variables):
            values: dict[str, int] = defaultdict(int)
            names = ((name,) for name in self._circuit.inputs)
            for called, literal in zip((*names, *self._circuit.latches), (*inputs, *latches), strict=True):
                for name in called:
                    if found := re.fullmatch(r"([^$?]+)\[(\d+)\]", name):
                        values[found[1]] |= holds(literal) << int(found[2])
            words = (f"{name}={value:#x}" for name, value in values.items() if value)
            lines.append(" ".join((f"clock {number}:", *words)))
        return "\n".join(lines)

    def _holds(self) -> Callable[[int], bool]:
        """The solver's last choice for literals."""
        true = {literal for literal in self._solver.get_model() or () if literal > 0}
        return lambda literal: (literal >> 1 in true) != bool(literal & 1)

    def _define(self) -> None:
        """Tell the solver of gates that are new."""
        for node in range(self._clauses, len(self._graph.operands)):
            if operands := self._graph.operands[node]:
                left, right = map(_signed, operands)
                for clause in ([-node, left], [-node, right], [node, -left, -right]):
                    self._solver.add_clause(clause)
        self._clauses = len(self._graph.operands)


def _signed(literal: int) -> int:
    """A graph's literal for the solver."""
    return -(literal >> 1) if literal & 1 else literal >> 1


LONGEST = 100
"""Most clocks without rest."""

Found = tuple[str, int, str]
"""Outcome, clocks, and the solver's choice where a claim fails."""


def search(circuit: aig.Circuit, clocks: int) -> Found:
    """Whether claims hold in the first clocks from power-up."""
    run = Unrolling(circuit, power_up=True)
    for clock in range(clocks):
        run.add()
        if run.violated():
            return "counterexample", clock, run.trace()
    return "proved", clocks, ""


def prove(circuit: aig.Circuit, clocks: int) -> Found:
    """Whether claims that held in as many clocks, at most ``clocks``, hold in the next one, and at power-up."""
    start, step = Unrolling(circuit, power_up=True), Unrolling(circuit, power_up=False)
    step.add()
    for clock in range(clocks):
        start.add()
        if start.violated():
            return "counterexample", clock, start.trace()
        step.add()
        if not step.violated():
            return "proved", clock + 1, ""
    return "open", clocks, step.trace()


def prove_from_rest(circuit: aig.Circuit, clocks: int) -> Found:
    """Whether claims hold from each clock at rest to the next, which must come within :data:`LONGEST` clocks.

    The solver chooses the registers ``clocks`` clocks before rest. Lemmas pin them down, which spares most of
    :func:`prove`'s search.
    """
    start = Unrolling(circuit, power_up=True)
    for clock in range(clocks + LONGEST):
        start.add()
        if start.violated():
            return "counterexample", clock, start.trace()
        if clock >= clocks:
            start.assume(start.rest ^ 1)
        if not start.satisfiable():
            break
    else:
        return "open", clock, _restless(start)
    step = Unrolling(circuit, power_up=False)
    for _ in range(clocks + 1):
        step.add()
    step.assume(step.rest)
    for clock in range(clocks, clocks + LONGEST):
        if not step.satisfiable():
            return "proved", clock, ""
        step.add()
        if step.violated():
            return "open", clock + 1, step.trace()
        step.assume(step.rest ^ 1)
    return "open", clocks + LONGEST, _restless(step)


def _restless(run: Unrolling) -> str:
    return f"no rest in {LONGEST} clocks\n{run.trace()}"


def main() -> int:
    """Print outcome, clocks and the solver's choice as JSON."""
    parser = argparse.ArgumentParser(prog="python -m contactfpga_sim.verify.proofs.induction", description=__doc__)
    parser.add_argument("files", type=Path, help="folder of design.aig and names.txt")
    parser.add_argument("clocks", type=int)
    parser.add_argument("--forever", action="store_true")
    options = parser.parse_args()
    circuit = aig.read(options.files / "design.aig", options.files / "names.txt")
    solve: Callable[[aig.Circuit, int], Found] = search
    if options.forever:
        solve = prove_from_rest if f"{REST}[0]" in circuit.outputs else prove
    json.dump(solve(circuit, options.clocks), sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main())
