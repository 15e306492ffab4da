// The room of a document: its outline, its extent, its ceiling and its faces.
import { edges } from "./outline.js";
import { normal } from "./ray.js";

/** @typedef {import("./outline.js").Point} Point */
/** @typedef {[number, number, number]} Place */
/** Plane of a ceiling: its height at the origin, and by how much it rises along x and y. @typedef {{ height_m: number, rise: Point }} Plane */
/** @typedef {JobDocument["room"]} Room */

/** Rise of faces below which they count as level. */
const LEAST_RISE = 1e-3;

/** True for rooms whose floor may be no rectangle. @param {Room} room */
export const hasPlan = (room) => Boolean(room.plan ?? room.faces);

/** Rings of the floors of a room of faces, the holes among them. @param {Room} room @returns {Point[][]} */
const floors = ({ faces }) =>
  (faces ?? [])
    .filter(({ kind }) => kind === "floor")
    .flatMap(({ boundary_m, holes_m }) => [boundary_m, ...(holes_m ?? [])])
    .map((ring) => ring.map(([x = 0, y = 0]) => /** @type {Point} */ ([x, y])));

/** The outline of the floor. @param {Room} room @returns {Point[]} */
export function outline(room) {
  if (room.plan) return room.plan.outline_m;
  if (room.faces) return floors(room)[0] ?? [];
  const [width, depth] = room.size_m ?? [0, 0];
  return [
    [0, 0],
    [width, 0],
    [width, depth],
    [0, depth],
  ];
}

/** The outline and the holes in it. @param {Room} room @returns {Point[][]} */
export const rings = (room) => (room.faces ? floors(room) : [outline(room), ...(room.plan?.holes_m ?? [])]);

/** Unit vector toward an azimuth; exact along the axes. @param {number} degrees @returns {Point} */
export function toward(degrees) {
  const quarter = (((degrees % 360) + 360) % 360) / 90;
  if (Number.isInteger(quarter)) return /** @type {Point} */ ([[0, 1], [1, 0], [0, -1], [-1, 0]][quarter]);
  return [Math.sin((degrees * Math.PI) / 180), Math.cos((degrees * Math.PI) / 180)];
}

/** @param {Point} a @param {Point} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1];

/** Planes of the ceiling, the lowest of which counts. @param {Room} room @returns {Plane[]} */
export function planes(room) {
  const { ceiling } = room;
  if (!ceiling) return [{ height_m: room.size_m?.[2] ?? 0, rise: [0, 0] }];
  if (ceiling.kind === "flat") return [{ height_m: ceiling.height_m, rise: [0, 0] }];
  if (ceiling.kind === "sloped") {
    const [x, y, z] = ceiling.point_m;
    const slope = Math.tan((ceiling.pitch_deg * Math.PI) / 180);
    const [east, north] = toward(ceiling.rise_toward_deg);
    const rise = /** @type {Point} */ ([east * slope, north * slope]);
    return [{ height_m: z - dot(rise, [x, y]), rise }];
  }
  const across = toward(ceiling.ridge_azimuth_deg + 90);
  const places = outline(room).map((corner) => dot(corner, across));
  const [from, to] = [Math.min(...places), Math.max(...places)];
  const slope = (2 * (ceiling.ridge_m - ceiling.eaves_m)) / (to - from);
  const plane = (/** @type {number} */ rise, /** @type {number} */ eaves) => ({
    height_m: ceiling.eaves_m - rise * eaves,
    rise: /** @type {Point} */ ([across[0] * rise, across[1] * rise]),
  });
  return [plane(slope, from), plane(-slope, to)];
}

/** Height of a plane over a point. @param {Plane} plane @param {Point} point */
const over = ({ height_m, rise }, point) => height_m + dot(rise, point);

/** Height of the ceiling over a point. @param {Room} room @param {Point} point */
export const ceilingAt = (room, point) => Math.min(...planes(room).map((plane) => over(plane, point)));

/** By how much the ceiling rises along x and y in a metre; that of faces in the mean, whichever way. @param {Room} room @returns {Point} */
function riseOf(room) {
  if (!room.faces) return planes(room)[0]?.rise ?? [0, 0];
  const overhead = room.faces.filter(({ kind }) => kind === "ceiling").map(({ boundary_m }) => normal(/** @type {Place[]} */ (boundary_m)));
  const [east = 0, north = 0, up = 0] = [0, 1, 2].map((axis) => overhead.reduce((sum, across) => sum + Math.abs(across[axis] ?? 0), 0));
  return east + north > LEAST_RISE * up ? [east / up, north / up] : [0, 0];
}

/** By how much the ceiling rises in a metre. @param {Room} room */
export const steepness = (room) => Math.hypot(...riseOf(room));

/** The room's ends, its extent, and its least and greatest height. @param {Room} room */
export function extent(room) {
  const corners = room.faces ? room.faces.flatMap(({ boundary_m }) => boundary_m) : outline(room);
  const [xs, ys] = [corners.map(([x = 0]) => x), corners.map(([, y = 0]) => y)];
  const [west, east, south, north] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const metres = (/** @type {number} */ value) => Math.round(value * 1e4) / 1e4;
  if (room.size_m && !room.plan) {
    const [width, depth, height] = room.size_m;
    return { west, south, east, north, width, depth, lowest: height, height };
  }
  const overhead = room.faces?.filter(({ kind }) => kind === "ceiling").flatMap(({ boundary_m }) => boundary_m);
  const heights = overhead ? overhead.map(([, , z = 0]) => z) : outline(room).map((corner) => ceilingAt(room, corner));
  const ridge = room.ceiling?.kind === "gable" ? room.ceiling.ridge_m : 0;
  const [lowest, height] = [metres(Math.min(...heights)), metres(Math.max(...heights, ridge))];
  return { west, south, east, north, width: metres(east - west), depth: metres(north - south), lowest, height };
}

/** How much longer than wide a room below a level ceiling is whose section shows its length at first. */
const LONG = 2;

/** Where the section of a room looks at first: a slope is seen from the side. @param {Room} room @returns {"north" | "west"} */
export function alongside(room) {
  const [east, north] = riseOf(room);
  if (east || north) return Math.abs(east) > Math.abs(north) ? "north" : "west";
  const { width, depth } = extent(room);
  return depth > LONG * width ? "west" : "north";
}

/** The part of a ring below a plane of the ceiling, where it is the lower one. @param {Point[]} ring @param {Plane} plane @param {Plane} other */
function partBelow(ring, plane, other) {
  const above = (/** @type {Point} */ point) => over(other, point) - over(plane, point);
  return edges(ring).flatMap(([a, b]) => {
    const [from, to] = [above(a), above(b)];
    const kept = from >= 0 ? [a] : [];
    return from * to < 0 ? [...kept, between(a, b, from / (from - to))] : kept;
  });
}

/** @param {Point} a @param {Point} b @param {number} share @returns {Point} */
const between = (a, b, share) => [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];

/** A point at the ceiling. @param {Room} room @param {Point} point @returns {Place} */
const raised = (room, point) => [...point, ceilingAt(room, point)];

/** Walls of a room, each a polygon from its end over its start to its top. @param {Room} room @returns {Place[][]} */
export function walls(room) {
  const [plane, other] = planes(room);
  return rings(room)
    .flatMap(edges)
    .map(([a, b]) => {
      const [ridge, end] = plane && other ? [over(other, a) - over(plane, a), over(other, b) - over(plane, b)] : [0, 0];
      const top = ridge * end < 0 ? [a, between(a, b, ridge / (ridge - end)), b] : [a, b];
      return [[...b, 0], [...a, 0], ...top.map((point) => raised(room, point))];
    });
}

/** Ceilings of a room: of each its outline, then the holes in it. @param {Room} room @returns {Place[][][]} */
export function ceilings(room) {
  const [plane, other] = planes(room);
  const parts = plane && other ? [[plane, other], [other, plane]].map(([one, two]) => rings(room).map((ring) => partBelow(ring, /** @type {Plane} */ (one), /** @type {Plane} */ (two)))) : [rings(room)];
  return parts.map((of) => of.filter((ring) => ring.length > 2).map((ring) => ring.map((point) => raised(room, point))));
}

/** What a ring encloses below it: its area in plan, and its volume down to the floor. @param {Place[]} ring */
function enclosed(ring) {
  const [first = [0, 0, 0]] = ring;
  const parts = ring.slice(1).map((at, k) => [at, ring[k + 2] ?? first].map(([x, y, z]) => [x - first[0], y - first[1], z]));
  const area = (/** @type {number[][]} */ [[ax = 0, ay = 0] = [], [bx = 0, by = 0] = []]) => (ax * by - bx * ay) / 2;
  const sums = parts.map((part) => [area(part), (area(part) * (first[2] + Number(part[0]?.[2]) + Number(part[1]?.[2]))) / 3]);
  const [plan, volume] = [0, 1].map((k) => Math.abs(sums.reduce((sum, of) => sum + Number(of[k]), 0)));
  return { area: plan ?? 0, volume: volume ?? 0 };
}

/** Area of the floor, and volume, of a room that is no room of faces. @param {Room} room */
export function contents(room) {
  const all = ceilings(room).flatMap((rings) => rings.map((ring, k) => ({ ...enclosed(ring), sign: k ? -1 : 1 })));
  const sum = (/** @type {"area" | "volume"} */ of) => all.reduce((total, one) => total + one.sign * one[of], 0);
  return { area: sum("area"), volume: sum("volume") };
}

/** Walls and ceilings of a room, each a polygon. @param {Room} room @returns {Place[][]} */
export const faces = (room) => [...walls(room), ...ceilings(room).flatMap(([ring]) => (ring ? [ring] : []))];
