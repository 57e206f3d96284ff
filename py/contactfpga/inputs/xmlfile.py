"""XML files from outside, refused with one sentence if they would fill the memory."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

MAX_ELEMENTS = 100_000
_COMMENT = re.compile(rb"(<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?(?:\?>|\Z))|<!--.*?(?:-->|\Z)", re.DOTALL)
"""Comments, and first what may look like one. An end of the file ends each, so that the search stays linear."""


def parse(data: bytes, path: str | Path, what: str, refused: type[Exception], lenient: bool = False) -> Element:
    """The root element of a file of these bytes, without its text and with names as they are written, such as
    ``gazebo:camera``; ``path``, ``what``: name and kind in messages. Raises ``refused``.

    ``lenient``: also take what many programs take: any bytes in comments, and blank lines before the declaration.
    """
    try:
        return _root(data, path, what, refused)
    except expat.ExpatError as error:
        # Of a comment its lines alone, so that messages still count them.
        plain = _COMMENT.sub(lambda found: found[1] or b"\n" * found[0].count(b"\n"), data)
        if lenient and (mended := plain.removeprefix(b"\xef\xbb\xbf").lstrip()) != data:
            return parse(mended, path, what, refused)
        raise refused(f"{path}: not {what}: {error}") from None


def _root(data: bytes, path: str | Path, what: str, refused: type[Exception]) -> Element:
    """ElementTree's own parser would refuse prefixes that are not declared."""
    builder, count = TreeBuilder(), itertools.count(1)

    def start(tag: str, attributes: dict[str, str]) -> None:
        if next(count) > MAX_ELEMENTS:
            raise refused(f"{path}: more than {MAX_ELEMENTS:,} elements; is it {what}?")
        builder.start(tag, attributes)

    def doctype(*_: object) -> None:
        raise refused(f"{path}: it declares a document type, which {what} does not need; remove it")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, builder.end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(data, True)
    except refused:
        raise
    except (LookupError, ValueError) as error:  # an encoding that Python does not know
        raise refused(f"{path}: not {what}: {error}") from None
    return builder.close()
