// Lines of equal value on a grid of cells (marching squares), from wall to wall.
import { clearance, isInside } from "./outline.js";

/** @typedef {[number, number]} Point */

/** A row or column more at either end, carried on along the last two. @param {number[][]} rows */
function carriedOn(rows) {
  /** @param {number[]} line */
  const longer = (line) => {
    const [a = 0, b = a] = line;
    const [z = 0, y = z] = line.toReversed();
    return [1.5 * a - 0.5 * b, ...line, 1.5 * z - 0.5 * y];
  };
  const wide = rows.map(longer);
  const columns = wide[0]?.map((_, i) => longer(wide.map((row) => row[i] ?? 0))) ?? [];
  return columns[0]?.map((_, j) => columns.map((column) => column[j] ?? 0)) ?? [];
}

/**
 * The rows with values carried on to cells outside that lie beside two inside, so that lines reach the walls of a plan.
 * @param {Grid} grid
 * @param {number[][]} rows
 * @param {Point[][]} rings
 */
export function carriedOut(grid, rows, rings) {
  return rows.map((row, j) =>
    row.map((value, i) => {
      if (!Number.isNaN(value) || isInside(rings, [grid.x_m[i] ?? 0, grid.y_m[j] ?? 0])) return value;
      const next = [[-1, 0], [1, 0], [0, -1], [0, 1]].flatMap(([x = 0, y = 0]) => {
        const [near = NaN, far = NaN] = [rows[j + y]?.[i + x], rows[j + 2 * y]?.[i + 2 * x]];
        return Number.isNaN(near + far) ? [] : [2 * near - far];
      });
      return next.reduce((sum, one) => sum + one, 0) / next.length;
    }),
  );
}

/** Centres of cells, and the outer edges. @param {number[]} centres */
function places(centres) {
  const half = centres.length > 1 ? ((centres[1] ?? 0) - (centres[0] ?? 0)) / 2 : 0.5;
  return [(centres[0] ?? 0) - half, ...centres, (centres.at(-1) ?? 0) + half];
}

/** Edges of a square that a line joins, by which of its corners are above: south-west 1, south-east 2, north-east 4, north-west 8. */
const JOINED = /** @type {const} */ ({
  1: ["ws"],
  2: ["se"],
  3: ["we"],
  4: ["en"],
  5: ["wn", "se"],
  6: ["sn"],
  7: ["wn"],
  8: ["wn"],
  9: ["sn"],
  10: ["ws", "en"],
  11: ["en"],
  12: ["we"],
  13: ["se"],
  14: ["ws"],
});

/**
 * Lines on which the values are the level, in the unit of the places.
 * @param {Pick<Grid, "x_m" | "y_m">} grid
 * @param {number[][]} values
 * @param {number} level
 * @returns {Point[][]}
 */
export function lines(grid, values, level) {
  const rows = carriedOn(values);
  const [x, y] = [places(grid.x_m), places(grid.y_m)];
  const at = (/** @type {number} */ i, /** @type {number} */ j) => rows[j]?.[i] ?? 0;
  /**
   * Point where the level is met on the edge from one corner to another.
   * @param {number} i
   * @param {number} j
   * @param {number} k
   * @param {number} l
   * @returns {Point}
   */
  const met = (i, j, k, l) => {
    const share = (level - at(i, j)) / (at(k, l) - at(i, j));
    const between = (/** @type {number[]} */ places, /** @type {number} */ a, /** @type {number} */ b) =>
      (places[a] ?? 0) + share * ((places[b] ?? 0) - (places[a] ?? 0));
    return [between(x, i, k), between(y, j, l)];
  };
  /** @type {[string, Point, string, Point][]} */
  const pieces = [];
  for (let j = 0; j + 1 < rows.length; j++) {
    for (let i = 0; i + 1 < x.length; i++) {
      const corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
      // no line beside what has no value
      if (corners.some(Number.isNaN)) continue;
      const above = corners.reduce((bits, value, bit) => bits + (value >= level ? 1 << bit : 0), 0);
      if (above === 0 || above === 15) continue;
      /** @type {Record<string, () => [string, Point]>} */
      const edges = {
        w: () => [`w${i},${j}`, met(i, j, i, j + 1)],
        e: () => [`w${i + 1},${j}`, met(i + 1, j, i + 1, j + 1)],
        s: () => [`s${i},${j}`, met(i, j, i + 1, j)],
        n: () => [`s${i},${j + 1}`, met(i, j + 1, i + 1, j + 1)],
      };
      for (const [from, to] of JOINED[/** @type {keyof typeof JOINED} */ (above)] ?? []) {
        const [a, b] = [edges[from ?? ""]?.(), edges[to ?? ""]?.()];
        if (a && b) pieces.push([...a, ...b]);
      }
    }
  }
  return joined(pieces);
}

/** Pieces that share an edge of a square become one line. @param {[string, Point, string, Point][]} pieces */
function joined(pieces) {
  /** @type {Map<string, number[]>} */
  const ends = new Map();
  pieces.forEach(([a, , b], i) => [a, b].forEach((end) => ends.set(end, [...(ends.get(end) ?? []), i])));
  const used = new Set();
  /** @param {number} first @param {string} from @returns {Point[]} */
  const followed = (first, from) => {
    const line = [];
    let [index, end] = [/** @type {number | undefined} */ (first), from];
    while (index !== undefined && !used.has(index)) {
      used.add(index);
      const [a, pa, b, pb] = /** @type {[string, Point, string, Point]} */ (pieces[index]);
      if (line.length === 0) line.push(a === end ? pa : pb);
      line.push(a === end ? pb : pa);
      end = a === end ? b : a;
      index = ends.get(end)?.find((other) => !used.has(other));
    }
    return line;
  };
  /** @type {Point[][]} */
  const found = [];
  // open lines from their ends first, then rings
  for (const open of [true, false]) {
    pieces.forEach(([a, , b], i) => {
      if (used.has(i)) return;
      const end = [a, b].find((end) => !open || ends.get(end)?.length === 1);
      if (end !== undefined) found.push(followed(i, end));
    });
  }
  return found;
}

/**
 * Where a line's label stands: on its point that is farthest from what is in the way, within the walls and beside partitions.
 * @param {Point[][]} of
 * @param {Point[]} taken
 * @param {Point[][]} rings outline of the room, holes in it, and ends of partitions
 * @param {number} gap
 * @returns {Point | null}
 */
export function labelled(of, taken, rings, gap) {
  let best = { distance: gap, place: /** @type {Point | null} */ (null) };
  for (const [x, y] of of.flat()) {
    if (clearance(rings, [x, y]) < gap) continue;
    const distance = Math.min(...taken.map((other) => Math.hypot(other[0] - x, other[1] - y)), 4 * gap);
    if (distance > best.distance) best = { distance, place: [x, y] };
  }
  return best.place;
}
