// Outlines of plans: polygons of corners in metres, and what a hand does with them.

/** @typedef {[number, number]} Point */
/** Edge from one corner to the next. @typedef {[Point, Point]} Segment */

/** Step of a corner that is added along a wall. */
const STEP_M = 0.05;
/** Least length that a wall keeps when the one beside it is moved. */
const LEAST_WALL_M = 0.1;

/** The edges of a ring. @param {Point[]} ring @returns {Segment[]} */
export const edges = (ring) => ring.map((corner, k) => [corner, ring[(k + 1) % ring.length] ?? corner]);

/** @param {Point} a @param {Point} b @returns {Point} */
const minus = (a, b) => [a[0] - b[0], a[1] - b[1]];
/** @param {Point} a @param {Point} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1];
/** @param {Point} a @param {Point} b */
const cross = (a, b) => a[0] * b[1] - a[1] * b[0];
/** @param {Point} a @param {Point} b */
const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
/** @param {Point} a @param {Point} direction @param {number} times @returns {Point} */
const moved = (a, direction, times) => [a[0] + direction[0] * times, a[1] + direction[1] * times];
/** To tenths of millimetres, without a zero below zero. @param {Point} point @returns {Point} */
const rounded = ([x, y]) => [Math.round(x * 1e4) / 1e4 + 0, Math.round(y * 1e4) / 1e4 + 0];

/** True of a point within the outline, the first ring, and in no hole, the others. @param {Point[][]} rings @param {Point} point */
export function isInside(rings, [x, y]) {
  const crossed = rings.flatMap(edges).filter(([[ax, ay], [bx, by]]) => ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax));
  return crossed.length % 2 === 1;
}

/** @param {Segment} edge @param {Point} point */
function toEdge([a, b], point) {
  const along = minus(b, a);
  const share = dot(minus(point, a), along) / (dot(along, along) || 1);
  return distance(point, moved(a, along, Math.max(0, Math.min(1, share))));
}

/** Distance to the nearest wall, negative outside. @param {Point[][]} rings @param {Point} point */
export function clearance(rings, point) {
  const nearest = Math.min(...rings.flatMap(edges).map((edge) => toEdge(edge, point)));
  return isInside(rings, point) ? nearest : -nearest;
}

/** Rings as the path of a drawing. @param {Point[][]} rings @param {(x: number) => number} across @param {(y: number) => number} down */
export const path = (rings, across, down) =>
  rings.map((ring) => `M${ring.map(([x, y]) => `${across(x)} ${down(y)}`).join("L")}Z`).join("");

/** The outline with one more corner, on an edge, in whole steps along it. @param {Point[]} outline @param {number} edge @param {Point} place @returns {Point[]} */
export function withCorner(outline, edge, place) {
  const [a, b] = edges(outline)[edge] ?? [place, place];
  const along = minus(b, a);
  const length = Math.hypot(...along) || 1;
  const metres = Math.round(dot(minus(place, a), along) / length / STEP_M) * STEP_M;
  const within = Math.max(Math.min(STEP_M, length / 2), Math.min(length - Math.min(STEP_M, length / 2), metres));
  return outline.toSpliced(edge + 1, 0, rounded(moved(a, along, within / length)));
}

/**
 * Where a corner goes that a hand brings to a place: in line with its neighbours, or at a right angle to their other edges, where it is
 * within reach of that.
 * @param {Point[]} outline
 * @param {number} corner
 * @param {Point} place
 * @param {number} reach
 * @returns {Point}
 */
export function snapped(outline, corner, [x, y], reach) {
  const place = /** @type {Point} */ ([Math.round(100 * x) / 100, Math.round(100 * y) / 100]);
  const at = (/** @type {number} */ k) => outline.at((corner + k) % outline.length) ?? place;
  /** Lines through a neighbour, each with its direction. @type {[Point, Point][]} */
  const lines = [-1, 1].flatMap((side) => {
    const [x, y] = minus(at(side), at(2 * side));
    const square = /** @type {Point} */ ([-y / (Math.hypot(x, y) || 1), x / (Math.hypot(x, y) || 1)]);
    return [[1, 0], [0, 1], square].map((direction) => /** @type {[Point, Point]} */ ([at(side), /** @type {Point} */ (direction)]));
  });
  const meetings = lines.flatMap(([a, d], i) =>
    lines.slice(i + 1).flatMap(([b, e]) => (Math.abs(cross(d, e)) < 0.1 ? [] : [moved(a, d, cross(minus(b, a), e) / cross(d, e))])),
  );
  const feet = lines.map(([a, d]) => moved(a, d, dot(minus(place, a), d) / (dot(d, d) || 1)));
  const nearest = (/** @type {Point[]} */ places) =>
    places
      // a corner on a neighbour is none
      .filter((other) => distance(other, place) <= reach && Math.min(distance(other, at(-1)), distance(other, at(1))) > reach)
      .sort((a, b) => distance(a, place) - distance(b, place))[0];
  return rounded(nearest(meetings) ?? nearest(feet) ?? place);
}

/**
 * The outline with a wall moved across itself, in whole centimetres: the walls beside it become longer or shorter along their lines, but
 * for those that hardly turn from it, whose other ends stay.
 * @param {Point[]} outline
 * @param {number} edge
 * @param {Point} by of which the part across the wall counts
 * @returns {Point[]}
 */
export function withWall(outline, edge, by) {
  const count = outline.length;
  const at = (/** @type {number} */ k) => /** @type {Point} */ (outline[(k + count) % count]);
  const along = minus(at(edge + 1), at(edge));
  const length = Math.hypot(...along);
  if (!(length > 0)) return outline;
  const across = /** @type {Point} */ ([-along[1] / length, along[0] / length]);
  // ends of the wall, each with the wall beside it
  const ends = [[edge, edge - 1], [edge + 1, edge + 2]].map(([end = 0, other = 0]) => {
    const beside = minus(at(other), at(end));
    const [rise, metres] = [dot(beside, across), Math.hypot(...beside)];
    const turns = Math.abs(rise) >= 0.1 * metres && metres > 0;
    return { end: (end + count) % count, direction: turns ? moved([0, 0], beside, 1 / rise) : across, most: turns ? { rise, shift: rise * Math.max(0, 1 - LEAST_WALL_M / metres) } : null };
  });
  // walls beside it do not turn around
  const wish = Math.round(100 * dot(by, across)) / 100;
  const shift = ends.reduce((now, { most }) => (most ? Math[most.rise > 0 ? "min" : "max"](now, most.shift) : now), wish);
  return outline.map((corner, k) => {
    const of = ends.find(({ end }) => end === k);
    return of ? rounded(moved(corner, of.direction, shift)) : corner;
  });
}

/** Length of an edge. @param {Point[]} outline @param {number} edge */
export const lengthOf = (outline, edge) => {
  const [a, b] = edges(outline)[edge] ?? [[0, 0], [0, 0]];
  return distance(/** @type {Point} */ (a), /** @type {Point} */ (b));
};

/**
 * The outline with another length of an edge: its end moves, and a wall at a right angle to it moves as a whole.
 * @param {Point[]} outline
 * @param {number} edge
 * @param {number} metres
 * @returns {Point[]}
 */
export function withLength(outline, edge, metres) {
  const count = outline.length;
  const [a, b] = edges(outline)[edge] ?? [[0, 0], [0, 0]];
  const along = minus(/** @type {Point} */ (b), /** @type {Point} */ (a));
  const length = Math.hypot(...along);
  if (!(length > 0)) return outline;
  const [end, after] = [(edge + 1) % count, (edge + 2) % count];
  const beside = minus(outline[after] ?? [0, 0], outline[end] ?? [0, 0]);
  const square = Math.abs(dot(along, beside)) <= 1e-3 * length * Math.hypot(...beside) && count > 3;
  return outline.map((corner, k) =>
    k === end || (square && k === after) ? rounded(moved(corner, along, metres / length - 1)) : corner,
  );
}

/** Shapes to begin with. @typedef {"rectangle" | "L" | "U" | "T" | "free"} Shape */

/** Outlines in a square of one; no wall lies below a ridge in its middle. @type {Record<Exclude<Shape, "free">, Point[]>} */
const SHAPES = {
  rectangle: [[0, 0], [1, 0], [1, 1], [0, 1]],
  L: [[0, 0], [1, 0], [1, 0.4], [0.4, 0.4], [0.4, 1], [0, 1]],
  U: [[0, 0], [1, 0], [1, 1], [0.65, 1], [0.65, 0.4], [0.35, 0.4], [0.35, 1], [0, 1]],
  T: [[0.3, 0], [0.7, 0], [0.7, 0.6], [1, 0.6], [1, 1], [0, 1], [0, 0.6], [0.3, 0.6]],
};

/** @typedef {{ west: number, south: number, east: number, north: number }} Bounds */

/** The outline of a shape between bounds. @param {Exclude<Shape, "free">} shape @param {Bounds} bounds @returns {Point[]} */
export const outlineOf = (shape, { west, south, east, north }) =>
  SHAPES[shape].map(([x, y]) => rounded([west + x * (east - west), south + y * (north - south)]));

/** The shape of an outline: of right angles alone, by the corners that point inward. @param {Point[]} outline @returns {Shape} */
export function shapeOf(outline) {
  const around = edges(outline).map(([a, b]) => minus(b, a));
  if (around.some(([x, y]) => Math.min(Math.abs(x), Math.abs(y)) > 1e-6)) return "free";
  const turns = around.map((edge, k) => Math.sign(cross(around.at(k - 1) ?? edge, edge)));
  const sense = Math.sign(turns.reduce((sum, turn) => sum + turn, 0));
  const inward = turns.flatMap((turn, k) => (turn === -sense ? [k] : []));
  const apart = ((inward[1] ?? 0) - (inward[0] ?? 0) + outline.length) % outline.length;
  if (turns.includes(0)) return "free";
  if (outline.length === 4) return "rectangle";
  if (outline.length === 6) return "L";
  if (outline.length !== 8) return "free";
  return apart === 1 || apart === 7 ? "U" : apart === 3 || apart === 5 ? "T" : "free";
}
