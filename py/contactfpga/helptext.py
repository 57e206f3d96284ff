"""The text of `help()` on a class, with its fields' docstrings, which Python drops."""

from __future__ import annotations

import ast
import inspect
import itertools
import re
import textwrap
from collections.abc import Iterator
from typing import NamedTuple

HEAD = "Fields:"
WIDTH = 100
_ROLES = re.compile(r":\w+:`~?([^`]*)`")
_MADE = {"property", "cached_property", "functools.cached_property"}


class Field(NamedTuple):
    name: str
    declared: str
    """Name, type and default, as far as the source states them."""
    text: str


class _Completed:
    """A docstring that reads the fields from the source on first access."""

    def __init__(self, kind: type):
        self._kind, self._own = kind, kind.__doc__
        self._text: str | None = None

    def __get__(self, instance: object, owner: type) -> str | None:
        if self._text is None and self._own is not None:
            self._text = _with_fields(self._own, self._kind)
        return self._text


def complete(kind: type) -> None:
    """Make the docstring of a class list its fields."""
    later = _Completed(kind)
    # Of a class whose own class is in Python, as those of ABCMeta, `help()` takes what is stored and asks nothing.
    kind.__doc__ = later if type(kind) is type else later.__get__(None, kind)  # type: ignore[assignment]


def _with_fields(own: str, kind: type) -> str:
    found: dict[str, Field] = {}
    for each in kind.__mro__:
        if each.__module__.startswith("contactfpga"):
            found = {field.name: field for field in fields(each)} | found
    if not found:
        return own
    lines = [HEAD]
    for field in found.values():
        lines.append(f"    {field.declared}")
        words = " ".join(_ROLES.sub(r"`\1`", field.text).replace("``", "`").split())
        lines += textwrap.wrap(words, WIDTH, initial_indent=" " * 8, subsequent_indent=" " * 8)
    return f"{inspect.cleandoc(own)}\n\n" + "\n".join(lines)


def fields(kind: type) -> Iterator[Field]:
    """The fields that the source of a class declares; none if the source is not available."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(kind)))
    except (OSError, TypeError, SyntaxError):
        return
    body = tree.body[0]
    if isinstance(body, ast.ClassDef):
        stated = {one.name: one.metadata.get("limits") for one in getattr(kind, "__dataclass_fields__", {}).values()}
        for field in _declared(body.body):
            if not field.name.startswith("_"):
                limits = stated.get(field.name)
                yield field._replace(text=field.text + _range(*limits)) if limits else field


def _range(low: float, high: float, unit: str = "") -> str:
    return f" From {low:,.12g} to {high:,.12g} {unit}".rstrip() + "."


def _declared(body: list[ast.stmt]) -> Iterator[Field]:
    for statement, following in zip(body, [*body[1:], ast.Pass()]):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            given = {one.arg: one.value for one in getattr(statement.value, "keywords", ())}
            statement.value = given.get("default", statement.value)
            yield Field(statement.target.id, ast.unparse(statement), _text(following))
        elif isinstance(statement, ast.FunctionDef) and statement.name == "__init__":
            yield from _assigned(statement.body)
        elif isinstance(statement, ast.FunctionDef) and {*map(ast.unparse, statement.decorator_list)} & _MADE:
            kind = "" if statement.returns is None else f": {ast.unparse(statement.returns)}"
            yield Field(statement.name, f"{statement.name}{kind}", ast.get_docstring(statement) or "")


def _assigned(body: list[ast.stmt]) -> Iterator[Field]:
    for statement, following in itertools.pairwise(body):
        if not isinstance(statement, ast.Assign | ast.AnnAssign) or not _text(following):
            continue
        target = statement.target if isinstance(statement, ast.AnnAssign) else statement.targets[0]
        if isinstance(target, ast.Attribute):
            kind = f": {ast.unparse(statement.annotation)}" if isinstance(statement, ast.AnnAssign) else ""
            yield Field(target.attr, f"{target.attr}{kind}", _text(following))


def _text(statement: ast.stmt) -> str:
    value = statement.value if isinstance(statement, ast.Expr) else None
    return value.value if isinstance(value, ast.Constant) and isinstance(value.value, str) else ""
