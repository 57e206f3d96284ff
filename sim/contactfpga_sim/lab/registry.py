"""Entries of studies, in ``studies.py``; a study's folder is beside this file.

An entry names functions as ``module:function`` of its folder, so that reading it imports nothing.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import inspect
from collections.abc import Callable, Mapping
from typing import Any

from contactfpga_sim.lab import writer


@dataclasses.dataclass(frozen=True)
class Section:
    """Text between two markers of a page."""

    makes: str
    """The function of its text or :class:`~contactfpga_sim.lab.writer.Table`, of the study's result or of nothing."""
    page: str = ""
    """Page in ``docs``; empty: the study's."""
    needs: tuple[str, ...] = ()
    """Needs beyond :attr:`Study.needs`; without one the section stays."""
    sample: str = ""
    """Function without arguments that makes part of the text in less than a minute."""
    of_netlists: bool = False
    """Whether netlists (:mod:`.size`), not reached code, date it."""


def tables(names: str = "", **others: Section) -> dict[str, Section]:
    """Sections by marker: of ``names`` each is made by ``tables:NAME_table``, and then ``others``."""
    return {name: Section(f"tables:{name}_table") for name in names.split()} | others


@dataclasses.dataclass(frozen=True)
class Study:
    """Outputs and needs of a study."""

    name: str
    """Name of its folder."""
    title: str
    page: str
    """Page in ``docs``."""
    minutes: float
    """Limit of its minutes on two cores without cached results."""
    sections: Mapping[str, Section] = dataclasses.field(default_factory=dict)
    """Sections by marker, in order of making."""
    compute: str = ""
    """Function of the result that sections and pictures share, called on first use."""
    pictures: str = ""
    """Function that draws into the pages' folder and returns files."""
    extra: str = "sim"
    """Extra of ``pyproject.toml`` with its imports."""
    needs: tuple[str, ...] = ()
    """Needed programs, and paths with a slash."""
    apart: bool = False
    """Whether it takes so long that only its name makes it, and a release may have it out of date."""
    package: str = "contactfpga_sim.lab"
    """Package of its folder."""

    def page_of(self, section: str) -> str:
        return self.sections[section].page or self.page

    def place(self, name: str) -> str:
        """Where a function is, as ``package.module:function``."""
        return f"{self.package}.{self.name}.{name}"

    def function(self, name: str) -> Callable[..., Any]:
        module, _, function = self.place(name).partition(":")
        found: Callable[..., Any] = getattr(importlib.import_module(module), function)
        return found


class StudyRun:
    """One run of a study, which computes its result once."""

    def __init__(self, study: Study):
        self.study = study

    @functools.cached_property
    def computed(self) -> Any:
        return self.study.function(self.study.compute)()

    def call(self, place: str, *given: object) -> Any:
        """Call a function, with the study's result if it takes one."""
        function = self.study.function(place)
        parameters = inspect.signature(function).parameters.values()
        wanted = sum(one.default is one.empty for one in parameters)
        return function(*given, *([self.computed] if wanted > len(given) else []))

    def made(self, section: str) -> str | writer.Table:
        found: str | writer.Table = self.call(self.study.sections[section].makes)
        return found

    def text(self, section: str) -> str:
        """All of the section's text, as pages spell it."""
        return writer.spelled(str(self.made(section)))

    def sampled(self, section: str) -> str:
        """The part of the text that the section's sample makes."""
        return writer.spelled(str(self.call(self.study.sections[section].sample)))
