// A smooth map of a grid: values between the centres of its cells.

/** Cells along the longer side from which on a map looks smooth, and most parts of a cell along one axis. */
const FINE = 96;
const MOST_PARTS = 6;
/** Rings of cells around the known ones that are filled: as far as an interpolation reaches. */
const RINGS = 2;

/** Weights of the values at -1, 0, 1 and 2 for a place between 0 and 1 (Keys 1981, a = -1/2). @param {number} t */
const weights = (t) => [-0.5 * t + t * t - 0.5 * t ** 3, 1 - 2.5 * t * t + 1.5 * t ** 3, 0.5 * t + 2 * t * t - 1.5 * t ** 3, -0.5 * t * t + 0.5 * t ** 3];

/** Rows whose cells without a value have the mean of their neighbours, as far as an interpolation reads them. @param {number[][]} rows */
function filled(rows) {
  let all = rows;
  for (let ring = 0; ring < RINGS && all.some((row) => row.some(Number.isNaN)); ring++) {
    const known = all;
    all = known.map((row, j) =>
      row.map((value, i) => {
        if (!Number.isNaN(value)) return value;
        const near = [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((x) => known[j + y]?.[i + x] ?? NaN)).filter((other) => !Number.isNaN(other));
        return near.reduce((sum, other) => sum + other, 0) / near.length;
      }),
    );
  }
  return all;
}

/** Four values around a part of a cell, carried on along a straight line beyond the ends, and their weights. @param {number} part @param {number} parts @param {number} count */
function around(part, parts, count) {
  const place = (part + 0.5) / parts - 0.5;
  const from = Math.floor(place);
  /** @type {Map<number, number>} */
  const of = new Map();
  const add = (/** @type {number} */ cell, /** @type {number} */ weight) => of.set(cell, (of.get(cell) ?? 0) + weight);
  const last = count - 1;
  for (const [k, weight] of weights(place - from).entries()) {
    const cell = from + k - 1;
    const [end, inner] = cell < 0 ? [0, Math.min(1, last)] : [last, Math.max(0, last - 1)];
    const over = Math.max(-cell, cell - last, 0);
    if (!over) add(cell, weight);
    else (add(end, weight * (1 + over)), add(inner, -weight * over));
  }
  return [...of];
}

/** Centres of parts of cells. @param {number[]} centres @param {number} parts */
function divided(centres, parts) {
  const step = centres.length > 1 ? (Number(centres.at(-1)) - Number(centres[0])) / (centres.length - 1) : 2 * Number(centres[0]);
  return centres.flatMap((centre) => Array.from({ length: parts }, (_, k) => centre + ((k + 0.5) / parts - 0.5) * step));
}

/** A grid of parts of cells, and its values. @typedef {{ grid: Pick<Grid, "x_m" | "y_m" | "area_m2">, rows: number[][] }} Fine */
/** @type {WeakMap<number[][], Fine>} */
const known = new WeakMap();

/**
 * A grid with values between the centres of its cells, none of which leaves the range of those around it; cells without a value stay so. Made
 * once for each grid.
 * @param {Pick<Grid, "x_m" | "y_m" | "area_m2">} grid @param {number[][]} rows @returns {Fine}
 */
export function refined(grid, rows) {
  const made = known.get(rows) ?? interpolated(grid, rows);
  known.set(rows, made);
  return made;
}

/** @param {Pick<Grid, "x_m" | "y_m" | "area_m2">} grid @param {number[][]} rows @returns {Fine} */
function interpolated(grid, rows) {
  const [width, height] = [grid.x_m.length, grid.y_m.length];
  const parts = Math.max(1, Math.min(MOST_PARTS, Math.ceil(FINE / Math.max(width, height, 1))));
  if (parts === 1) return { grid, rows };
  const all = filled(rows);
  const across = Array.from({ length: width * parts }, (_, part) => around(part, parts, width));
  const up = Array.from({ length: height * parts }, (_, part) => around(part, parts, height));
  const fine = up.map((ofRow, j) =>
    across.map((ofColumn, i) => {
      if (Number.isNaN(rows[Math.floor(j / parts)]?.[Math.floor(i / parts)])) return NaN;
      let [sum, low, high] = [0, Infinity, -Infinity];
      for (const [row, share] of ofRow)
        for (const [column, weight] of ofColumn) {
          const value = all[row]?.[column] ?? 0;
          // farther from known cells than an interpolation reads
          if (Number.isNaN(value)) continue;
          sum += share * weight * value;
          [low, high] = [Math.min(low, value), Math.max(high, value)];
        }
      return isAtEnd(j, i) ? sum : Math.max(low, Math.min(high, sum));
    }),
  );
  /** True of parts beyond the outermost centres, whose values are carried on. @param {number} j @param {number} i */
  function isAtEnd(j, i) {
    const half = parts / 2;
    return j < half || i < half || j >= height * parts - half || i >= width * parts - half;
  }
  const area_m2 = grid.area_m2 && fine.map((row, j) => row.map((_, i) => grid.area_m2?.[Math.floor(j / parts)]?.[Math.floor(i / parts)] ?? 0));
  return { grid: { x_m: divided(grid.x_m, parts), y_m: divided(grid.y_m, parts), ...(area_m2 ? { area_m2 } : {}) }, rows: fine };
}
