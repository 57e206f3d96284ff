"""``make mutants-tested``: random changes of the gateware's source, and whether ``make test`` notices them.

A change is one place of an assignment or a condition: an operator is another one or loses an operand, a condition or a
bit is inverted, the ways of a choice change places, a number is one more, an assignment is left out. Each is planted
in a copy of the gateware. Of the default tests of stages, co-simulation and proofs those that run the changed function
are run, the cheapest first, until one fails. What was found is kept in a file, so that the command goes on where it was
stopped.
"""

import argparse
import ast
import collections
import dataclasses
import json
import os
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import planted

from contactfpga_sim.lab import writer

GATEWARE = planted.ROOT / "hdl" / planted.GATEWARE
KEPT = planted.ROOT / "build" / "tested-mutants"
TESTS = ("tests/gateware", "tests/cosim", "tests/proofs")
"""Whose default tests are asked."""
PROOFS = "tests/proofs/test_formal.py"
LEFT_OUT = ("board/", "__init__.py")
"""Pins and bitstreams of boards are no stage; their tests are those of the boards."""
CHEAP_S = 12
"""Processor time that the tests may take that are run first."""
LIMIT_S = 1800
COUNT = 60
"""Changes that are drawn."""

EXPLAINED: dict[tuple[str, str], tuple[str, str]] = {
    ("label/steps.py", "left.work & has_before -> (has_before)"): (
        "equivalent",
        "Once the walk of a row has ended, no run is left in it (proof *nothing overflows, nothing is left*).",
    ),
    ("link/request.py", "8 -> 9"): (
        "equivalent",
        "The constant fits into eight bits, and `bit` selects one of these.",
    ),
}
"""Of changes that no test notices, by file and text: whether they are ``equivalent``, or ``alive``; and why."""

_OTHER: dict[type, tuple[str, ...]] = {
    ast.BitAnd: ("|",),
    ast.BitOr: ("&",),
    ast.BitXor: ("|",),
    ast.Add: ("-",),
    ast.Sub: ("+",),
    ast.Eq: ("!=",),
    ast.NotEq: ("==",),
    ast.Lt: ("<=",),
    ast.LtE: ("<",),
    ast.Gt: (">=",),
    ast.GtE: (">",),
}


@dataclasses.dataclass(frozen=True)
class Change:
    """``new`` in the place of the characters from ``begin`` to ``end``."""

    file: str
    function: str
    line: int
    begin: int
    end: int
    old: str
    new: str

    @property
    def text(self) -> str:
        old, new = (" ".join(text.split()) for text in (self.old, self.new))
        return f"{old} -> {new}"

    @property
    def name(self) -> str:
        return f"{self.file}:{self.line}: {self.text}"

    def applied(self, source: str) -> str:
        return source[: self.begin] + self.new + source[self.end :]


class _Places(ast.NodeVisitor):
    """All changes of one file."""

    def __init__(self, file: str, source: str):
        self.file, self.source = file, source
        self.changes: list[Change] = []
        self._functions: list[str] = []
        self._names: list[str] = []
        self._inside = False  # an assignment or a condition
        self._starts = [0]
        for line in source.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))

    def _span(self, node: ast.AST) -> tuple[int, int]:
        # Columns count bytes of UTF-8.
        assert self.source.isascii(), self.file
        return self._starts[node.lineno - 1] + node.col_offset, self._starts[node.end_lineno - 1] + node.end_col_offset

    def _text(self, node: ast.AST) -> str:
        begin, end = self._span(node)
        return self.source[begin:end]

    def _add(self, node: ast.AST, new: str) -> None:
        begin, end = self._span(node)
        self.changes.append(
            Change(self.file, self._functions[-1], node.lineno, begin, end, self.source[begin:end], new)
        )

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self._names.append(node.name)
        self.generic_visit(node)
        self._names.pop()

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        self._names.append(node.name)
        self._functions.append(".".join(self._names))
        for statement in node.body:
            self.visit(statement)
        self._functions.pop()
        self._names.pop()

    def visit_With(self, node: ast.With) -> None:
        for item in node.items:
            call = item.context_expr
            if isinstance(call, ast.Call) and ast.unparse(call.func) in ("m.If", "m.Elif"):
                self._add(call.args[0], f"~({self._text(call.args[0])})")
                self._within(call.args[0])
        for statement in node.body:
            self.visit(statement)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if not ast.unparse(node.target).startswith("m.d."):
            self.generic_visit(node)
            return
        elements = node.value.elts if isinstance(node.value, ast.List) else [node.value]
        for element in elements:
            if isinstance(element, ast.Call) and isinstance(element.func, ast.Attribute) and element.func.attr == "eq":
                self._add(element, "*()" if isinstance(node.value, ast.List) else "()")
                self._within(element.args[0])
            else:
                self.visit(element)

    def _within(self, node: ast.AST) -> None:
        before, self._inside = self._inside, True
        self.visit(node)
        self._inside = before

    def visit_Call(self, node: ast.Call) -> None:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "eq" and node.args:
            self._within(node.args[0])
            return
        if isinstance(node.func, ast.Name) and node.func.id == "Mux":
            condition, one, other = map(self._text, node.args)
            self._inside = self._functions and self._inside
            if self._functions:
                self._add(node, f"Mux({condition}, {other}, {one})")
            for argument in node.args:
                self._within(argument)
            return
        if self._inside and isinstance(node.func, ast.Attribute) and node.func.attr == "any":
            self._add(node, f"({self._text(node.func.value)}).all()")
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if self._inside and isinstance(node.op, ast.Invert):
            self._add(node, f"({self._text(node.operand)})")
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if self._inside and type(node.op) in _OTHER:
            left, right = self._text(node.left), self._text(node.right)
            for other in _OTHER[type(node.op)]:
                self._add(node, f"(({left}) {other} ({right}))")
            if isinstance(node.op, ast.BitAnd | ast.BitOr):
                self._add(node, f"({left})")
                self._add(node, f"({right})")
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        if self._inside and len(node.ops) == 1 and type(node.ops[0]) in _OTHER:
            left, right = self._text(node.left), self._text(node.comparators[0])
            for other in _OTHER[type(node.ops[0])]:
                self._add(node, f"(({left}) {other} ({right}))")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if self._inside and type(node.value) is int:
            self._add(node, str(node.value + 1))

    def visit_IfExp(self, node: ast.IfExp) -> None:
        """Which of two is chosen as the gateware is built is left alone."""
        self.visit(node.body)
        self.visit(node.orelse)

    def visit_Subscript(self, node: ast.Subscript) -> None:
        self.visit(node.value)


def files() -> list[str]:
    found = (path.relative_to(GATEWARE).as_posix() for path in GATEWARE.rglob("*.py"))
    return sorted(file for file in found if not file.startswith(LEFT_OUT) and not file.endswith("__init__.py"))


def changes_of(file: str) -> list[Change]:
    source = (GATEWARE / file).read_text()
    places = _Places(file, source)
    places.visit(ast.parse(source))
    return places.changes


def drawn(count: int, seed: int) -> list[Change]:
    """``count`` of all changes at random."""
    every = [change for file in files() for change in changes_of(file)]
    return random.Random(seed).sample(every, count)


# ---- which tests run what


def noting() -> dict[str, str]:
    """Sources that note each of their functions as it is run."""
    changed = {"__init__.py": "noted = set()\n\n\ndef note(name):\n    noted.add(name)\n"}
    for file in files():
        tree = ast.parse((GATEWARE / file).read_text())
        _note(tree, file, [])
        first = 1 if ast.get_docstring(tree) else 0
        tree.body.insert(first, ast.parse("from contactfpga_hdl import note as _note").body[0])
        changed[file] = ast.unparse(ast.fix_missing_locations(tree))
    return changed


def _note(node: ast.AST, file: str, names: list[str]) -> None:
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.FunctionDef | ast.ClassDef):
            _note(child, file, names)
            continue
        inside = [*names, child.name]
        _note(child, file, inside)
        if isinstance(child, ast.FunctionDef):
            child.body.insert(0, ast.parse(f"_note({f'{file}:{chr(46).join(inside)}'!r})").body[0])


def run_noting(folder: Path) -> None:
    """Run all default tests once, on the copy that notes."""
    folder.mkdir(parents=True)
    with planted.planted(noting()) as root:
        environment = planted.environment(root) | {"CONTACTFPGA_TOUCHED": str(folder)}
        environment["PYTHONPATH"] += os.pathsep + str(planted.ROOT / "scripts")
        options = ["--quick", "-q", "-n", "2", "-p", "touching", "-p", "no:cacheprovider", "--timeout", "1200"]
        command = [sys.executable, "-m", "pytest", *options, *TESTS]
        result = subprocess.run(command, cwd=planted.ROOT, env=environment, stdin=subprocess.DEVNULL)
    if result.returncode:
        shutil.rmtree(folder)
        raise SystemExit(f"tests fail without a change (status {result.returncode})")


class Noted:
    """Which tests run a function, and what they take."""

    def __init__(self, folder: Path):
        self._seconds: dict[str, float] = collections.Counter()
        self._touched: dict[str, set[str]] = collections.defaultdict(set)
        for path in folder.glob("*.jsonl"):
            for line in path.read_text().splitlines():
                one = json.loads(line)
                # Proofs are independent of each other; other tests of a file may share what one of them made.
                unit = one["test"] if one["test"].startswith(PROOFS) else one["test"].partition("::")[0]
                self._seconds[unit] += one["seconds"]
                self._touched[unit].update(one["touched"])

    def batches(self, function: str) -> Iterator[list[str]]:
        """Those that run the function, the cheapest first; each batch may cost twice what the one before may."""
        left = sorted((unit for unit, names in self._touched.items() if function in names), key=self._seconds.get)
        most = CHEAP_S
        while left:
            batch = [left.pop(0)]
            while left and sum(map(self._seconds.get, [*batch, left[0]])) < most:
                batch.append(left.pop(0))
            yield batch
            most *= 2


def fate_of(change: Change, tests: Noted) -> dict[str, str]:
    source = change.applied((GATEWARE / change.file).read_text())
    try:
        compile(source, change.file, "exec")
    except SyntaxError as error:
        raise AssertionError(change.name) from error
    with planted.planted({change.file: source}) as root:
        for batch in tests.batches(f"{change.file}:{change.function}"):
            noticed, said = planted.notice(root, batch, LIMIT_S)
            if noticed:
                lines = [line for line in said.splitlines() if line.startswith(("FAILED", "ERROR"))]
                return {"fate": "killed", "by": lines[0][:300] if lines else said[-300:]}
    return {"fate": "alive", "by": ""}


# ---- what came of it


def judged(change: Change, fate: str) -> str:
    return fate if fate == "killed" else EXPLAINED.get((change.file, change.text), (fate, ""))[0]


def table(fates: Sequence[tuple[Change, str]]) -> str:
    """Counts by folder."""
    rows = [["folder", "changes", "killed", "equivalent", "alive", "killed of the rest"]]
    found = [(change.file.rpartition("/")[0] or change.file, judged(change, fate)) for change, fate in fates]
    for folder in [*sorted({folder for folder, _ in found}), "all"]:
        here = [fate for place, fate in found if folder in ("all", place)]
        killed, equivalent, alive = (here.count(fate) for fate in ("killed", "equivalent", "alive"))
        share = f"{100 * killed / (killed + alive):.1f} %" if killed + alive else ""
        rows.append([folder, str(len(here)), str(killed), str(equivalent), str(alive), share])
    return writer.table_of(rows)


def left(fates: Sequence[tuple[Change, str]]) -> str:
    """What no test notices, with the reason."""
    rows = [["place", "change", "fate", "why"]]
    for change, fate in fates:
        if fate != "killed":
            _, why = EXPLAINED.get((change.file, change.text), (fate, "not known"))
            text = change.text.replace("|", "\\|")
            rows.append([f"`{change.file}`, `{change.function}`", f"`{text}`", judged(change, fate), why])
    return writer.table_of(rows)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=COUNT, help="changes (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="for their choice (default %(default)s)")
    parser.add_argument("--again", action="store_true", help="run the tests again for what is alive")
    args = parser.parse_args()
    found = fates(args.count, args.seed, args.again)
    print(f"{table(found)}\n\n{left(found)}")
    return 0


def compute() -> list[tuple[Change, str]]:
    """What the page shows."""
    return fates(COUNT, 0)


def fates(count: int, seed: int, again: bool = False) -> list[tuple[Change, str]]:
    """Changes with what became of each; ``again``: those that were alive are tried again."""
    touched = KEPT / "touched"
    if not touched.is_dir():
        run_noting(touched)
    tests = Noted(touched)
    path = KEPT / "fates.json"
    known = json.loads(path.read_text()) if path.exists() else {}
    changes = drawn(count, seed)
    for number, change in enumerate(changes, 1):
        if change.name in known and not (again and known[change.name]["fate"] == "alive"):
            continue
        started = time.monotonic()
        known[change.name] = fate_of(change, tests)
        path.write_text(json.dumps(known, indent=1) + "\n")
        print(f"{number}: {time.monotonic() - started:.0f} s {change.name} {known[change.name]}", flush=True)
    return [(change, known[change.name]["fate"]) for change in changes]


if __name__ == "__main__":
    sys.exit(main())
