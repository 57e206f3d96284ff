// Groups of cells that are neighbors along rows and columns, found the plain way: to draw their outlines, and to know what
// the board ought to say.

// Each group: its cells by number (row * columns + column), area, and the sums of columns and rows, as in a record.
export function groups(cells, columns) {
  const left = new Set(cells.flatMap((pressed, cell) => (pressed ? [cell] : [])));
  const found = [];
  while (left.size) {
    const [first] = left, group = [first];
    left.delete(first);
    for (const cell of group) {
      for (const next of neighbors(cell, columns)) if (left.delete(next)) group.push(next);
    }
    found.push({ cells: group, area: group.length, ...sums(group, columns) });
  }
  return found;
}

export function sums(cells, columns) {
  const sum_x = cells.reduce((sum, cell) => sum + (cell % columns), 0);
  const sum_y = cells.reduce((sum, cell) => sum + Math.floor(cell / columns), 0);
  return { sum_x, sum_y };
}

function neighbors(cell, columns) {
  const column = cell % columns;
  return [cell - columns, cell + columns, ...(column ? [cell - 1] : []), ...(column < columns - 1 ? [cell + 1] : [])];
}

// The outline of a group as an SVG path, in pitches from the middle of the first cell.
export function outline(group, columns) {
  const inside = new Set(group.cells);
  const sides = group.cells.map((cell) => {
    const column = cell % columns, x = column - 0.5, y = Math.floor(cell / columns) - 0.5;
    return [
      inside.has(cell - columns) ? "" : `M${x} ${y}h1`,
      inside.has(cell + columns) ? "" : `M${x} ${y + 1}h1`,
      column && inside.has(cell - 1) ? "" : `M${x} ${y}v1`,
      column < columns - 1 && inside.has(cell + 1) ? "" : `M${x + 1} ${y}v1`,
    ].join("");
  });
  return sides.join("");
}
