"""What is proved: the table that ``make formal`` goes through."""

import dataclasses
from collections.abc import Callable

from contactfpga_sim.verify.proofs.bugs import Bug
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.solve import Verdict, prove, search


@dataclasses.dataclass(frozen=True)
class Case:
    """One proof at one size, and the bugs that it must find."""

    claim: str
    size: str
    build: Callable[[Proof], None]
    clocks: int
    """That the induction may look at together; with ``bounded`` those that are searched."""
    bugs: tuple[Bug, ...] = ()
    bug_clocks: int = 12
    """From power-up, in which a planted bug must break a claim."""
    bounded: bool = False
    campaign: bool = False
    """Takes too long for ``make test``."""

    @property
    def name(self) -> str:
        return f"{self.claim}, {self.size}"

    def run(self, limit_s: float = 3600) -> Verdict:
        solve = search if self.bounded else prove
        return solve(self.build, self.clocks, limit_s)

    def run_with(self, bug: Bug, limit_s: float = 3600) -> Verdict:
        """Look for a counterexample to the claims, without the lemmas, in the gateware with the bug."""
        return search(self.build, self.bug_clocks, limit_s, bug)
