"""Common parts of choices: a choice has a built-in name, or is a user's own ``module:attribute``."""

from __future__ import annotations

import contextlib
import contextvars
import dataclasses
import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from contactfpga.errors import SkinError
from contactfpga.inputs.values import shown

Bound = Callable[[Any], int]
"""An upper bound in clocks or slots from a :class:`~contactfpga.skin.derived.Derived`."""

FIELDS = ("labeller", "scan", "debounce", "converter")
"""Fields of a Skin that may name a user's own choice."""

_trusting: contextvars.ContextVar[bool] = contextvars.ContextVar("trusting", default=False)


@contextlib.contextmanager
def trusted(trust: bool) -> Iterator[None]:
    """With ``trust``, files read in this block may name modules, whose import runs their code."""
    token = _trusting.set(trust or trusting())
    try:
        yield
    finally:
        _trusting.reset(token)


def trusting() -> bool:
    return _trusting.get()


def refuse_modules(values: Mapping[str, Any], source: str) -> None:
    """Raise SkinError if the Skin from ``source`` names a module, except inside :func:`trusted`."""
    if trusting():
        return
    for field, value in modules(values).items():
        raise SkinError(
            f"{source}: {field} is {shown(value)}, a module that would be imported and so run; "
            "if you know its code, allow that by --trust (in Python by trust=True)"
        )


def modules(values: Mapping[str, Any]) -> dict[str, str]:
    """Each ``module:attribute`` that a Skin's values name, by field."""
    found = {field: values.get(field) for field in FIELDS}
    return {field: value for field, value in found.items() if isinstance(value, str) and ":" in value}


def look_in(folder: Path, place: str) -> None:
    """Let Python find the module of a trusted ``module:attribute`` in this folder. Raises SkinError if it is there and
    another module has its name, because that one would run."""
    folder, name = folder.resolve(), place.partition(":")[0].partition(".")[0]
    file = next((file for file in (folder / f"{name}.py", folder / name / "__init__.py") if file.is_file()), None)
    if file is None:
        return
    if str(folder) not in sys.path:
        sys.path.append(str(folder))  # to stay, as worker processes look there, too; last, so that it hides no module
    spec = importlib.util.find_spec(name)
    if spec is None or spec.origin is None or not Path(spec.origin).exists() or not file.samefile(spec.origin):
        origin = None if spec is None else spec.origin
        raise SkinError(f"{shown(place)} is in {file}, but {origin} has the same name; rename your module")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Choice:
    """One way to do a stage; choices of one name are the same choice."""

    name: str
    """Name in a Skin: a built-in name, or the ``module:attribute`` of this object."""
    title: str
    gateware: str
    """``module:attribute`` of the gateware's class, which is called with the Skin; "": none."""
    golden: str
    """``module:attribute`` of the golden model's rule; it shares no code with the gateware."""

    def load_gateware(self) -> Any:
        """The gateware's class. Imports Amaranth."""
        return load(self.gateware)

    def load_golden(self) -> Any:
        return load(self.golden)


AnyChoice = TypeVar("AnyChoice", bound=Choice)


def find(kind: type[AnyChoice], built_in: Mapping[str, AnyChoice], value: object) -> AnyChoice:
    """The choice of a kind that ``value`` names or is. Raises SkinError that lists the choices."""
    field = kind.__name__.lower()
    if isinstance(value, kind):
        if find(kind, built_in, value.name) != value:
            raise SkinError(f"{field} is an object called {value.name!r}, but another object is found there")
        return value
    if isinstance(value, str) and value in built_in:
        return built_in[value]
    if not isinstance(value, str) or ":" not in value:
        raise SkinError(
            f"{field} is {shown(value)}; it must be one of {', '.join(map(repr, built_in))}, "
            "or 'module:attribute' of your own"
        )
    found = load_own(value, f"{field} is {shown(value)}, which")
    if not isinstance(found, kind):
        raise SkinError(f"{field} is {shown(value)}, which is a {type(found).__name__}; it must be a {kind.__name__}")
    if found.name != value:
        raise SkinError(f"{field} is {shown(value)}, but the object calls itself {found.name!r}; give both one name")
    return found


def load(place: str) -> Any:
    module, _, attribute = place.partition(":")
    return getattr(importlib.import_module(module), attribute)


def load_own(place: str, what: str) -> Any:
    """The object at a user's ``module:attribute``. Raises SkinError, beginning with ``what``, for any failure of the
    module."""
    try:
        return load(place)
    except (ImportError, AttributeError, ValueError) as error:
        raise SkinError(f"{what} cannot be loaded: {error}") from error
    except (Exception, SystemExit) as error:
        raise SkinError(f"{what} cannot be loaded: {type(error).__name__}: {error}") from error


def own_files(skin: object) -> set[Path]:
    """Module files of a Skin's own choices, for cache keys."""
    own = [load(place) for place in modules({field: getattr(skin, field) for field in FIELDS}).values()]
    places = {place for one in own for place in (one.name, one.gateware, one.golden) if place}
    specs = [importlib.util.find_spec(place.partition(":")[0]) for place in places]
    return {Path(spec.origin) for spec in specs if spec and spec.origin}
