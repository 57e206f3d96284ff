"""The clocks of exact labellers by docs/timing.md, worked cell by cell; shares no code with the golden model."""


def pieces(cells, connectivity):
    """Connected sets of (y, x) in a frame given as row words, by flood fill."""
    left = {(y, x) for y, word in enumerate(cells) for x in range(word.bit_length()) if word >> x & 1}
    around = [(0, 1), (0, -1), (1, 0), (-1, 0)]
    if connectivity == 8:
        around += [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    while left:
        piece, edge = set(), [left.pop()]
        while edge:
            y, x = edge.pop()
            piece.add((y, x))
            near = {(y + dy, x + dx) for dy, dx in around} & left
            left -= near
            edge += near
        yield piece


def runs(cells):
    """Number of horizontal runs in a set of cells."""
    return sum((y, x - 1) not in cells for y, x in cells)


def run_rule(clusters, columns, connectivity):
    """By the step rule: the clock in which each cluster is done, clocks for the row, and until the end mark."""
    steps, done = 0, []
    for cluster in clusters:
        before = {cell for cell in cluster if cell[0] == 0}
        steps += max(runs(before), runs(cluster - before))
        done.append(steps + 3)
    found = bool(clusters)  # a clock to find the first one
    return done, steps + found + 1, steps + found + 3


def serial_rule(clusters, columns, connectivity):
    """By the column rule, the same."""
    cells = set().union(*clusters)
    clocks, done_by_column = 0, []
    for x in range(columns):
        clocks += 1
        begins_before = (0, x) in cells and (0, x - 1) not in cells
        diagonal = {(1, x), (0, x - 1)} <= cells and not {(0, x), (1, x - 1)} & cells
        if begins_before or (connectivity == 4 and diagonal):
            clocks += 1
        done_by_column.append(clocks)
    return [done_by_column[max(x for _, x in cluster)] + 1 for cluster in clusters], clocks + 2, clocks + 2


RULES = {"run": run_rule, "serial": serial_rule}


def row_rule(pair, columns, connectivity, labeller, closed=False):
    """For a row and the one before it: [(cluster, the clock in which a zone leaves whose last cluster it is)] from left
    to right, clocks for the row, and until the end mark. Where the ends meet a row that is joined over the seam takes a
    step more, or two clocks, after its last cluster."""
    clusters = sorted(pieces(pair, connectivity), key=lambda piece: min(x for _, x in piece))
    done, busy, end = RULES[labeller](clusters, columns, connectivity)
    first, last = ({y for y, row in enumerate(pair) if row >> x & 1} for x in (0, columns - 1))
    if closed and (first and last if connectivity == 8 else first & last):
        more = {"run": 1, "serial": 2}[labeller]
        done[-1] += more
        busy, end = busy + more, end + more
    return list(zip(clusters, done, strict=True)), busy, end
