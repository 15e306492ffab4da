// A room given by its faces: the one that a tube comes through, and the place and direction of the opening in it.
import { isInside } from "./outline.js";
import { dot, minus, moved, normal, unit } from "./ray.js";

/** @typedef {import("./ray.js").Vector} Vector */
/** @typedef {Schemas["FaceDocument"]} Face */
/** Centre of an opening in metres, and its unit normal out of the room. @typedef {{ centre: Vector, outward: Vector }} Place */

/** Distance in metres within which a point lies on a face, and a step off it. */
const NEAR_M = 2e-3;

/** Boundary and holes of a face. @param {Face} face @returns {Vector[][]} */
const rings = ({ boundary_m, holes_m }) => /** @type {Vector[][]} */ ([boundary_m, ...(holes_m ?? [])]);

/** Unit normal of a face to one of its sides. @param {Face} face @returns {Vector} */
const across = (face) => unit(normal(rings(face)[0] ?? []));

/** Height of a point over the plane of a face, in metres along its normal. @param {Face} face @param {Vector} point */
const height = (face, point) => dot(minus(point, /** @type {Vector} */ (rings(face)[0]?.[0])), across(face));

/** True of a point that lies within a face when both are seen along the axis of the room nearest to the face's normal. @param {Face} face @param {Vector} point */
function covers(face, point) {
  const sizes = across(face).map(Math.abs);
  const away = sizes.indexOf(Math.max(...sizes));
  const seen = (/** @type {Vector} */ corner) => /** @type {[number, number]} */ (corner.filter((_, axis) => axis !== away));
  return isInside(rings(face).map((ring) => ring.map(seen)), seen(point));
}

/** Height of a face that is not upright over a place in plan. @param {Face} face @param {Vector} place */
function over(face, [x, y]) {
  const [a, b, c] = across(face);
  const [cornerX, cornerY, cornerZ] = /** @type {Vector} */ (rings(face)[0]?.[0]);
  return cornerZ - (a * (x - cornerX) + b * (y - cornerY)) / c;
}

/** True of a point in the room: a ray from it crosses faces an odd number of times. @param {Face[]} faces @param {Vector} from */
function isInRoom(faces, from) {
  // along no edge that people draw
  const ray = unit([0.5377, 0.2913, 0.7914]);
  const crossed = faces.filter((face) => {
    const metres = -height(face, from) / dot(ray, across(face));
    return metres > 0 && covers(face, moved(from, ray, metres));
  });
  return crossed.length % 2 === 1;
}

/** The face that a tube comes through: the named one, the one that the centre lies on, or the ceiling above it. @param {Face[]} faces @param {Tube} tube */
function faceOf(faces, { face: name, centre_m }) {
  const [x, y, z] = centre_m;
  const isOverhead = (/** @type {Face} */ face) => face.kind === "ceiling" && Math.abs(across(face)[2]) > 1e-6;
  const isAt = (/** @type {Face} */ face) =>
    typeof z === "number" ? face.kind !== "floor" && Math.abs(height(face, [x, y, z])) < NEAR_M && covers(face, [x, y, z]) : isOverhead(face) && covers(face, [x, y, over(face, [x, y, 0])]);
  return faces.find((face) => (name ? face.name === name : isAt(face)));
}

/** Place of a tube's opening in the faces of a room; null where it comes through none. @param {Face[]} faces @param {Tube} tube @returns {Place | null} */
export function openingIn(faces, tube) {
  const face = faceOf(faces, tube);
  if (!face) return null;
  const [x, y, z] = tube.centre_m;
  const centre = /** @type {Vector} */ ([x, y, z ?? over(face, [x, y, 0])]);
  if (tube.normal !== "face") return { centre: moved(centre, [0, 0, -1], tube.drop_m ?? 0), outward: [0, 0, 1] };
  const one = across(face);
  return { centre, outward: isInRoom(faces, moved(centre, one, NEAR_M)) ? moved([0, 0, 0], one, -1) : one };
}
