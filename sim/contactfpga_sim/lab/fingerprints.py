"""Fingerprints of a section's code: the set of statements of all reached modules, without imports, comments,
docstrings and positions."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import io
import sys
from collections.abc import Iterator
from pathlib import Path

from contactfpga_sim.lab.registry import Study, StudyRun
from contactfpga_sim.model.board import sources

LENGTH = 8


def fingerprint(study: Study, section: str) -> str:
    declared = study.sections[section]
    if declared.of_netlists:
        return _hashed("\n".join((*_netlists(study, section), *_marks(_file(study.module(declared.makes))))))
    return _of(frozenset(study.module(place) for place in (declared.makes, study.compute) if place))


def _netlists(study: Study, section: str) -> list[str]:
    from contactfpga_sim.apps import size

    with size.keys_alone() as keys, contextlib.redirect_stderr(io.StringIO()):
        StudyRun(study).text(section)
    return keys


def _file(module: str) -> Path:
    return Path(sys.modules[module].__file__ or "")


@functools.cache
def _of(modules: frozenset[str]) -> str:
    marks = {mark for file in sources.files(modules) for mark in _marks(file)}
    return _hashed("\n".join(sorted(marks)))


def _hashed(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


@functools.cache
def _marks(file: Path) -> tuple[str, ...]:
    data = file.read_bytes()
    if file.suffix != ".py":
        return (hashlib.sha256(data).hexdigest(),)
    statements = [one for one in ast.parse(data).body if not _says_nothing(one)]
    return tuple(hashlib.sha256(repr(_plain(one)).encode()).hexdigest() for one in statements)


def _says_nothing(statement: ast.AST) -> bool:
    if isinstance(statement, ast.If):
        return isinstance(statement.test, ast.Name) and statement.test.id == "TYPE_CHECKING"
    if isinstance(statement, ast.Expr):
        return isinstance(statement.value, ast.Constant)
    return isinstance(statement, (ast.Import, ast.ImportFrom))


def _plain(node: object) -> object:
    """A syntax tree as plain values, equal in all Python versions."""
    if isinstance(node, ast.AST):
        return type(node).__name__, *_fields(node)
    if isinstance(node, list):
        return [_plain(one) for one in node if not (isinstance(one, ast.stmt) and _says_nothing(one))]
    return node


def _fields(node: ast.AST) -> Iterator[tuple[str, object]]:
    for name, value in ast.iter_fields(node):
        if value not in (None, []) and name not in ("ctx", "kind", "type_comment"):
            yield name, _plain(value)
