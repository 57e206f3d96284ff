"""Which mutants are no change at all: equivalence from every state, by SAT.

Both boards, every register and memory word of them cut open: what it holds is an input, what it takes next an output.
If no state and no input tells their outputs apart, then two boards that start alike never differ. This is induction of
depth 1 over all registers and proves equivalence for ever; what it does not prove may be equivalent all the same, where
states that never come tell the two apart.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from contactfpga.skin import Skin
from contactfpga_sim import board, native
from contactfpga_sim.mutants.netlist import PREPARE, Mutant

DEPTH = 1
"""Clocks that the induction looks at."""

_TIMEOUT_S = 30
_AT_ONCE = 20
# Each register gets one wire of its own, with a public name: `expose` gives every name of a register a port, and two
# ports would let it hold two values at once.
_CUT = (
    "memory_map; dffunmap; opt_expr; opt_merge; opt_clean -purge; "
    "splitnets -driver; rename -enumerate; expose -dff -evert-dff"
)
_LEVELS = (("gold", 0), ("gate", 1))
_MITER = (
    "miter -equiv -flatten -make_assert gold gate miter; hierarchy -top miter; "
    "opt_expr; opt_merge; opt_expr; opt_merge; opt_clean"
)


def equivalent(skin: Skin, mutants: Sequence[Mutant], done: Callable[[], None] = lambda: None) -> list[bool]:
    """For each mutant whether it is proved equivalent; ``done()`` is called after each."""
    verdicts: list[bool] = []
    with tempfile.TemporaryDirectory(prefix="contactfpga-") as name:
        folder = Path(name)
        (folder / "model.il").write_text(native.rtlil(board.model_of(skin).elaborate()))
        for start in range(0, len(mutants), _AT_ONCE):
            some = mutants[start : start + _AT_ONCE]
            native.yosys("\n".join(_commands(some)), folder)
            for number in range(len(some)):
                verdicts.append("no model found: SUCCESS" in (folder / f"{number}.txt").read_text())
                done()
    return verdicts


def _commands(mutants: Sequence[Mutant]) -> list[str]:
    commands = ["read_rtlil model.il", native.FLATTEN, PREPARE, "design -save plain"]
    for number, mutant in enumerate(mutants):
        commands += [
            "design -load plain",
            # One netlist with a switch is cut, not two netlists, whose registers would be named differently.
            f"mutate -ctrl mutant 1 1 {mutant.change}",
            _CUT,
            "copy top gold; rename top gate",
            *(f"cd {name}; delete -port w:mutant; connect -set mutant 1'{level}; cd .." for name, level in _LEVELS),
            _MITER,
            f"tee -q -o {number}.txt sat -prove-asserts -timeout {_TIMEOUT_S} miter",
        ]
    return commands
