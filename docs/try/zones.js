// Groups of cells that are neighbors along rows and columns, found the plain way: to draw their outlines, and to know what
// the board ought to say.

// Each group: its cells by number (row * columns + column), its area in cells and its place in mm, as a board says them.
export function groups(cells, { columns, pitch_mm }) {
  const left = new Set(cells.flatMap((pressed, cell) => (pressed ? [cell] : [])));
  const found = [];
  while (left.size) {
    const [first] = left, group = [first];
    left.delete(first);
    for (const cell of group) {
      for (const next of neighbors(cell, columns)) if (left.delete(next)) group.push(next);
    }
    const middle = (of) => (group.reduce((sum, cell) => sum + of(cell), 0) / group.length) * pitch_mm;
    found.push({ cells: group, area: group.length, x_mm: middle((cell) => cell % columns), y_mm: middle((cell) => Math.floor(cell / columns)) });
  }
  return found;
}

// Whether a board's zone and a group are the same. Both places are computed in the same steps from the same whole numbers.
export function same(zone, group) {
  return zone.area === group.area && zone.x_mm === group.x_mm && zone.y_mm === group.y_mm;
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
