// Zones, and groups of cells that are neighbors along rows and columns, found the plain way: to draw their outlines,
// and to know what the board ought to say.

// Each group: its cells by number (row * columns + column), its area in cells and its place in mm, as a board says
// them.
export function groups(cells, { columns, pitch_mm }) {
  const left = new Set(cells.flatMap((pressed, cell) => (pressed ? [cell] : [])));
  const found = [];
  while (left.size) {
    const [first] = left;
    const group = [first];
    left.delete(first);
    for (const cell of group) {
      for (const next of neighbors(cell, columns)) if (left.delete(next)) group.push(next);
    }
    const middle = (of) => (group.reduce((sum, cell) => sum + of(cell), 0) / group.length) * pitch_mm;
    found.push({
      cells: group,
      area: group.length,
      x_mm: middle((cell) => cell % columns),
      y_mm: middle((cell) => Math.floor(cell / columns)),
    });
  }
  return found;
}

const COLORS = 6; // in the style sheet
const SAME_MM = 15; // a zone that was no farther away in the picture before is the same one

// A frame's zones, numbered and colored, by number; those that were shown `before` keep their numbers.
export function numbered(zones, before) {
  const left = [...before];
  const found = zones.map((zone) => {
    const away = (one) => Math.hypot(one.x_mm - zone.x_mm, one.y_mm - zone.y_mm);
    left.sort((one, other) => away(one) - away(other));
    return { ...zone, number: left.length && away(left[0]) < SAME_MM ? left.shift().number : null };
  });
  for (const zone of found) zone.number ??= firstFree(found);
  for (const zone of found) zone.color = (zone.number - 1) % COLORS;
  return found.sort((one, other) => one.number - other.number);
}

function firstFree(zones) {
  const numbers = zones.map((_, index) => index + 1);
  return numbers.find((number) => zones.every((zone) => zone.number !== number));
}

// Whether a board's zone and a group are the same. Both places are computed in the same steps from the same whole
// numbers.
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
    const column = cell % columns;
    const x = column - 0.5;
    const y = Math.floor(cell / columns) - 0.5;
    return [
      inside.has(cell - columns) ? "" : `M${x} ${y}h1`,
      inside.has(cell + columns) ? "" : `M${x} ${y + 1}h1`,
      column && inside.has(cell - 1) ? "" : `M${x} ${y}v1`,
      column < columns - 1 && inside.has(cell + 1) ? "" : `M${x + 1} ${y}v1`,
    ].join("");
  });
  return sides.join("");
}
