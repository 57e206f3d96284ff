"""XML files from outside, refused with one sentence if they would fill the memory."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

MAX_ELEMENTS = 100_000
_COMMENT = re.compile(rb"(<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?(?:\?>|\Z))|<!--.*?(?:-->|\Z)", re.DOTALL)
"""Comments, and first what may look like one. An end of the file ends each, so that the search stays linear."""


def parse(
    data: bytes, path: str | Path, what: str, refused: type[Exception], lenient: bool = False
) -> ElementTree.Element:
    """The root element of a file of these bytes, without its text and with names as they are written, such as
    ``gazebo:camera``; ``path``, ``what``: name and kind in messages. Raises ``refused``.

    ``lenient``: also take what many programs take: any bytes in comments, and blank lines before the declaration.
    """
    try:
        try:
            return _root(data)
        except expat.ExpatError:
            mended = _COMMENT.sub(_lines, data.removeprefix(b"\xef\xbb\xbf").lstrip())
            if not lenient or mended == data:
                raise
            return _root(mended)
    except _Doctype:
        raise refused(f"{path}: it declares a document type, which {what} does not need; remove it") from None
    except _TooMany:
        raise refused(f"{path}: more than {MAX_ELEMENTS:,} elements; is it {what}?") from None
    except (expat.ExpatError, LookupError, ValueError) as error:  # also an encoding that Python does not know
        raise refused(f"{path}: not {what}: {error}") from None


class _Doctype(Exception):
    """A document type, whose nested entities could fill the memory."""


class _TooMany(Exception):
    """Too many elements for the memory."""


def _lines(found: re.Match[bytes]) -> bytes:
    """The lines of a comment alone, so that messages still count them."""
    return found[1] or b"\n" * found[0].count(b"\n")


def _root(data: bytes) -> ElementTree.Element:
    """ElementTree's own parser would refuse prefixes that are not declared."""
    builder, count = ElementTree.TreeBuilder(), 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MAX_ELEMENTS:
            raise _TooMany
        builder.start(tag, attributes)

    def doctype(*_: object) -> None:
        raise _Doctype

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, builder.end
    parser.StartDoctypeDeclHandler = doctype
    parser.Parse(data, True)
    return builder.close()
