// The job document that is edited: what it needs, and how it is changed.
import { inPlan, isInFace, isInWall, nearestWall } from "./opening.js";
import { clearance } from "./outline.js";
import { ceilingAt, extent, rings, steepness } from "./room.js";
import { diameter, isMesh, usualTube } from "./tube.js";

/** Largest edge of a cell of the work plane, and how many cells there are along an edge. */
const CELL_M = 0.25;
const CELLS = { least: 8, most: 40 };
/** Cells of a plan along its longer side, and the step of their size. */
const PLAN_CELLS = 20;
const SPACING_STEP_M = 0.05;
/** Distance of a moved tube from the walls. */
const FROM_WALL_M = 0.02;
/** Distance within which an opening is in its wall. */
const ON_WALL_M = 5e-4;
/** Share of the height of a wall at which an opening comes into it. */
const UP_THE_WALL = 0.75;

/** @param {number} value @param {number} least @param {number} most */
export const within = (value, least, most) => Math.max(least, Math.min(most, value));
/** To whole centimetres. @param {number} metres */
export const centimetres = (metres) => Math.round(metres * 100) / 100;

/** The document with what the page needs; throws where it is none. @param {any} read @returns {JobDocument} */
export function complete(read) {
  const numbers = (/** @type {any} */ list, /** @type {number} */ count) =>
    Array.isArray(list) && list.length === count && list.every(Number.isFinite);
  const { size_m, plan, ceiling } = read?.room ?? {};
  const isBox = !plan && numbers(size_m, 3) && size_m.every((/** @type {number} */ edge) => edge > 0);
  const isRing = (/** @type {any} */ ring) =>
    Array.isArray(ring) && ring.length >= 3 && ring.every((/** @type {any} */ corner) => numbers(corner, 2));
  const isPlan = isRing(plan?.outline_m) && (plan.holes_m ?? []).every(isRing) && typeof ceiling?.kind === "string";
  if (!isBox && !isPlan) throw new Error("it has no room");
  /** @type {JobDocument} */
  const draft = structuredClone(read);
  draft.tubes ??= [];
  const height_m = Math.min(0.85, extent(draft.room).height / 2);
  if (!draft.grids?.length) draft.grids = [{ name: "workplane", height_m, ...(plan ? { spacing_m: spacing(draft) } : { cells: [8, 8] }) }];
  return draft;
}

/** Size of the cells of a plan. @param {JobDocument} draft */
function spacing({ room }) {
  const { width, depth } = extent(room);
  return centimetres(Math.max(1, Math.round(Math.max(width, depth) / PLAN_CELLS / SPACING_STEP_M)) * SPACING_STEP_M);
}

/**
 * The document after a change: the work plane of a box has cells of about 25 cm, openings hang below a slope as a whole, and those in walls
 * go with them.
 * @param {JobDocument} draft
 * @param {(draft: JobDocument) => void} change
 */
export function changed(draft, change) {
  const next = structuredClone(draft);
  change(next);
  const grid = next.grids?.[0];
  const [before, after] = [extent(draft.room), extent(next.room)];
  const isOther = before.width !== after.width || before.depth !== after.depth || !draft.room.plan !== !next.room.plan;
  if (grid && isOther && !grid.points_m) {
    delete grid.cells;
    delete grid.spacing_m;
    const cells = (/** @type {number} */ edge) => within(Math.round(edge / CELL_M), CELLS.least, CELLS.most);
    if (next.room.plan) grid.spacing_m = spacing(next);
    else grid.cells = [cells(after.width), cells(after.depth)];
  }
  const slope = steepness(next.room);
  for (const tube of slope > 0 ? (next.tubes ?? []).filter((tube) => !isInFace(tube)) : []) {
    const least = Math.ceil(50 * diameter(tube) * slope - 1e-9) / 100;
    if (!((tube.drop_m ?? 0) >= least)) tube.drop_m = least;
  }
  for (const [index, tube] of (next.tubes ?? []).entries()) {
    const before = draft.tubes?.[index];
    const wasInWall = before && next.tubes?.length === draft.tubes?.length && isInWall(draft.room, before);
    if (wasInWall && isInFace(tube) && nearestWall(next.room, inPlan(tube)).metres > ON_WALL_M) putIntoWall(next.room, tube, inPlan(tube));
  }
  return next;
}

/**
 * Moves a tube's centre, within the ceiling, or along the walls.
 * @param {JobDocument} draft
 * @param {number} index
 * @param {number} x
 * @param {number} y
 */
export function moveTube(draft, index, x, y) {
  const tube = draft.tubes?.[index];
  if (!tube) return;
  if (isInWall(draft.room, tube)) return putIntoWall(draft.room, tube, [x, y]);
  const free = diameter(tube) / 2 + FROM_WALL_M;
  if (draft.room.plan) {
    tube.centre_m = besideWalls(rings(draft.room), inPlan(tube), [centimetres(x), centimetres(y)], free);
    return;
  }
  const { width, depth } = extent(draft.room);
  tube.centre_m = [
    centimetres(within(x, Math.min(free, width / 2), Math.max(width - free, width / 2))),
    centimetres(within(y, Math.min(free, depth / 2), Math.max(depth - free, depth / 2))),
  ];
}

/**
 * Where a tube of a plan goes: along walls where they are in the way; anywhere if it stood in none before.
 * @param {import("./outline.js").Point[][]} rings
 * @param {[number, number]} from
 * @param {[number, number]} to
 * @param {number} free
 * @returns {[number, number]}
 */
function besideWalls(rings, from, to, free) {
  const isFree = (/** @type {[number, number]} */ place) => clearance(rings, place) >= free - 1e-9;
  /** @type {[number, number][]} */
  const places = [to, [to[0], from[1]], [from[0], to[1]], from];
  return places.find(isFree) ?? to;
}

/**
 * Puts an opening into the wall nearest to a place, as high as it is or as suits that wall.
 * @param {JobDocument["room"]} room
 * @param {Tube} tube
 * @param {[number, number]} place
 */
function putIntoWall(room, tube, place) {
  const { foot, from, to } = nearestWall(room, place);
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  const free = diameter(tube) / 2 + FROM_WALL_M;
  // in whole centimetres along the wall
  const along = within(centimetres(Math.hypot(foot[0] - from[0], foot[1] - from[1])), Math.min(free, length / 2), Math.max(length - free, length / 2));
  const share = along / (length || 1);
  const fine = (/** @type {number} */ metres) => Math.round(metres * 1e5) / 1e5;
  const at = /** @type {[number, number]} */ ([fine(from[0] + share * (to[0] - from[0])), fine(from[1] + share * (to[1] - from[1]))]);
  const ceiling = ceilingAt(room, at);
  const height = isInWall(room, tube) ? Number(tube.centre_m[2]) : centimetres(UP_THE_WALL * ceiling);
  tube.normal = "face";
  tube.centre_m = [...at, within(height, Math.min(free, ceiling / 2), Math.max(centimetres(ceiling - free), ceiling / 2))];
  delete tube.drop_m;
  delete tube.face;
}

/** How an opening lies: level, in the plane of a sloped ceiling, or in a wall. @typedef {"level" | "slope" | "wall"} Lie */

/** How the opening of a tube lies. @param {JobDocument["room"]} room @param {Tube} tube @returns {Lie} */
export function lieOf(room, tube) {
  if (isInWall(room, tube)) return "wall";
  return isInFace(tube) && steepness(room) > 0 ? "slope" : "level";
}

/** Turns the opening of a tube into another plane at its place; of a wall, the nearest one, above which its bends turn up. @param {JobDocument["room"]} room @param {Tube} tube @param {Lie} lie */
export function setLie(room, tube, lie) {
  if (lie === "wall") {
    // what leads away from a ceiling may lead back into the room
    if (!isInWall(room, tube) && !isMesh(tube)) tube.segments = tube.segments.map(({ length_m }) => ({ length_m }));
    return putIntoWall(room, tube, inPlan(tube));
  }
  const place = inPlan(tube);
  delete tube.face;
  if (isInWall(room, tube)) {
    const free = diameter(tube) / 2 + FROM_WALL_M;
    const { outward } = nearestWall(room, place);
    tube.centre_m = [centimetres(place[0] - free * outward[0]), centimetres(place[1] - free * outward[1])];
  }
  if (lie === "level") delete tube.normal;
  else tube.normal = "face";
  if (lie === "slope") delete tube.drop_m;
}

/** Hangs a tube below the ceiling. @param {Tube | undefined} tube @param {number} metres */
export function setDrop(tube, metres) {
  if (!tube || isInFace(tube)) return;
  const drop = centimetres(metres);
  if (drop > 0) tube.drop_m = drop;
  else delete tube.drop_m;
}

/** @param {JobDocument} draft @param {number} index */
export function removeTube(draft, index) {
  draft.tubes?.splice(index, 1);
}

/** Places of a raster over a room, with the space around each between walls and others, such as tubes. @param {JobDocument["room"]} room @param {number[][]} others @param {number} parts */
function places(room, others, parts) {
  const { west, south, width, depth } = extent(room);
  const walls = rings(room);
  const inner = Array.from({ length: parts - 1 }, (_, i) => (i + 1) / parts);
  return inner.flatMap((i) =>
    inner.map((j) => {
      const place = /** @type {[number, number]} */ ([west + width * i, south + depth * j]);
      const toOthers = others.map(([x = 0, y = 0]) => Math.hypot(x - place[0], y - place[1]));
      return { place, space: Math.min(...toOthers, 2 * clearance(walls, place)) };
    }),
  );
}

/**
 * The place in a room with most space around it, between walls and others, such as tubes.
 * @param {JobDocument["room"]} room
 * @param {number[][]} others
 * @returns {[number, number]}
 */
export const roomiest = (room, others) => places(room, others, 8).reduce((best, one) => (one.space > best.space + 1e-9 ? one : best)).place;

/** Share of the most space there is that is enough beside a place that was left. */
const ENOUGH = 0.7;

/**
 * The place in a room that is nearest to another one, with enough space around it.
 * @param {JobDocument["room"]} room
 * @param {number[][]} others
 * @param {readonly [number, number]} to
 * @returns {[number, number]}
 */
export function roomyBeside(room, others, [x, y]) {
  const all = places(room, others, 20);
  const most = Math.max(...all.map(({ space }) => space));
  const away = (/** @type {{ place: [number, number] }} */ { place }) => Math.hypot(place[0] - x, place[1] - y);
  return all.filter(({ space }) => space >= ENOUGH * most).reduce((nearest, one) => (away(one) < away(nearest) - 1e-9 ? one : nearest)).place;
}

/** Adds a usual tube where there is most room. @param {JobDocument} draft */
export function addTube(draft) {
  const tubes = (draft.tubes ??= []);
  const [x, y] = roomiest(draft.room, tubes.map(inPlan));
  const last = tubes.at(-1);
  const tube = last && !isMesh(last) ? structuredClone(last) : usualTube("straight", [0, 0]);
  tubes.push(tube);
  moveTube(draft, tubes.length - 1, x, y);
}

/** The edges of a room that can be moved. @typedef {"east" | "west" | "north" | "south"} Edge */

/**
 * Makes the room as wide (0) or deep (1) as was typed, at its east or north; the service judges the size.
 * @param {JobDocument} draft
 * @param {0 | 1} axis
 * @param {number} metres
 */
export function resize(draft, axis, metres) {
  if (draft.room.size_m) draft.room.size_m[axis] = metres;
  // no slip of the keys moves the tubes into a room that has no place for them
  if (metres < leastEdge(draft)) return;
  draft.tubes?.forEach((tube, index) => moveTube(draft, index, tube.centre_m[0], tube.centre_m[1]));
}

/**
 * Drags an edge by so many metres, as far as the tubes let it; what stands in the room stays where it is.
 * @param {JobDocument} draft
 * @param {Edge} edge
 * @param {number} metres
 */
export function moveEdge(draft, edge, metres) {
  const axis = edge === "east" || edge === "west" ? 0 : 1;
  const size = draft.room.size_m;
  if (!size) return;
  const before = size[axis];
  size[axis] = centimetres(within(before + metres, leastEdge(draft), 50));
  const grown = size[axis] - before;
  if (edge === "west" || edge === "south") shift(draft, axis, grown);
  draft.tubes?.forEach((tube, index) => moveTube(draft, index, tube.centre_m[0], tube.centre_m[1]));
}

/** @param {JobDocument} draft */
const leastEdge = (draft) => Math.max(0.8, ...(draft.tubes ?? []).map((tube) => diameter(tube) + 0.1));

/** Where an object stands, or each copy of it. @param {NonNullable<JobDocument["room"]["objects"]>[number]} object @returns {[number, number, number][]} */
function positions(object) {
  const copies = ("instances" in object && object.instances) || [];
  return [object, ...copies].flatMap(({ position_m }) => (position_m ? [position_m] : []));
}

/** Moves all that stands in the room. @param {JobDocument} draft @param {0 | 1} axis @param {number} metres */
export function shift(draft, axis, metres) {
  const places = [
    ...(draft.tubes ?? []).map((tube) => tube.centre_m),
    ...(draft.room.objects ?? []).flatMap(positions),
    ...(draft.room.luminaires ?? []).map((luminaire) => luminaire.corner_m),
    ...(draft.room.partitions ?? []).flatMap((partition) => [partition.from_m, partition.to_m]),
    ...(draft.grids ?? []).flatMap((grid) => grid.points_m ?? []),
    ...(draft.views ?? []).flatMap((view) => [view.eye_m, view.look_at_m]),
  ];
  for (const place of places) place[axis] = centimetres((place[axis] ?? 0) + metres);
}
