"""Reads the bytes of boards out of what `contactfpga record` wrote: an MCAP file, or several one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from contactfpga.driver.mcap_part import METADATA, McapPart, files_of
from contactfpga.driver.mcap_records import RecordingError
from contactfpga.skin.widths import LONGEST_PACKET
from contactfpga.wire.hellos import find_hello

HELLO_NS = 600_000_000
"""Hellos come twice per second."""


class McapBytes:
    """A recording whose files were closed or recovered. Each :meth:`pieces` reads on its own."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self._parts = [McapPart(one) for one in files_of(self.path)]
        held = {link for part in self._parts for link in part.topics}
        added = [facts.get("link", "") for facts in self.texts(METADATA)]
        self._links = sorted(held, key=lambda link: (added.index(link) if link in added else len(added), link))
        if not self._links:
            raise RecordingError(f"{path} holds no bytes of a board; `contactfpga record` makes files that do")
        parts = [part for part in self._parts if part.topics]
        self.start_ns = min(part.start_ns for part in parts)
        """Since 1970."""
        self.end_ns = max(part.end_ns for part in parts)

    @property
    def links(self) -> list[str]:
        """Names of the links whose bytes it holds, in the order in which they were added."""
        return list(self._links)

    def checked(self, link: str | None) -> str:
        """The link of this name; None: the only one. Raises :class:`RecordingError`."""
        if link is None and len(self._links) == 1:
            return self._links[0]
        if link in self._links:
            return link
        names = ", ".join(self._links)
        if link is None:
            raise RecordingError(f"{self.path} holds several links; name one of them: {names}")
        raise RecordingError(f"{self.path} has no link {link!r}; it has {names}")

    def texts(self, name: str) -> list[dict[str, str]]:
        """The texts of this name that are kept beside the messages; those that each file repeats once."""
        found: list[dict[str, str]] = []
        for part in self._parts:
            found += [one for one in part.texts(name) if one not in found]
        return found

    def pieces(self, link: str | None = None, start_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        """(when the last byte came, bytes) of a link, in order; with ``start_ns`` from the last hello on that had come
        by then, or from the beginning."""
        link = self.checked(link)
        if start_ns is None:
            yield from self._read(link)
            return
        begin_ns, at = start_ns, -1
        for begin_ns in (start_ns - HELLO_NS, start_ns - 8 * HELLO_NS, self.start_ns):
            if (at := _last_hello(self._read(link, begin_ns, start_ns + 1))) >= 0:
                break
        yield from _after(self._read(link, begin_ns, start_ns + 1), max(0, at))
        yield from self._read(link, start_ns + 1)

    def _read(self, link: str, begin_ns: int | None = None, end_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        for part in self._parts:
            yield from part.read(link, begin_ns, end_ns)


class McapStream:
    """The bytes of one link, to be read like a file."""

    def __init__(self, path: str | Path, link: str | None, start_s: float):
        file = McapBytes(path)
        start_ns = file.start_ns + round(start_s * 1e9)
        if start_ns > file.end_ns:
            lasts_s = (file.end_ns - file.start_ns) / 1e9
            raise RecordingError(f"{path} lasts {lasts_s:.3f} s; it cannot start at {start_s:g} s")
        self._pieces = file.pieces(file.checked(link), start_ns if start_s else None)
        self._piece, self._taken = b"", 0

    def read(self, count: int) -> bytes:
        """At most ``count`` bytes; b"" at the end."""
        while self._taken >= len(self._piece):
            if (piece := next(self._pieces, None)) is None:
                return b""
            self._piece, self._taken = piece[1], 0
        data = self._piece[self._taken : self._taken + count]
        self._taken += count
        return data

    def close(self) -> None:
        """Let the file go."""
        self._pieces.close()  # type: ignore[attr-defined]


def _last_hello(pieces: Iterable[tuple[int, bytes]]) -> int:
    """Where in all bytes together the last whole hello begins; -1: there is none."""
    found, before, held = -1, 0, b""
    for _, data in pieces:
        data = held + data
        if (at := find_hello(data, last=True)) >= 0:
            found = before + at
        held = data[data.rfind(0) + 1 :][-LONGEST_PACKET:]
        before += len(data) - len(held)
    return found


def _after(pieces: Iterable[tuple[int, bytes]], at: int) -> Iterator[tuple[int, bytes]]:
    """The pieces without their first ``at`` bytes."""
    for moment, data in pieces:
        if at < len(data):
            yield moment, data[at:]
        at = max(0, at - len(data))
