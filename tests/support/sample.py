"""Which parameters of a long test `make test` and `make test-all` run; the others are for `make campaign`."""

from collections.abc import Collection, Iterable, Mapping

import pytest


def sample(values: Iterable, quick: Collection, slow: Collection = ()) -> list:
    """Parameters for ``pytest.mark.parametrize``: those in ``slow`` are marked so, and those in neither ``slow`` nor
    ``quick`` are marked ``campaign``. A tuple holds the values of several arguments. A value that is not there, or no
    quick one at all, is an error."""
    values = list(values)
    missing = [value for value in (*quick, *slow) if value not in values]
    if missing or not quick:
        raise ValueError(f"no parameters of this test: {missing}")
    return [
        value if value in quick else _marked(value, pytest.mark.slow if value in slow else pytest.mark.campaign)
        for value in values
    ]


def each_choice(rows: Iterable[Mapping]) -> list[int]:
    """Numbers of few rows of a table that together hold each value of each column."""
    rows = list(rows)
    missing = {(name, repr(value)) for row in rows for name, value in row.items()}
    found = []
    while missing:
        new = [len(missing & {(name, repr(value)) for name, value in row.items()}) for row in rows]
        found.append(new.index(max(new)))
        missing -= {(name, repr(value)) for name, value in rows[found[-1]].items()}
    return sorted(found)


def _marked(value: object, mark: pytest.MarkDecorator):
    return pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=mark)
