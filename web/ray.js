// A ray of the sun through the mirror pipe of a tube, reflected as by a perfect mirror.

/** @typedef {[number, number, number]} Vector */
/** Course of a ray: its points, and where it leaves the pipe. @typedef {{ points: Vector[], direction: Vector, end: "room" | "sky" }} Course */

/** Reflections after which a ray is followed no more: hardly any light is left. */
const MOST = 200;
const RADIANS = Math.PI / 180;
/** Length below which a ray counts as where it is. */
const NEAR_M = 1e-9;

/** @param {Vector} a @param {Vector} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Vector} a @param {Vector} b @returns {Vector} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Vector} a @param {Vector} direction @param {number} times @returns {Vector} */
export const moved = (a, direction, times) => [a[0] + times * direction[0], a[1] + times * direction[1], a[2] + times * direction[2]];
/** @param {Vector} a @param {Vector} b @returns {Vector} */
export const minus = (a, b) => moved(a, b, -1);
/** @param {Vector} a @returns {Vector} */
export const unit = (a) => moved([0, 0, 0], a, 1 / Math.hypot(...a));
/** Vector along the normal of a polygon, twice its area long (Newell's sum). @param {Vector[]} ring @returns {Vector} */
export const normal = (ring) =>
  ring.reduce((sum, corner, k) => moved(sum, cross(corner, /** @type {Vector} */ (ring[(k + 1) % ring.length])), 1), /** @type {Vector} */ ([0, 0, 0]));

/** Unit vector toward an azimuth of the room's frame and an altitude. @param {number} azimuth_deg @param {number} altitude_deg @returns {Vector} */
export function skyward(azimuth_deg, altitude_deg) {
  const [azimuth, altitude] = [azimuth_deg * RADIANS, altitude_deg * RADIANS];
  return [Math.cos(altitude) * Math.sin(azimuth), Math.cos(altitude) * Math.cos(azimuth), Math.sin(altitude)];
}

/** The joints of a tube's axis, from the middle of its opening out, along a normal of it if that is given. @param {ParametricTube["segments"]} segments @param {Vector} [outward] @returns {Vector[]} */
export function joints(segments, outward) {
  /** @type {Vector[]} */
  const found = [[0, 0, 0]];
  segments.forEach(({ length_m, tilt_deg = 0, azimuth_deg = 0 }, i) =>
    found.push(moved(/** @type {Vector} */ (found.at(-1)), (i === 0 && outward) || skyward(azimuth_deg, 90 - tilt_deg), length_m)),
  );
  return found;
}

/**
 * Directions of a pipe's pieces, and normals of the planes at its joints: square at both ends, mitres between pieces.
 * @param {Vector[]} axis joints of the pipe in metres
 */
export function mitres(axis) {
  const along = axis.slice(1).map((joint, i) => unit(minus(joint, /** @type {Vector} */ (axis[i]))));
  const planes = axis.map((_, i) => (i === 0 ? (along[0] ?? /** @type {Vector} */ ([0, 0, 1])) : unit(moved(/** @type {Vector} */ (along[i - 1]), along[i] ?? [0, 0, 0], 1))));
  return { along, planes };
}

/**
 * Follows a ray down a pipe, from the middle of its upper end; null where it does not enter. Pieces meet at mitres.
 * @param {Vector[]} axis joints of the pipe in metres
 * @param {number} radius in metres
 * @param {Vector} toSun unit vector
 * @returns {Course | null}
 */
export function throughPipe(axis, radius, toSun) {
  const { along, planes } = mitres(axis);
  const pieces = along.length;
  let [place, direction] = [/** @type {Vector} */ (axis[pieces]), moved([0, 0, 0], toSun, -1)];
  if (!pieces || dot(direction, /** @type {Vector} */ (planes[pieces])) > -1e-6) return null;
  const points = [place];
  let piece = pieces - 1;
  for (let turns = 0; turns < MOST; turns++) {
    const [u, from] = [/** @type {Vector} */ (along[piece]), /** @type {Vector} */ (axis[piece])];
    const toPlane = (/** @type {number} */ end) => {
      const normal = /** @type {Vector} */ (planes[end]);
      const metres = dot(minus(/** @type {Vector} */ (axis[end]), place), normal) / dot(direction, normal);
      return metres > NEAR_M ? metres : Infinity;
    };
    const across = (/** @type {Vector} */ of) => moved(of, u, -dot(of, u));
    const [w, d] = [across(minus(place, from)), across(direction)];
    const [a, b, c] = [dot(d, d), dot(w, d), Math.min(0, dot(w, w) - radius * radius)];
    const toWall = a > 0 ? (-b + Math.sqrt(b * b - a * c)) / a : Infinity;
    const [down, up] = [toPlane(piece), toPlane(piece + 1)];
    const metres = Math.min(toWall, down, up);
    if (!Number.isFinite(metres)) return null;
    place = moved(place, direction, metres);
    if (metres === toWall) {
      points.push(place);
      const normal = unit(across(minus(place, from)));
      direction = moved(direction, normal, -2 * dot(direction, normal));
    } else {
      piece += metres === down ? -1 : 1;
      if (piece >= 0 && piece < pieces) continue;
      points.push(place);
      return { points, direction, end: piece < 0 ? "room" : "sky" };
    }
  }
  return null;
}
