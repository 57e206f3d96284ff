"""Abilities of the stream to which a command writes: width, characters, and rewriting.

Text for a file or a pipe is not wrapped. Characters that the encoding lacks are replaced.
"""

from __future__ import annotations

import codecs
import contextlib
import dataclasses
import os
import sys
import textwrap
import time
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from typing import IO, TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from rich.console import Console

PIPE_WIDTH = 160
"""Width in characters of tables and pictures that go to a file or a pipe."""

USUAL_WIDTH, USUAL_HEIGHT = 80, 24
"""Columns and lines of a terminal of unknown size."""

NARROWEST = 20
"""Least assumed width in characters."""

_NEAREST = {
    "·": "|",
    "…": "...",
    "–": "-",
    "—": "-",
    "−": "-",
    "²": "2",
    "³": "3",
    "µ": "u",
    "μ": "u",
    "×": "x",
    "δ": "d",
    "Ω": "Ohm",
    "°": "deg",
    "≤": "<=",
    "≥": ">=",
}

_ERRORS = "contactfpga.nearest"


@dataclasses.dataclass(frozen=True)
class Terminal:
    """Abilities of an output stream."""

    width: int
    height: int | None
    """Lines; None: unlimited."""
    unicode: bool
    """Whether the stream takes all characters, not only ASCII."""
    wraps: bool
    """Whether to break long lines at the width, because a person reads them."""
    live: bool
    """Whether written text can be overwritten."""


def of(stream: IO[str] | None = None) -> Terminal:
    """The abilities of a stream, by default standard output, at this moment."""
    stream = sys.stdout if stream is None else stream
    size = _size(stream)
    asked = _columns_asked()
    usual = PIPE_WIDTH if size is None else size.columns or USUAL_WIDTH
    return Terminal(
        width=max(NARROWEST, asked or usual),
        height=None if size is None else size.lines or USUAL_HEIGHT,
        unicode=(getattr(stream, "encoding", None) or "utf-8").lower().startswith("utf"),
        wraps=size is not None,
        # What stands in for a stream hands lines on, below which something else is drawn.
        live=size is not None
        and stream in (sys.__stdout__, sys.__stderr__)
        and os.environ.get("TERM", "") not in ("", "dumb", "unknown"),
    )


def _size(stream: IO[str]) -> os.terminal_size | None:
    try:
        return os.get_terminal_size(stream.fileno()) if stream.isatty() else None
    except (OSError, ValueError):
        return None


def _columns_asked() -> int | None:
    text = os.environ.get("COLUMNS", "")
    return int(text) if text.isascii() and text.isdigit() and int(text) else None


def prepare() -> None:
    """Replace unencodable characters from now on, so that none ends a command."""
    codecs.register_error(_ERRORS, _nearest)
    if sys.stdout is None:  # closed by a shell's >&-
        sys.stdout = _nowhere()
    if sys.stderr is None:
        sys.stderr = _nowhere()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=_ERRORS)


def drop_unwritable() -> None:
    """Discard output that standard output refused; otherwise Python retries it at exit and ends with status 120."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _nowhere() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")


def _nearest(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    if all("\udc80" <= character <= "\udcff" for character in text):  # bytes of a file's name, as they were
        return bytes(ord(character) - 0xDC00 for character in text), error.end
    return "".join(map(_ascii, text)), error.end


def _ascii(character: str) -> str:
    if character in _NEAREST:
        return _NEAREST[character]
    return unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode() or "?"


def wrapped(text: str, width: int, hang: int = 0) -> str:
    """The text with its first line broken into lines of at most ``width`` characters, except for longer words; all but
    the first are indented by ``hang``. Further lines of the text are for copying and stay whole.
    """
    first, *rest = text.split("\n")
    lines = textwrap.wrap(first, width, subsequent_indent=" " * hang, break_long_words=False, break_on_hyphens=False)
    return "\n".join([*(lines or [""]), *rest])


def say(text: str, stream: TextIO | None = None, hang: int = 0) -> None:
    """Print a text, wrapped if a person reads the stream."""
    stream = sys.stdout if stream is None else stream
    shown = of(stream)
    print(wrapped(text, shown.width, hang) if shown.wraps else text, file=stream, flush=True)


def listed(start: str, items: Iterable[str], width: int, between: str = ", ") -> str:
    """``start`` and the items with ``between`` between them, wrapped between items only."""
    # Spaces of an item hold together as these do; they are spaces again in the end.
    text = between.join(item.replace(" ", "\xa0") for item in items)
    return wrapped(f"{start}{text}", width, 2).replace("\xa0", " ")


def console(stream: TextIO | None = None) -> Console:
    """Rich's console for a stream, by default standard output, with the stream's abilities."""
    from rich.console import Console

    class Ours(Console):
        def on_broken_pipe(self) -> None:
            raise  # by which every command ends well whose reader has enough; rich's way is status 1

    stream = sys.stdout if stream is None else stream
    shown = of(stream)
    # A terminal that can be rewritten can be resized too, which rich follows by itself.
    return Ours(file=stream, width=None if shown.live else shown.width, highlight=False)


SOON_S = 1.0
"""Duration in s up to which no progress is shown."""
LIVE_S, LINES_S = 0.2, 10.0
"""Intervals of progress in s: on a terminal that can be rewritten, and elsewhere in lines."""


@contextlib.contextmanager
def reading(name: str) -> Iterator[Callable[[int, int], None]]:
    """Context that shows on standard error how far a long file is read. It yields a function of the bytes read and the
    file's size.
    """
    live = of(sys.stderr).live
    due_s, said = time.monotonic() + SOON_S, False

    def tell(done: int, size: int) -> None:
        nonlocal due_s, said
        if time.monotonic() < due_s:
            return
        due_s, said = time.monotonic() + (LIVE_S if live else LINES_S), True
        line = f"Reading {name}: {done / 1e6:,.0f} of {size / 1e6:,.0f} MB"
        print(f"\r{line}" if live else line, end="\033[K" if live else "\n", file=sys.stderr, flush=True)

    try:
        yield tell
    finally:
        if said and live:
            print("\r", end="\033[K", file=sys.stderr, flush=True)
