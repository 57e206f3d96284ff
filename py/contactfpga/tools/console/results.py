"""The result of a command: JSON for a script, text for a person."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path

from contactfpga import terminal


def show(args: argparse.Namespace, answer: object, text: Callable[[], object] | None = None) -> None:
    """Print ``answer`` as a line of JSON with ``--json``; otherwise call ``text``, which prints the same for a person.
    None: it is printed already.

    ``answer`` holds JSON's own types, paths, arrays, dataclasses and what has a ``to_dict``. Names of numbers end in
    their unit. A number that is not finite becomes null, as JSON has none.
    """
    if args.json:
        print(json.dumps(_plain(answer), allow_nan=False), flush=True)
    elif text is not None:
        text()


def table(*rows: tuple[str, str]) -> None:
    """Print a title and a value per line, with all values in one column."""
    wide = max(len(title) for title, _ in rows) + 2
    for title, value in rows:
        terminal.say(f"{title:{wide}}{value}", hang=wide)


def _plain(value: object) -> object:
    if hasattr(value, "to_dict"):
        value = value.to_dict()
    elif hasattr(value, "tolist"):
        value = value.tolist()
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    elif dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value
