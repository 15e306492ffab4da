// Changes of a room above a plan, and from a box to one and back.
import { centimetres, roomyBeside, shift } from "./draft.js";
import { clearance, outlineOf, shapeOf, snapped, withCorner, withLength, withWall } from "./outline.js";
import { inPlan } from "./opening.js";
import { ceilingAt, extent, outline, rings, toward } from "./room.js";
import { diameter } from "./tube.js";

/** @typedef {import("./outline.js").Point} Point */
/** @typedef {Schemas["CeilingDocument"]["kind"]} CeilingKind */

/** Least number of corners. */
const LEAST_CORNERS = 3;
/** Pitch of a slope to begin with. */
const PITCH_DEG = 30;

/** The shape of a room as it is chosen: a rectangle that is drawn corner by corner is free. @param {JobDocument["room"]} room */
export function shape(room) {
  const found = shapeOf(outline(room));
  return found === "rectangle" && room.plan && room.ceiling?.kind === "flat" ? "free" : found;
}

/** Names of the walls of a box, in the order of its outline. */
const OF_BOX = ["wall_south", "wall_east", "wall_north", "wall_west"];

/** Gives the surfaces of single faces their new names. @param {JobDocument["room"]} room @param {(name: string) => string[]} to */
function rename(room, to) {
  if (!room.surfaces) return;
  room.surfaces = Object.fromEntries(Object.entries(room.surfaces).flatMap(([name, surface]) => to(name).map((other) => [other, surface])));
}

/** Numbers the walls anew. @param {JobDocument["room"]} room @param {(edge: number) => number[]} to */
const renumber = (room, to) =>
  rename(room, (name) => {
    const edge = /^wall_(\d+)$/.exec(name)?.[1];
    return edge === undefined ? [name] : to(Number(edge)).map((other) => `wall_${other}`);
  });

/** The room's plan, which a box gets. @param {JobDocument} draft */
function planOf({ room }) {
  if (!room.plan) rename(room, (name) => [OF_BOX.includes(name) ? `wall_${OF_BOX.indexOf(name)}` : name]);
  const plan = room.plan ?? { outline_m: outline(room) };
  room.ceiling ??= { kind: "flat", height_m: extent(room).height };
  delete room.size_m;
  return (room.plan = plan);
}

/** Gives the room another shape within its extent. @param {JobDocument} draft @param {import("./outline.js").Shape} shape */
export function setShape(draft, shape) {
  const bounds = extent(draft.room);
  const plan = planOf(draft);
  if (shape === "free") return;
  plan.outline_m = outlineOf(shape, bounds);
  delete plan.holes_m;
  renumber(draft.room, () => []);
  // what lies beyond the new walls comes in
  for (const tube of draft.tubes ?? []) {
    if (clearance(rings(draft.room), inPlan(tube)) >= diameter(tube) / 2) continue;
    tube.centre_m = roomyBeside(draft.room, (draft.tubes ?? []).filter((other) => other !== tube).map(inPlan), inPlan(tube));
  }
  asBox(draft);
}

/** Makes a rectangle below a level ceiling a box. @param {JobDocument} draft */
function asBox(draft) {
  const { room } = draft;
  const { west, south, width, depth, height } = extent(room);
  const isBox = room.ceiling?.kind === "flat" && shapeOf(outline(room)) === "rectangle" && !room.plan?.holes_m?.length;
  if (!isBox) return;
  if (west) shift(draft, 0, -west);
  if (south) shift(draft, 1, -south);
  const own = outline(room).join() === outlineOf("rectangle", extent(room)).join();
  rename(room, (name) => {
    const edge = /^wall_(\d+)$/.exec(name)?.[1];
    return edge === undefined ? [name] : own ? OF_BOX.slice(Number(edge), Number(edge) + 1) : [];
  });
  delete room.plan;
  delete room.ceiling;
  room.size_m = [width, depth, height];
}

/** Gives the room another ceiling, as high as the lowest of the one before. @param {JobDocument} draft @param {CeilingKind} kind */
export function setCeiling(draft, kind) {
  const { room } = draft;
  const { lowest, width, depth, west, south } = extent(room);
  if (kind === (room.ceiling?.kind ?? "flat")) return;
  planOf(draft);
  if (kind === "sloped") room.ceiling = { kind, point_m: [west, south, lowest], rise_toward_deg: 0, pitch_deg: PITCH_DEG };
  else if (kind === "flat") room.ceiling = { kind, height_m: lowest };
  else {
    const rise = (Math.min(width, depth) / 2) * Math.tan((PITCH_DEG * Math.PI) / 180);
    room.ceiling = { kind, eaves_m: lowest, ridge_m: centimetres(lowest + rise), ridge_azimuth_deg: width >= depth ? 90 : 0 };
  }
  if (kind === "flat") for (const tube of draft.tubes ?? []) delete tube.drop_m;
  rename(room, (name) => (/^ceiling_[01]$/.test(name) ? [] : [name]));
  asBox(draft);
}

/** Lets a sloped ceiling rise toward another azimuth, from where it is lowest then, as high as it is lowest now. @param {JobDocument} draft @param {number} degrees */
export function setRise({ room }, degrees) {
  const { ceiling } = room;
  if (ceiling?.kind !== "sloped") return;
  const [x, y] = toward(degrees);
  const up = (/** @type {Point} */ corner) => corner[0] * x + corner[1] * y;
  const low = outline(room).toSorted((a, b) => up(a) - up(b))[0] ?? [0, 0];
  ceiling.point_m = [...low, centimetres(Math.min(...outline(room).map((corner) => ceilingAt(room, corner))))];
  ceiling.rise_toward_deg = degrees;
}

/** Stretches the outline and its holes to another width (0) or depth (1). @param {JobDocument} draft @param {0 | 1} axis @param {number} metres */
export function stretch({ room }, axis, metres) {
  if (!room.plan || !(metres > 0)) return;
  const { west, south, width, depth } = extent(room);
  const [from, before] = axis === 0 ? [west, width] : [south, depth];
  for (const corner of [room.plan.outline_m, ...(room.plan.holes_m ?? [])].flat())
    corner[axis] = Math.round((from + ((corner[axis] - from) * metres) / before) * 1e4) / 1e4;
}

/**
 * Moves a corner, which snaps within reach.
 * @param {JobDocument} draft
 * @param {number} corner
 * @param {Point} place
 * @param {number} reach
 */
export function moveCorner({ room }, corner, place, reach) {
  if (room.plan) room.plan.outline_m[corner] = snapped(room.plan.outline_m, corner, place, reach);
}

/** Moves a wall across itself. @param {JobDocument} draft @param {number} edge @param {Point} by @param {Point[]} [from] outline before the hand took it */
export function moveWall({ room }, edge, by, from = outline(room)) {
  if (room.plan) room.plan.outline_m = withWall(from, edge, by);
}

/** Adds a corner to an edge. @param {JobDocument} draft @param {number} edge @param {Point} place */
export function addCorner({ room }, edge, place) {
  if (!room.plan) return;
  room.plan.outline_m = withCorner(room.plan.outline_m, edge, place);
  renumber(room, (wall) => (wall === edge ? [wall, wall + 1] : [wall > edge ? wall + 1 : wall]));
}

/** @param {JobDocument} draft @param {number} corner */
export function removeCorner({ room }, corner) {
  if (!room.plan || room.plan.outline_m.length <= LEAST_CORNERS) return;
  room.plan.outline_m.splice(corner, 1);
  // the wall before it goes on to the next corner
  renumber(room, (wall) => (wall === corner ? [] : [wall > corner ? wall - 1 : wall]));
}

/** @param {JobDocument} draft @param {number} edge @param {number} metres */
export function setLength({ room }, edge, metres) {
  if (room.plan) room.plan.outline_m = withLength(room.plan.outline_m, edge, metres);
}
