"""What the topics of `contactfpga cover` print: tables in mm and kPa, JSON in SI units."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

from contactfpga.design.cover.answer import NoSolution
from contactfpga.errors import UNSOLVED

MM, KPA = 1e3, 1e-3


def say(known: dict[str, Any]) -> int:
    """Print an answer as one JSON object."""
    print(json.dumps(known, default=_plain, allow_nan=False))
    return 0


def _plain(value: object) -> object:
    if isinstance(value, NoSolution):
        return {"no_solution": value.reason}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    raise TypeError(f"{value!r} is no JSON")


def unsolved(answer: NoSolution, as_json: bool) -> int:
    """Print why there is no answer."""
    if as_json:
        say({"no_solution": answer.reason})
    else:
        print(answer)
    return UNSOLVED


def table(*lines: tuple[str, str]) -> None:
    """Print titles and values as two columns."""
    wide = max(len(title) for title, _ in lines)
    for title, value in lines:
        print(f"{title:{wide}}  {value}")


def notes(found: list[str]) -> int:
    """Print where a model is rough."""
    for note in found:
        print(f"note: {note}")
    return 0
