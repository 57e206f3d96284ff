"""TOML files from outside, refused with one sentence if invalid."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from contactfpga.inputs.files import read_small
from contactfpga.inputs.values import shown, suggestion

Table = TypeVar("Table")

MAX_BYTES = 1_000_000
MAX_DEPTH = 16
"""Most nested tables and lists, and parts of a dotted key, whose parsing time is quadratic."""

_NO_KEY = re.compile(
    r'''"""(?:[^\\"]++|\\(?:.|\Z)|"(?!""))*(?:"""|\Z)|'{3}(?:[^']++|'(?!''))*(?:'{3}|\Z)'''
    r"""|"(?:[^\\"\n]++|\\.)*"?|'[^'\n]*+'?|\#[^\n]*+""",
    re.DOTALL,
)
"""Strings and comments, also unterminated ones, each matched at the first try. Before Python 3.11.5 a possessive
quantifier of a group with alternatives may match too much.
"""
_LONG_KEY = re.compile(rf"\.(?:[^.=,{{}}\[\]\n]*+\.){{{MAX_DEPTH - 1}}}")


def load(path: str | Path, refused: type[ValueError]) -> dict[str, Any]:
    """The content of a TOML file. Raises ``refused`` for invalid TOML, OSError."""
    return parse(read_small(path, MAX_BYTES, "a TOML file", refused), path, refused)


def parse(data: bytes, path: str | Path, refused: type[ValueError]) -> dict[str, Any]:
    """The content of a TOML file of these bytes. Raises ``refused``."""
    if len(data) > MAX_BYTES:
        raise refused(f"{path}: longer than {MAX_BYTES:,} bytes; is it a TOML file?")
    try:
        text = data.decode("utf-8-sig")  # some editors begin with a byte order mark
    except UnicodeDecodeError as error:
        raise refused(f"{path}: not a TOML file: it is not UTF-8 ({error.reason} at byte {error.start})") from None
    if _LONG_KEY.search(_NO_KEY.sub("", text)):
        raise refused(f"{path}: a key has more than {MAX_DEPTH} parts with dots between; use shorter keys")
    try:
        values = tomllib.loads(text)
    except RecursionError:
        raise refused(f"{path}: tables and lists lie more than {MAX_DEPTH} deep in each other") from None
    except ValueError as error:  # of TOML, or a number of thousands of digits
        raise refused(f"{path}: not a TOML file: {error}") from None
    _check(path, values, refused)
    return values


def load_table(path: str | Path, name: str, read: Callable[[Any], Table], refused: type[ValueError]) -> Table | None:
    """The file's table ``name``, converted by ``read``; None without such a table. Raises ``refused``, OSError."""
    values = load(path, refused)
    if name not in values:
        return None
    try:
        return read(values[name])
    except refused as error:
        raise refused(f"{path}: {error}") from None


def fields_of(kind: type, name: str, values: Any, refused: type[ValueError]) -> dict[str, Any]:
    """A table whose keys are fields of the dataclass ``kind``. Raises ``refused`` for other keys."""
    if not isinstance(values, dict):
        raise refused(f"{name} is {shown(values)}; it must be a part, [{name}]")
    known = [field.name for field in dataclasses.fields(kind)]
    for key in values:
        if key not in known:
            raise refused(f"unknown key {shown(key)} in [{name}]; {suggestion(key, known)}")
    return values


def _check(path: str | Path, values: dict[str, Any], refused: type[ValueError]) -> None:
    todo: list[tuple[str, Any, int]] = [(name, value, 1) for name, value in values.items()]
    while todo:
        name, value, depth = todo.pop()
        if depth > MAX_DEPTH:
            raise refused(f"{path}: tables and lists lie more than {MAX_DEPTH} deep in each other")
        if isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise refused(f"{path}: {shown(name)} is {shown(value)}; whole numbers have 64 bits in TOML")
        if isinstance(value, dict):
            todo += [(key, one, depth + 1) for key, one in value.items()]
        elif isinstance(value, list):
            todo += [(name, one, depth + 1) for one in value]
