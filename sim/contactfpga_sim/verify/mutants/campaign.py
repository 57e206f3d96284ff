"""Mutants of the gateware, how many of them the comparison with the golden model tells, and the rest.

For each Skin mutants are drawn at random. Those that short stimuli leave are tried for a proof of equivalence; what is
left then goes through long stimuli, and through longer trials of a proof. What is alive in the end is listed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence

from contactfpga.skin.several import Several
from contactfpga_sim.verify.mutants import netlist, proof, sheets, stimuli, trial
from contactfpga_sim.verify.mutants.netlist import STAGES, Design, Mutant
from contactfpga_sim.verify.mutants.skins import OPTIONS, SEVERAL, SKINS
from contactfpga_sim.verify.mutants.stimuli import Stimulus

BATCH = 500
"""Mutants in one board: with more of them it runs slower."""

CHECKED = 2
"""This many of the killed mutants of each Skin are given to the prover too, which must not prove them."""


@dataclasses.dataclass(frozen=True)
class Result:
    """What became of a mutant: ``killed``, ``equivalent`` or ``alive``."""

    skin: str
    mutant: Mutant
    fate: str


def chosen(name: str) -> tuple[Design, tuple[str, ...]]:
    """The Skin or the sheets of this name, and the stages whose mutants are drawn."""
    if name in SKINS:
        return SKINS[name], tuple(STAGES)
    return SEVERAL[name] if name in SEVERAL else OPTIONS[name]


def left_by(design: Design, mutants: Sequence[Mutant], stimuli: Iterable[Stimulus]) -> list[Mutant]:
    """The mutants that behave as the golden model says under every stimulus."""
    given = list(stimuli)
    left: list[Mutant] = []
    for start in range(0, len(mutants), BATCH):
        batch = mutants[start : start + BATCH]
        model = netlist.model(design, batch)
        left += [batch[n - 1] for n in trial.survivors(design, model, range(1, len(batch) + 1), given)]
    return left


def examine(
    name: str, count: int, seed: int, long_s: int = proof.LONG_S, say: Callable[[str], None] = lambda _: None
) -> list[Result]:
    """The fates of ``count`` mutants of what is :func:`chosen`; ``long_s`` are the seconds of a longer proof.

    Raises :class:`contactfpga_sim.verify.mutants.proof.Contradiction` when a killed mutant is proved equivalent.
    """
    design, stages = chosen(name)
    given = sheets if isinstance(design, Several) else stimuli
    say("draw")
    drawn = netlist.draw([mutant for mutant in netlist.candidates(design) if mutant.stage in stages], count, seed)
    say(f"{len(drawn)} mutants, short stimuli")
    left = left_by(design, drawn, given.quick(design))
    say(f"{len(left)} left, proofs")
    killed = [mutant for mutant in drawn if mutant not in left][:CHECKED]
    proved = _proved(design, [*left, *killed], proof.QUICK_S)
    if wrong := proved & {*killed}:
        raise proof.Contradiction(f"killed, yet proved equivalent: {', '.join(map(str, wrong))}")
    left = [mutant for mutant in left if mutant not in proved]
    say(f"{len(left)} left, long stimuli")
    longest = [stimuli.until_time_wraps(SKINS[name])] if name in SKINS else []  # minutes in the model of an option
    left = left_by(design, left, [*given.thorough(design), *longest])
    say(f"{len(left)} left, longer proofs")
    proved |= _proved(design, left, long_s)
    alive = {*left} - proved
    say(f"{len(alive)} alive")
    fates = (
        (mutant, "equivalent" if mutant in proved else "alive" if mutant in alive else "killed") for mutant in drawn
    )
    return [Result(name, mutant, fate) for mutant, fate in fates]


def _proved(design: Design, mutants: Sequence[Mutant], limit_s: int) -> set[Mutant]:
    return {mutant for mutant, same in zip(mutants, proof.equivalent(design, mutants, limit_s)) if same}
