"""Which mutants are no change at all: proofs that hold in every clock from power-up.

The question is put to a solver as one of reachability. Gateware and mutant run side by side on the same inputs. Only
those registers of which the mutant may hold something else are there twice; it is asked whether a clock ever comes in
which an output or any other register would differ. Where the answer is a path to such a clock, the registers that
differ at its end are doubled too, and it is asked again.

To keep the question small, some registers are cut open: they may hold anything in any clock. That allows more than
ever happens, so what is never reached is never reached with them whole either.
"""

from __future__ import annotations

import dataclasses
import re
import tempfile
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from types import TracebackType

from contactfpga.skin import Skin
from contactfpga_sim import board, native
from contactfpga_sim.mutants import aig
from contactfpga_sim.mutants.netlist import PREPARE, Mutant, switches
from contactfpga_sim.mutants.solve import reached

QUICK_S, LONG_S = 4, 60
"""How long each question may take."""

_GATES = (
    "memory_map; opt_expr; opt_merge; opt_clean; techmap; dffunmap; simplemap; opt_expr; opt_merge; opt_clean; "
    "aigmap; opt_merge; opt_clean; write_aiger -zinit -map names.txt design.aig"
)
_STORE = "link.store["  # the frames' memory, by far the most registers
_BOUNDARIES = ("row", "record", "byte")


@dataclasses.dataclass(frozen=True)
class Verdict:
    """``outcome`` is ``equivalent``, ``differs`` or ``open``."""

    outcome: str
    clocks: int = 0
    """Where it differs: the clocks from power-up after which an output does, for some inputs that the solver found."""


class Prover:
    """Gateware and some mutants of it, as one circuit whose inputs ``mutant`` pick one."""

    def __init__(self, skin: Skin, mutants: Sequence[Mutant]):
        self._mutants = list(mutants)
        self._folder = tempfile.TemporaryDirectory(prefix="contactfpga-")
        folder = Path(self._folder.name)
        (folder / "model.il").write_text(native.rtlil(board.model_of(skin).elaborate()))
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

    def examine(self, mutant: Mutant, limit_s: int) -> Verdict:
        """Whether the mutant is equivalent; each of a few questions may take ``limit_s`` seconds."""
        number = self._mutants.index(mutant) + 1
        # From the fewest registers to all of them.
        for cut in (self._outside(mutant), self._named(_STORE), frozenset[int]()):
            verdict = self._compare(number, cut, limit_s)
            if verdict.outcome == "equivalent" or (verdict.outcome == "differs" and not cut):
                return verdict
        return Verdict("open")

    def _compare(self, number: int, cut: Collection[int], limit_s: int) -> Verdict:
        """With the registers in ``cut`` holding anything. Where that is none, ``differs`` tells of a real path."""
        twins: dict[int, int] = {}
        while True:
            latches = list(self._latches)
            for index, twin in twins.items():
                latches[index] = twin
            nexts, driven = self._placed(number, latches)
            bad = self._graph.any([*self._differing(nexts, twins).values(), *self._seen(driven)])
            takes = {old >> 1: new for i, (old, new) in enumerate(zip(self._latches, self._nexts)) if i not in cut}
            takes |= {twin >> 1: nexts[index] for index, twin in twins.items()}
            answer = reached(self._graph, takes, bad, limit_s, Path(self._folder.name))
            if answer.outcome != "reached":
                return Verdict({"never": "equivalent", "open": "open"}[answer.outcome])
            values = self._last(takes, answer.path, [bad, *nexts, *self._nexts, *driven])
            assert _value(values, bad), "the solver's path does not lead there"
            found = {index for index, differ in self._differing(nexts, twins).items() if _value(values, differ)}
            if not found or found & set(cut):
                return Verdict("differs", len(answer.path))
            twins |= {index: self._graph.variable() for index in sorted(found)}

    def _placed(self, number: int, latches: Sequence[int]) -> tuple[list[int], list[int]]:
        """Mutant ``number`` over these latches: what they take next, and the outputs."""
        inputs = list(self._inputs)
        for index, name in enumerate(self._circuit.inputs):
            if found := re.fullmatch(r"mutant\[(\d+)\]", name):
                inputs[index] = number >> int(found[1]) & 1
        return self._graph.place(self._circuit, inputs, latches)

    def _differing(self, nexts: Sequence[int], twins: Collection[int]) -> dict[int, int]:
        """For each register that is there once where the mutant's takes something else."""
        pairs = enumerate(zip(self._nexts, nexts))
        return {i: self._graph.differ(one, other) for i, (one, other) in pairs if one != other and i not in twins}

    def _seen(self, driven: Sequence[int]) -> Iterable[int]:
        """Where outputs differ that someone looks at: what is handed over, only while it is."""
        names = self._circuit.outputs
        handed = {name: self._driven[names.index(f"{name}_transfer[0]")] for name in _BOUNDARIES}
        for name, one, other in zip(names, self._driven, driven):
            boundary, _, field = name.partition("_")
            idle = boundary in handed and not field.startswith("transfer")
            yield self._graph.both(self._graph.differ(one, other), handed[boundary] if idle else 1)

    def _last(self, takes: dict[int, int], path: list[dict[int, int]], roots: list[int]) -> dict[int, int]:
        """The values of what ``roots`` depend on in the last clock of a path."""
        state: dict[int, int] = {}
        for inputs in path[:-1]:
            values = self._graph.values({**state, **inputs}, takes.values())
            state = {node: _value(values, literal) for node, literal in takes.items()}
        return self._graph.values({**state, **path[-1]}, roots)

    def _outside(self, mutant: Mutant) -> frozenset[int]:
        """The registers that are in none of the stages that share the mutant's part of the design, and the store."""
        part = re.findall(r"-cell (?:\$flatten)?\\?(\w+)\.", mutant.change)[0]
        return self._named(_STORE) | (frozenset(range(len(self._latches))) - self._named(f"{part}.") - self._named("?"))

    def _named(self, prefix: str) -> frozenset[int]:
        names = enumerate(self._circuit.latches)
        return frozenset(index for index, some in names if any(name.startswith(prefix) for name in some))


def _value(values: dict[int, int], literal: int) -> int:
    return values[literal >> 1] ^ literal & 1


def examine(
    skin: Skin, mutants: Sequence[Mutant], limit_s: int, done: Callable[[Mutant, Verdict], None] = lambda *_: None
) -> dict[Mutant, Verdict]:
    """A verdict for each mutant; ``done`` is called with each."""
    verdicts: dict[Mutant, Verdict] = {}
    with Prover(skin, mutants) as prover:
        for mutant in mutants:
            verdicts[mutant] = prover.examine(mutant, limit_s)
            done(mutant, verdicts[mutant])
    return verdicts
