"""Claims, planted bugs, and verdicts: forever, by induction, or by search from power-up."""

import dataclasses
import json
import subprocess
import sys
import time
from collections.abc import Callable

from amaranth.back import rtlil
from amaranth.hdl import Fragment, Signal, Value
from amaranth.hdl._ast import Part
from amaranth.hdl._xfrm import StatementTransformer, ValueTransformer

from contactfpga.errors import ContactFPGAError
from contactfpga_sim.model.board import cache, native
from contactfpga_sim.verify.proofs import induction
from contactfpga_sim.verify.proofs.inside import Inside, fields_of, fragments
from contactfpga_sim.verify.proofs.proof import Proof


@dataclasses.dataclass(frozen=True)
class Bug:
    """A wrong value of a signal that a class drives, in the elaborated design."""

    name: str
    owner: type
    signal: str
    """Name in the driving component, with a bundle's field: ``join.place``."""
    wrong: Callable[[Value, Inside], object]
    """Function from the right value and the component's signals to the wrong one; for a register, in the next clock."""


def plant(bug: Bug, design: Fragment) -> None:
    """Plant the bug in the elaborated design.

    Raises LookupError if the design lacks the class, or the class drives no such signal.
    """
    owners = [part for part in fragments(design) if isinstance((part.origins or (None,))[0], bug.owner)]
    if not owners:
        raise LookupError(f"{bug.name}: there is no {bug.owner.__name__} in the design")
    for part in owners:
        _change(bug, part)


def _change(bug: Bug, part: Fragment) -> None:
    inside = Inside(part)
    name, *fields = bug.signal.split(".")
    domain, signal = inside.driven(name)
    right = Signal(signal.shape(), name=f"{name}_right", init=signal.init)
    statements = part.statements[domain]
    if domain == "comb":
        part.statements[domain] = _Redirected({id(signal): right}).on_statements(statements)
    else:
        nobody = Signal.like(signal, name=f"{name}_unused")
        everything_else = {id(other): Signal.like(other, name="unused") for other in inside.registers_here()}
        following = _Redirected({**everything_else, id(signal): right}).on_statements(statements)
        part.add_statements("comb", right.eq(signal), *following)
        part.statements[domain] = _Redirected({id(signal): nobody}).on_statements(statements)
    part.add_statements(domain, signal.eq(right))
    start, stop = fields_of(signal, fields)
    part.add_statements(domain, signal[start:stop].eq(bug.wrong(right[start:stop], inside)))


class _Redirected(StatementTransformer):
    def __init__(self, targets: dict[int, Signal]):
        self._target = _Target(targets)

    def on_value(self, value):
        return value

    def on_Assign(self, stmt):  # noqa: N802
        return type(stmt)(self._target(stmt.lhs), stmt.rhs)


class _Target(ValueTransformer):
    def __init__(self, targets: dict[int, Signal]):
        self._targets = targets

    def on_Signal(self, value):  # noqa: N802
        return self._targets.get(id(value), value)

    def on_Part(self, value):  # noqa: N802
        return Part(self(value.value), value.offset, value.width, value.stride)


# One bad state per claim: a circuit of gates and latches that start at 0.
_GATES = (
    "read_rtlil model.il; hierarchy -top top; proc; flatten; memory; async2sync; dffunmap; chformal -lower; opt_expr; "
    "opt_merge; opt_clean; setundef -anyseq; techmap; dffunmap; simplemap; opt_expr; opt_merge; opt_clean; aigmap; "
    "opt_merge; opt_clean; write_aiger -B -zinit -map names.txt design.aig"
)


class ProofFailed(ContactFPGAError):
    """The solver ended without an answer; the message has its output."""


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Result of a proof or search."""

    outcome: str
    """``proved``, ``counterexample``, or ``open`` if depth or time was too short."""
    clocks: int
    """Clocks of the induction, search or counterexample."""
    seconds: float
    said: str
    """Inputs and registers of a counterexample, or of the step that no induction excludes."""


def prove(build: Callable[[Proof], None], clocks: int, limit_s: float = 600) -> Verdict:
    """Whether claims and lemmas of ``build`` hold forever, by induction over at most ``clocks`` clocks."""
    return _solve(build, Proof(), clocks, limit_s, forever=True)


def search(build: Callable[[Proof], None], clocks: int, limit_s: float = 600, bug: Bug | None = None) -> Verdict:
    """Whether the claims of ``build``, without lemmas, hold in the first ``clocks`` clocks, in gateware with ``bug`` if
    given."""
    return _solve(build, Proof(claims_alone=True), clocks, limit_s, bug=bug)


def _solve(build, proof: Proof, clocks: int, limit_s: float, forever: bool = False, bug: Bug | None = None) -> Verdict:
    started = time.monotonic()
    build(proof)
    top = Fragment.get(proof.m, None)
    if bug is not None:
        plant(bug, top)
    with cache.scratch(cache.ready(cache.cache_folder()), "proof") as work:
        design = rtlil.convert(top, name="top", ports=proof.ports, emit_src=False)
        (work / "model.il").write_text(design, encoding="utf-8")
        native.yosys(_GATES, work)
        command = [sys.executable, "-m", induction.__name__, str(work), str(clocks), *["--forever"] * forever]
        try:
            ran = subprocess.run(command, capture_output=True, text=True, timeout=limit_s)
        except subprocess.TimeoutExpired:
            return Verdict("open", 0, time.monotonic() - started, f"no answer after {limit_s:.0f} s")
    if ran.returncode:
        raise ProofFailed(f"the solver gave no answer:\n{(ran.stdout + ran.stderr)[-3000:]}")
    outcome, reached, said = json.loads(ran.stdout)
    return Verdict(outcome, reached, time.monotonic() - started, said)


@dataclasses.dataclass(frozen=True)
class ProofCase:
    """One proof at one size, and the bugs that it must find."""

    claim: str
    size: str
    build: Callable[[Proof], None]
    clocks: int
    """Largest depth of the induction, or the clocks before one at rest; with ``bounded``, of the search."""
    bugs: tuple[Bug, ...] = ()
    bug_clocks: int = 12
    """Clocks from power-up within which a bug must break a claim."""
    bounded: bool = False
    campaign: bool = False
    """Whether the proof is too slow for ``make test``."""

    @property
    def name(self) -> str:
        return f"{self.claim}, {self.size}"

    def run(self, limit_s: float = 3600) -> Verdict:
        solve = search if self.bounded else prove
        return solve(self.build, self.clocks, limit_s)

    def run_with(self, bug: Bug, limit_s: float = 3600) -> Verdict:
        """Search for a counterexample to the claims in the gateware with the bug."""
        return search(self.build, self.bug_clocks, limit_s, bug)
