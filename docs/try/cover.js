// Which switches close under fingers: tiles, that is foam cut between rigid caps that stand proud of the sheet. Each
// cap takes what presses on its tile, one pitch wide. contactfpga.design.cover.cells is the same for any cover, with
// the reasons.

export class Tiles {
  #kit;
  #step; // of the grid on which pressure is resolved, in mm
  #edge = 1; // pitches of the grid beyond the sheet, on each side

  // `kit`: rows, columns, pitch_mm, parts (grid steps per pitch), thresholds_n (closing force of each switch, row by
  // row) and hysteresis (the share of it by which the force must fall again).
  constructor(kit) {
    this.#kit = kit;
    this.#step = kit.pitch_mm / kit.parts;
  }

  // 0 or 1 for each switch, row by row. A finger has x_mm, y_mm, radius_mm and force_n; `before`: the last answer.
  closed(fingers, before) {
    const { thresholds_n, hysteresis } = this.#kit;
    return this.forces(fingers).map((force, cell) => {
      const threshold = thresholds_n[cell] * (before[cell] ? 1 - hysteresis : 1);
      return force >= threshold ? 1 : 0;
    });
  }

  // Force on each switch in N.
  forces(fingers) {
    const forces = new Array(this.#kit.rows * this.#kit.columns).fill(0);
    for (const finger of fingers) this.#add(finger, forces);
    return forces;
  }

  // The pressure under a round finger is Hertz's: in proportion to sqrt(1 - (r / radius)^2).
  #add({ x_mm, y_mm, radius_mm, force_n }, forces) {
    const { rows, columns, parts } = this.#kit;
    const across = this.#span(x_mm, radius_mm, columns);
    const down = this.#span(y_mm, radius_mm, rows);
    const shares = new Array(forces.length).fill(0);
    let total = 0;
    for (let j = down.first; j < down.end; j++) {
      const v = (this.#place(j) - y_mm) / radius_mm;
      const row = Math.floor(j / parts) - this.#edge;
      for (let i = across.first; i < across.end; i++) {
        const u = (this.#place(i) - x_mm) / radius_mm;
        const column = Math.floor(i / parts) - this.#edge;
        const share = Math.sqrt(Math.max(0, 1 - u * u - v * v));
        total += share;
        if (row >= 0 && row < rows && column >= 0 && column < columns) shares[row * columns + column] += share;
      }
    }
    // What lies on the grid is all of the finger's force, but for one that reaches beyond it.
    if (!across.whole || !down.whole) total = (2 * Math.PI * radius_mm ** 2) / (3 * this.#step ** 2);
    shares.forEach((share, cell) => (forces[cell] += (force_n * share) / total));
  }

  #place(index) {
    return (index + 0.5) * this.#step - (this.#edge + 0.5) * this.#kit.pitch_mm;
  }

  // The steps of the grid that something of this middle and reach covers, and whether all of it lies on the grid.
  #span(middle, reach, count) {
    const steps = (count + 2 * this.#edge) * this.#kit.parts;
    const first = Math.floor((middle - reach - this.#place(0)) / this.#step);
    const end = Math.ceil((middle + reach - this.#place(0)) / this.#step) + 1;
    const whole = middle - reach >= this.#place(0) && middle + reach <= this.#place(steps - 1);
    return { first: Math.max(0, first), end: Math.min(steps, end), whole };
  }
}
