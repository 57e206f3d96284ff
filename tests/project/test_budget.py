"""How much code a contributor has to hold: no folder outgrows its budget, and a budget falls with its folder."""

import ast
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BUDGET = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["contactfpga"]["most-lines"]
SLACK = 200
"""Number of lines below its budget at which a folder's budget has to fall."""


def lines_of(nodes):
    return {line for node in nodes for line in range(node.lineno, node.end_lineno + 1)}


def code_lines(source):
    """Number of lines that hold code: part of a token that is neither a comment nor a docstring."""
    nodes = list(ast.walk(ast.parse(source)))
    texts = lines_of(
        one for one in nodes if isinstance(one, ast.JoinedStr | ast.Constant) and one.lineno < one.end_lineno
    )
    alone = lines_of(
        one for one in nodes if isinstance(one, ast.Expr) and isinstance(getattr(one.value, "value", 0), str)
    )
    written = {line for line, text in enumerate(source.splitlines(), 1) if text.strip()[:1] not in ("", "#")}
    return len((written | texts) - alone)


def test_lines_of_code():
    source = '"""Two\nlines."""\n\n# why\nx = [\n    1,\n]  # here\n\n\ndef f():\n    """One."""\n'
    assert code_lines(source + '    return """a\n\n# b"""\n') == 7


@pytest.mark.parametrize("folder", BUDGET)
def test_each_folder_keeps_its_budget(folder):
    lines = sum(code_lines(file.read_text(encoding="utf-8")) for file in sorted((ROOT / folder).rglob("*.py")))
    most = BUDGET[folder]
    assert lines <= most, f"{folder} has {lines} lines of code, {lines - most} above its budget in pyproject.toml"
    assert lines > most - SLACK, f"{folder} has {lines} lines of code; lower its budget of {most} in pyproject.toml"
