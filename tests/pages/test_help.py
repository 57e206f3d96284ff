"""`help()` of what `contactfpga` offers begins with an example, which runs, and with the fields."""

import contextlib
import dataclasses
import doctest
import functools
import inspect
import io
import pydoc

import pytest

import contactfpga

pytestmark = pytest.mark.usefixtures("_closed_ports")  # examples read zones, which keeps their ports open

CLASSES = [name for name in contactfpga.__all__ if isinstance(getattr(contactfpga, name), type)]
FUNCTIONS = [name for name in contactfpga.__all__ if inspect.isfunction(getattr(contactfpga, name))]
ERRORS = [name for name in CLASSES if issubclass(getattr(contactfpga, name), Exception)]


def begin(name):
    """What `help()` shows before it lists methods."""
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown):
        help(getattr(contactfpga, name))
    return shown.getvalue().split("Method resolution order:")[0].split("Methods defined here:")[0]


def public(kind):
    """Fields and properties of a class."""
    properties = inspect.getmembers(kind, lambda value: isinstance(value, property | functools.cached_property))
    fields = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
    names = {field.name for field in fields} | {name for name, _ in properties}
    return {name for name in names if not name.startswith("_")}


@pytest.mark.parametrize("name", CLASSES)
def test_fields_and_properties_come_first(name):
    fields = begin(name).partition(" |  Fields:\n")[2]
    listed = {line.removeprefix(" |      ").split(":")[0] for line in fields.splitlines()}
    assert public(getattr(contactfpga, name)) - listed == set()


@pytest.mark.parametrize("name", sorted({*CLASSES, *FUNCTIONS} - {*ERRORS} | {"ContactFPGAError"}))
def test_an_example_comes_before_the_fields(name):
    assert ">>> " in begin(name).split("Fields:")[0]


@pytest.mark.parametrize("name", CLASSES + FUNCTIONS)
def test_examples_print_what_they_say(name):
    kind = getattr(contactfpga, name)
    test = doctest.DocTestParser().get_doctest(kind.__doc__, {"contactfpga": contactfpga}, name, None, None)
    assert doctest.DocTestRunner().run(test).failed == 0


def test_the_package_begins_with_an_example():
    test = doctest.DocTestParser().get_doctest(contactfpga.__doc__, {}, "contactfpga", None, None)
    assert test.examples
    assert doctest.DocTestRunner().run(test).failed == 0


def test_a_field_has_its_type_and_its_words():
    lines = begin("Zone").splitlines()
    at = lines.index(" |      area_mm2: float")
    assert lines[at + 1] == " |          Area of the cells in mm2, measured on the sheet."
    at = lines.index(" |      ghost: bool = False")
    assert lines[at + 1].startswith(" |          On a sheet without diodes: other pressed switches")
    assert " |      centroid_mm: tuple[float, float] | None" in lines
    assert ":attr:" not in "\n".join(lines)


def test_attributes_that_are_made_in_init_and_inherited_properties_are_fields():
    assert " |      time_us" in begin("Zones").splitlines()
    assert " |      dropped: int" in begin("Subscription")


def test_without_its_source_a_class_has_its_docstring(monkeypatch):
    from contactfpga import helptext

    monkeypatch.setattr(inspect, "getsource", lambda kind: (_ for _ in ()).throw(OSError))

    class Kind:
        """Words."""

        field: int

    helptext.complete(Kind)
    assert Kind.__doc__ == "Words."
    assert pydoc.getdoc(Kind) == "Words."
