"""What a study is. Each has a folder beside this file, unless scripts make all of it, and an entry in ``studies.py``.

An entry names functions as ``module:function`` of the study's folder, or ``folder/file.py:function`` of the project's,
so that it is read without what the study needs.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import inspect
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

NO_ROW = "^$"
"""For :attr:`Section.kept`: the page has a link to the table instead of rows of it."""


@dataclasses.dataclass(frozen=True)
class Section:
    """A table, or other text, between two markers of a page."""

    makes: str
    """The function that gives its text; it takes what the study computes, or nothing."""
    page: str = ""
    """In ``docs``; empty for the study's page."""
    needs: tuple[str, ...] = ()
    """As :attr:`Study.needs`. Where one is absent, the section stays as it is."""
    sample: str = ""
    """A function that gives in less than a minute a part of the text, such as a row; it takes nothing."""
    kept: str = ""
    """A regular expression that finds something in the rows of its longest table that a page keeps; empty: in all."""
    of_netlists: bool = False
    """It says what :mod:`.size` measures, so netlists decide whether it is out of date, and not all code it reaches."""


@dataclasses.dataclass(frozen=True)
class Study:
    """What a study makes, and what it takes to make it."""

    name: str
    """That of its folder."""
    title: str
    page: str
    """In ``docs``."""
    minutes: float
    """Two cores are busy with it, when nothing is kept from before."""
    sections: Mapping[str, Section] = dataclasses.field(default_factory=dict)
    """By the name in their markers; they are made in this order."""
    compute: str = ""
    """The function whose result sections and pictures share; it is called when the first of them asks for it."""
    pictures: str = ""
    """The function that draws into a folder, that of the pages, and gives the files."""
    extra: str = "sim"
    """The extra of ``pyproject.toml`` that has what it imports."""
    needs: tuple[str, ...] = ()
    """Programs, and files or folders whose names have a slash."""

    def page_of(self, section: str) -> str:
        """The page in ``docs`` that has this section."""
        return self.sections[section].page or self.page

    def module(self, place: str) -> str:
        """The module of a function, or its file."""
        module = place.partition(":")[0]
        return module if "/" in module else f"{__package__}.{self.name}.{module}"

    def function(self, place: str) -> Callable[..., Any]:
        """The function at a place."""
        module, name = self.module(place), place.partition(":")[2]
        if "/" in module:
            file = Path(module).resolve()
            if str(file.parent) not in sys.path:
                sys.path.append(str(file.parent))
            module = file.stem
        found: Callable[..., Any] = getattr(importlib.import_module(module), name)
        return found


class StudyRun:
    """One run of a study: what it computes is computed once, when the first function asks for it."""

    def __init__(self, study: Study):
        self.study = study

    @functools.cached_property
    def computed(self) -> Any:
        return self.study.function(self.study.compute)()

    def call(self, place: str, *given: object) -> Any:
        """What the function at a place gives."""
        function = self.study.function(place)
        parameters = inspect.signature(function).parameters.values()
        wanted = sum(one.default is one.empty for one in parameters)
        return function(*given, *([self.computed] if wanted > len(given) else []))

    def text(self, section: str) -> str:
        """The text of a section."""
        text: str = self.call(self.study.sections[section].makes)
        return text
