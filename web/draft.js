// The job document that is edited: what it needs, and how it is changed.

/** Largest edge of a cell of the work plane, and how many cells there are along an edge. */
const CELL_M = 0.25;
const CELLS = { least: 8, most: 40 };
/** Distance of a moved tube from the walls. */
const FROM_WALL_M = 0.02;

/** @param {number} value @param {number} least @param {number} most */
export const within = (value, least, most) => Math.max(least, Math.min(most, value));
/** To whole centimetres. @param {number} metres */
export const centimetres = (metres) => Math.round(metres * 100) / 100;

/** @param {Tube} tube @returns {tube is MeshTube} */
export const isMesh = (tube) => "mesh" in tube;
/** @param {Tube} tube */
export const diameter = (tube) => (isMesh(tube) ? tube.opening_diameter_m : tube.diameter_m);

/**
 * A usual tube of a kind: rigid, under a dome, over an opal diffuser.
 * @param {"straight" | "bent"} kind
 * @param {[number, number]} centre_m
 * @returns {ParametricTube}
 */
export function usualTube(kind, centre_m) {
  return {
    centre_m,
    diameter_m: 0.35,
    reflectance: 0.98,
    segments: kind === "straight" ? [{ length_m: 1.2 }] : [{ length_m: 0.6 }, { length_m: 0.9, tilt_deg: 30, azimuth_deg: 180 }],
    collector: { kind: "dome", transmittance: 0.92 },
    diffuser: { kind: "lambertian", transmittance: 0.6 },
  };
}

/** The document with what the page needs; throws where it is none. @param {any} read @returns {JobDocument} */
export function complete(read) {
  const size = read?.room?.size_m;
  if (!Array.isArray(size) || size.length !== 3 || !size.every((edge) => Number.isFinite(edge) && edge > 0)) {
    throw new Error("it has no room");
  }
  /** @type {JobDocument} */
  const draft = structuredClone(read);
  draft.tubes ??= [];
  if (!draft.grids?.length) draft.grids = [{ name: "workplane", height_m: Math.min(0.85, size[2] / 2), cells: [8, 8] }];
  return draft;
}

/**
 * The document after a change; its work plane has cells of about 25 cm.
 * @param {JobDocument} draft
 * @param {(draft: JobDocument) => void} change
 */
export function changed(draft, change) {
  const next = structuredClone(draft);
  change(next);
  const grid = next.grids?.[0];
  const size = /** @type {JobDocument} */ draft.room.size_m;
  if (grid && (size[0] !== next.room.size_m[0] || size[1] !== next.room.size_m[1])) {
    const cells = (/** @type {number} */ edge) => within(Math.round(edge / CELL_M), CELLS.least, CELLS.most);
    grid.cells = [cells(next.room.size_m[0]), cells(next.room.size_m[1])];
  }
  return next;
}

/**
 * Moves a tube's centre, within the ceiling.
 * @param {JobDocument} draft
 * @param {number} index
 * @param {number} x
 * @param {number} y
 */
export function moveTube(draft, index, x, y) {
  const tube = draft.tubes?.[index];
  if (!tube) return;
  const free = diameter(tube) / 2 + FROM_WALL_M;
  const [width, depth] = draft.room.size_m;
  tube.centre_m = [
    centimetres(within(x, Math.min(free, width / 2), Math.max(width - free, width / 2))),
    centimetres(within(y, Math.min(free, depth / 2), Math.max(depth - free, depth / 2))),
  ];
}

/** @param {JobDocument} draft @param {number} index */
export function removeTube(draft, index) {
  draft.tubes?.splice(index, 1);
}

/** Adds a usual tube where there is most room. @param {JobDocument} draft */
export function addTube(draft) {
  const [width, depth] = draft.room.size_m;
  const tubes = (draft.tubes ??= []);
  let best = { distance: -1, x: width / 2, y: depth / 2 };
  for (let i = 1; i < 8; i++) {
    for (let j = 1; j < 8; j++) {
      const [x, y] = [(width * i) / 8, (depth * j) / 8];
      const toTubes = tubes.map((tube) => Math.hypot(tube.centre_m[0] - x, tube.centre_m[1] - y));
      const distance = Math.min(...toTubes, 2 * Math.min(x, y, width - x, depth - y));
      if (distance > best.distance + 1e-9) best = { distance, x, y };
    }
  }
  const last = tubes.at(-1);
  const tube = last && !isMesh(last) ? structuredClone(last) : usualTube("straight", [0, 0]);
  tubes.push(tube);
  moveTube(draft, tubes.length - 1, best.x, best.y);
}

/** The edges of a room that can be moved. @typedef {"east" | "west" | "north" | "south"} Edge */

/**
 * Makes the room as wide (0) or deep (1) as was typed, at its east or north; the service judges the size.
 * @param {JobDocument} draft
 * @param {0 | 1} axis
 * @param {number} metres
 */
export function resize(draft, axis, metres) {
  draft.room.size_m[axis] = metres;
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
  const before = size[axis] ?? 1;
  size[axis] = centimetres(within(before + metres, leastEdge(draft), 50));
  const grown = size[axis] - before;
  if (edge === "west" || edge === "south") shift(draft, axis, grown);
  draft.tubes?.forEach((tube, index) => moveTube(draft, index, tube.centre_m[0], tube.centre_m[1]));
}

/** @param {JobDocument} draft */
const leastEdge = (draft) => Math.max(0.8, ...(draft.tubes ?? []).map((tube) => diameter(tube) + 0.1));

/** Moves all that stands in the room. @param {JobDocument} draft @param {0 | 1} axis @param {number} metres */
function shift(draft, axis, metres) {
  const places = [
    ...(draft.tubes ?? []).map((tube) => tube.centre_m),
    ...(draft.room.objects ?? []).map((object) => object.position_m),
    ...(draft.room.luminaires ?? []).map((luminaire) => luminaire.corner_m),
    ...(draft.views ?? []).flatMap((view) => [view.eye_m, view.look_at_m]),
  ];
  for (const place of places) place[axis] = centimetres((place[axis] ?? 0) + metres);
}
