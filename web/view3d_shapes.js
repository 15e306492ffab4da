// The room of a document in space, as polygons: faces, tubes, furniture, and arrows to the north and from the sun.
import { dot, joints, minus, mitres, moved, normal, skyward, unit } from "./ray.js";
import { ceilings, extent, rings, toward, walls } from "./room.js";
import { circle, opening as openingOf, rectangle, rim } from "./opening.js";
import { isInside } from "./outline.js";
import { diameter, isMesh, square } from "./tube.js";

/** @typedef {import("./ray.js").Vector} Vector */
/** @typedef {"floor" | "wall" | "ceiling" | "patch" | "object" | "outdoors" | "front" | "sheet" | "partition" | "closure" | "pipe" | "cover" | "luminaire" | "north" | "sun"} Part */
/** Convex polygon, whose corners run counter-clockwise seen from its front, with a colour of its own (red, green and blue, 0..1) where it has one. @typedef {{ part: Part, ring: Vector[], colour?: Vector }} Polygon */
/** Polygons of what is drawn, and lines along its edges. @typedef {{ polygons: Polygon[], lines: Vector[][] }} Shapes */

/** Sides of a round pipe, and of each of many. */
const SIDES = { few: 24, many: 12 };
const MANY = 60;
/** Steps of a dome from its rim to its top. */
const DOME_STEPS = 4;

/** A polygon whose front faces a direction. @param {Vector[]} ring @param {Vector} direction */
const facing = (ring, direction) => (dot(normal(ring), direction) < 0 ? ring.toReversed() : ring);

/** A closed line around a polygon. @param {Vector[]} ring */
const closed = (ring) => [...ring, /** @type {Vector} */ (ring[0])];

/**
 * Rings in a plane that is not upright, the holes among them, as trapezoids between levels of y.
 * @param {Vector[][]} all
 * @returns {Vector[][]}
 */
export function trapezoids(all) {
  const sides = all.flatMap((ring) => ring.map((corner, k) => [corner, /** @type {Vector} */ (ring[(k + 1) % ring.length])]));
  const levels = [...new Set(all.flat().map(([, y]) => y))].sort((a, b) => a - b);
  /** @param {Vector[]} side @param {number} y @returns {Vector} */
  const on = ([a = [0, 0, 0], b = [0, 0, 0]], y) => moved(a, minus(b, a), (y - a[1]) / (b[1] - a[1]));
  return levels.slice(1).flatMap((top, k) => {
    const bottom = /** @type {number} */ (levels[k]);
    const middle = (bottom + top) / 2;
    const crossed = sides
      .filter(([a, b]) => Number(a?.[1]) > middle !== Number(b?.[1]) > middle)
      .sort((one, two) => on(one, middle)[0] - on(two, middle)[0]);
    return crossed.flatMap((left, i) => {
      const right = crossed[i + 1];
      return i % 2 === 0 && right ? [[on(left, bottom), on(right, bottom), on(right, top), on(left, top)]] : [];
    });
  });
}

/** Faces of the room, seen from inside. @param {JobDocument["room"]} room @returns {Shapes} */
function shell(room) {
  const inner = rings(room);
  const floor = inner.map((ring) => ring.map((corner) => /** @type {Vector} */ ([...corner, 0])));
  const above = ceilings(room);
  const upright = walls(room).map((ring) => {
    const [b = [0, 0, 0], a = [0, 0, 0]] = ring;
    const across = unit([a[1] - b[1], b[0] - a[0], 0]);
    const [x, y] = moved(moved(a, minus(b, a), 0.5), across, 1e-3);
    return facing(ring, isInside(inner, [x, y]) ? across : moved([0, 0, 0], across, -1));
  });
  const level = (/** @type {Part} */ part, /** @type {Vector[][]} */ of, /** @type {Vector} */ front) => trapezoids(of).map((ring) => ({ part, ring: facing(ring, front) }));
  return {
    polygons: [
      ...level("floor", floor, [0, 0, 1]),
      ...upright.map((ring) => ({ part: /** @type {const} */ ("wall"), ring })),
      ...above.flatMap((of) => level("ceiling", of, [0, 0, -1])),
    ],
    lines: [...upright, ...above.flat()].map(closed),
  };
}

/** Sides between two rings of as many corners. @param {Part} part @param {Vector[]} low @param {Vector[]} high @returns {Polygon[]} */
const between = (part, low, high) =>
  low.map((corner, k) => {
    const next = (k + 1) % low.length;
    return { part, ring: [corner, /** @type {Vector} */ (low[next]), /** @type {Vector} */ (high[next]), /** @type {Vector} */ (high[k])] };
  });

/** A pipe from its opening to its collector; of a mesh the opening alone. @param {JobDocument["room"]} room @param {Tube} tube @param {number} sides @returns {Shapes} */
function guide(room, tube, sides) {
  const radius = diameter(tube) / 2;
  const { centre: opening, outward } = openingOf(room, tube);
  const mouth = circle(opening, outward, radius, sides);
  const closure = square(tube) ? rim(room, tube, sides) : mouth;
  // the triangles of a mesh are drawn for themselves
  if (isMesh(tube)) return sheet("closure", closure);
  const axis = joints(tube.segments, outward).map((joint) => moved(joint, opening, 1));
  const { along, planes } = mitres(axis);
  const { collector } = tube;
  if (collector?.kind === "flat" && typeof collector.tilt_deg === "number")
    planes[planes.length - 1] = skyward(collector.azimuth_deg ?? 0, 90 - collector.tilt_deg);
  const rims = [mouth];
  along.forEach((direction, i) => {
    const [end, across] = [/** @type {Vector} */ (axis[i + 1]), /** @type {Vector} */ (planes[i + 1])];
    rims.push((rims[i] ?? []).map((corner) => moved(corner, direction, dot(minus(end, corner), across) / dot(direction, across))));
  });
  const [top, up, end] = [rims.at(-1) ?? [], along.at(-1) ?? /** @type {Vector} */ ([0, 0, 1]), axis.at(-1) ?? opening];
  const dome = Array.from({ length: DOME_STEPS + 1 }, (_, k) => {
    const angle = (k / DOME_STEPS) * (Math.PI / 2);
    return top.map((corner) => moved(moved(end, minus(corner, end), Math.cos(angle)), up, radius * Math.sin(angle)));
  });
  const isDome = collector?.kind === "dome" || collector?.kind === "dielectric_dome";
  const pane = collector?.kind === "flat" ? [{ part: /** @type {const} */ ("cover"), ring: top }] : [];
  const cover = isDome ? dome.slice(1).flatMap((ring, k) => between("cover", dome[k] ?? [], ring)) : pane;
  return {
    polygons: [
      { part: "closure", ring: closure },
      ...rims.slice(1).flatMap((rim, i) => between("pipe", rims[i] ?? [], rim)),
      ...cover,
    ],
    lines: [closure, ...rims].map(closed),
  };
}

/** A box in the room or outdoors. @param {"object" | "outdoors"} part @param {Extract<Schemas["ObjectDocument" | "ObstructionDocument"], { kind: "box" }>} object @returns {Shapes} */
function box(part, { position_m: [x, y, z], size_m: [width, depth, height], rotation_deg }) {
  const low = rectangle([x, y, z], width, depth, rotation_deg ?? 0);
  const high = low.map((corner) => moved(corner, [0, 0, height], 1));
  const sides = between(part, low, high);
  const ends = [low.toReversed(), high].map((ring) => ({ part, ring }));
  return { polygons: [...sides, ...ends], lines: [...sides.map(({ ring }) => ring), high].map(closed) };
}

/** One polygon with its edges. @param {Part} part @param {Vector[]} ring @returns {Shapes} */
const sheet = (part, ring) => ({ polygons: [{ part, ring }], lines: [closed(ring)] });

/** @param {Schemas["PartitionDocument"]} of */
const partition = ({ from_m: [x1, y1], to_m: [x2, y2], height_m }) =>
  sheet("partition", [[x1, y1, 0], [x2, y2, 0], [x2, y2, height_m], [x1, y1, height_m]]);

/** @param {Schemas["LuminaireDocument"]} of */
const luminaire = ({ corner_m, edge_u_m, edge_v_m }) =>
  sheet("luminaire", [corner_m, moved(corner_m, edge_u_m, 1), moved(moved(corner_m, edge_u_m, 1), edge_v_m, 1), moved(corner_m, edge_v_m, 1)]);

/** An arrow west of the floor that points north, and its letter. @param {JobDocument["room"]} room @returns {Shapes} */
function north(room) {
  const { west, south, north, width, depth } = extent(room);
  const size = 0.05 * Math.hypot(width, depth);
  const [x, y] = toward(-(room.rotation_deg ?? 0));
  const at = (/** @type {number} */ right, /** @type {number} */ up) =>
    /** @type {Vector} */ ([west - 2.5 * size + size * (x * up + y * right), (south + north) / 2 + size * (y * up - x * right), 0]);
  const letter = [at(-0.35, 0.6), at(-0.35, 1.6), at(0.35, 0.6), at(0.35, 1.6)];
  return { polygons: [{ part: "north", ring: [at(-0.5, -1.5), at(0.5, -1.5), at(0, 0.2)] }], lines: [letter] };
}

/** An arrow in the direction of the sun's rays, which ends where these enter the box of what is drawn on the way to its middle. @param {Box} box @param {Vector} toSun @returns {Shapes} */
function sunArrow({ middle, half }, toSun) {
  const radius = Math.hypot(...half);
  const edge = Math.min(...toSun.map((along, k) => (half[k] ?? 0) / Math.abs(along)));
  const at = (/** @type {number} */ times, /** @type {number} */ width) => circle(moved(middle, toSun, edge + times * radius), toSun, width * radius, SIDES.many);
  const [tip, neck, tail] = [at(0.04, 0), at(0.16, 0.045), at(0.36, 0.012)];
  return { polygons: [...between("sun", tip, neck), ...between("sun", at(0.16, 0.012), tail), { part: "sun", ring: neck }], lines: [] };
}

/** The box, along the axes, that holds polygons: its middle and half of its size, in metres. @typedef {{ middle: Vector, half: Vector }} Box */
/** What is seen as a whole: points from a middle, and the radius around it within which all lies. @typedef {{ middle: Vector, radius: number, points: Vector[] }} Bounds */

/** @param {Polygon[]} polygons @returns {Box} */
function around(polygons) {
  const [low, high] = [/** @type {Vector} */ ([Infinity, Infinity, Infinity]), /** @type {Vector} */ ([-Infinity, -Infinity, -Infinity])];
  for (const { ring } of polygons)
    for (const corner of ring) {
      for (const k of /** @type {const} */ ([0, 1, 2])) {
        low[k] = Math.min(low[k], corner[k]);
        high[k] = Math.max(high[k], corner[k]);
      }
    }
  const half = moved([0, 0, 0], minus(high, low), 0.5);
  return { middle: moved(low, half, 1), half };
}

/** @param {Polygon[]} seen @param {Polygon[]} all @returns {Bounds} */
function bounds(seen, all) {
  const { middle } = around(seen);
  const points = (/** @type {Polygon[]} */ of) => of.flatMap(({ ring }) => ring.map((corner) => minus(corner, middle)));
  return { middle, radius: points(all).reduce((most, point) => Math.max(most, Math.hypot(...point)), 0), points: points(seen) };
}

/**
 * All that is drawn of a document but its map, and its bounds.
 * @param {JobDocument} draft
 * @param {{ azimuth_deg: number, altitude_deg: number } | null} sun azimuth from north, null where it is not out
 * @param {{ faces?: Polygon[], models?: Polygon[] }} [files] what files of a job have: patches in place of the faces, and meshes
 * @returns {Shapes & { bounds: Bounds }}
 */
export function shapes({ room, tubes = [], surroundings }, sun, { faces = [], models = [] } = {}) {
  const sides = tubes.length > MANY ? SIDES.many : SIDES.few;
  const { polygons: plain, lines } = shell(room);
  const parts = [
    { polygons: faces.length ? faces : plain, lines },
    { polygons: models, lines: [] },
    ...tubes.map((tube) => guide(room, tube, sides)),
    ...(room.objects ?? []).flatMap((object) => (object.kind === "box" ? [box("object", object)] : [])),
    ...(room.partitions ?? []).map(partition),
    ...(room.luminaires ?? []).map(luminaire),
  ];
  const whole = around(parts.flatMap(({ polygons }) => polygons));
  parts.push(north(room));
  if (sun) parts.push(sunArrow(whole, skyward(sun.azimuth_deg - (room.rotation_deg ?? 0), sun.altitude_deg)));
  // what is outdoors may be far larger than the room
  const seen = parts.flatMap(({ polygons }) => polygons);
  parts.push(...(surroundings?.obstructions ?? []).map((of) => box("outdoors", of)));
  const polygons = parts.flatMap(({ polygons }) => polygons);
  return { polygons, lines: parts.flatMap(({ lines }) => lines), bounds: bounds(seen, polygons) };
}
