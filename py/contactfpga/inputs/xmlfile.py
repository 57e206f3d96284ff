"""XML files from outside, refused with one sentence if they would fill the memory."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

MAX_ELEMENTS = 100_000


def parse(data: bytes, path: str | Path, what: str, refused: type[Exception]) -> ElementTree.Element:
    """The root element of a file of these bytes; ``path``, ``what``: name and kind in messages. Raises ``refused``."""
    try:
        return ElementTree.fromstring(data, ElementTree.XMLParser(target=_Elements()))
    except _Doctype:
        raise refused(f"{path}: it declares a document type, which {what} does not need; remove it") from None
    except _TooMany:
        raise refused(f"{path}: more than {MAX_ELEMENTS:,} elements; is it {what}?") from None
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # also an encoding that Python does not know
        raise refused(f"{path}: not {what}: {error}") from None


class _Doctype(Exception):
    """A document type, whose nested entities could fill the memory."""


class _TooMany(Exception):
    """Too many elements for the memory."""


class _Elements(ElementTree.TreeBuilder):
    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def doctype(self, *_: object) -> None:
        raise _Doctype

    def start(self, tag: str, attrs: dict[str, str]) -> ElementTree.Element:
        self._count += 1
        if self._count > MAX_ELEMENTS:
            raise _TooMany
        return super().start(tag, attrs)
