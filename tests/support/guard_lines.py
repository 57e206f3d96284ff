"""Guard lines of a sheet: each break that they show."""

from contactfpga_sim.model.golden.trace import Cuts


def breaks(rows: int, columns: int) -> list[tuple[Cuts, int]]:
    """Each line, guard lines too, cut at each place, and the word that tells it: rows lowest, then columns. After the
    last guard switch there is nothing to lose."""
    found = []
    for end in range(columns + 1):
        found += [(Cuts({row: end}), 1 << row) for row in range(rows)]
        found.append((Cuts({rows: end}), (1 << columns) - (1 << end) << rows))
    for end in range(rows + 1):
        found += [(Cuts({}, {column: end}), 1 << rows + column) for column in range(columns)]
        found.append((Cuts({}, {columns: end}), (1 << rows) - (1 << end)))
    return found
