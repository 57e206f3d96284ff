"""Checks of values from outside."""

from __future__ import annotations

import math
import operator
import shlex
from collections.abc import Iterable
from numbers import Real
from typing import Any

MAX_SHOWN = 80
MAX_MESSAGE = 4000
"""Most characters of a message; paths have up to 4,096."""


def is_finite(value: object) -> bool:
    """Whether a value is a finite number that fits a float, and no bool."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def whole(value: object) -> int | None:
    """An integer, also one of numpy, as an int; None for any other value, such as 8.0."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        return None
    try:
        return int(operator.index(value))
    except TypeError:  # numpy's bool, and arrays of more than one number
        return None


def number_in(text: str) -> float:
    """The number in a text; NaN, which is out of every range, without a number."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def shown(value: Any) -> str:
    """``repr`` of a value, shortened for a message."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # a number of more digits than Python writes, or lists in lists in lists
        return f"one {type(value).__name__} too long to show"
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 20]}... ({len(text)} characters)"


def suggestion(name: str, known: Iterable[str]) -> str:
    """A hint for an unknown name: the most similar known name, or all."""
    from difflib import get_close_matches  # for whoever misspells alone

    names = list(known)
    near = get_close_matches(name[:MAX_SHOWN], names, 1)
    return f"did you mean {near[0]!r}?" if near else f"known are {', '.join(names)}"


def shortened(text: str) -> str:
    """A message, without its middle if it is long."""
    if len(text) <= MAX_MESSAGE:
        return text
    return f"{text[: MAX_MESSAGE // 2]}... ({len(text):,} characters) ...{text[-MAX_MESSAGE // 2 :]}"


def visible(text: str) -> str:
    """The text with control characters and bidirectional marks escaped."""
    return "".join(one if one.isprintable() else _escaped(one) for one in text)


def visible_lines(text: str) -> str:
    return "\n".join(map(visible, text.split("\n")))


def _escaped(character: str) -> str:
    return character.encode("unicode_escape", "backslashreplace").decode("ascii")


def shell_words(*words: object) -> str:
    """A command for a message, to be pasted into a shell."""
    return shlex.join(map(str, words))
