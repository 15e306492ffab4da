// A camera that turns around the room: where it stands, what moves it, and what it sees.
import { cross, dot, minus, moved, skyward, unit } from "./ray.js";

/** @typedef {import("./ray.js").Vector} Vector */
/** From where the camera sees the room, and how many times nearer than where the room fills the picture. @typedef {{ azimuth_deg: number, altitude_deg: number, zoom: number }} Orbit */

/** From a corner, and from above. @type {Record<"corner" | "above", Orbit>} */
export const STARTS = { corner: { azimuth_deg: 205, altitude_deg: 32, zoom: 1 }, above: { azimuth_deg: 180, altitude_deg: 89, zoom: 1 } };
/** Bounds of the altitude, so that the room's up stays up, and of the zoom. */
const ALTITUDES = { least: -40, most: 89 };
const ZOOMS = { least: 0.1, most: 8 };
/** Vertical angle of view. */
const VIEW_DEG = 32;
/** Share of the picture, across or down, that is filled at a zoom of 1. */
export const FILLED = 0.94;
/** Steps of a key. */
const KEY_DEG = 5;
const KEY_ZOOM = 1.15;

/** @param {number} value @param {{ least: number, most: number }} bounds */
const within = (value, { least, most }) => Math.max(least, Math.min(most, value));

/** Turns the camera. @param {Orbit} orbit @param {number} azimuth_deg @param {number} altitude_deg @returns {Orbit} */
export const turned = (orbit, azimuth_deg, altitude_deg) => ({
  ...orbit,
  azimuth_deg: (((orbit.azimuth_deg + azimuth_deg) % 360) + 360) % 360,
  altitude_deg: within(orbit.altitude_deg + altitude_deg, ALTITUDES),
});

/** Comes nearer. @param {Orbit} orbit @param {number} times @returns {Orbit} */
export const zoomed = (orbit, times) => ({ ...orbit, zoom: within(orbit.zoom * times, ZOOMS) });

/** Where a key brings the camera; null where it brings it nowhere. @param {Orbit} orbit @param {string} key @returns {Orbit | null} */
export function byKey(orbit, key) {
  if (key === "ArrowLeft") return turned(orbit, KEY_DEG, 0);
  if (key === "ArrowRight") return turned(orbit, -KEY_DEG, 0);
  if (key === "ArrowUp") return turned(orbit, 0, KEY_DEG);
  if (key === "ArrowDown") return turned(orbit, 0, -KEY_DEG);
  if (key === "+" || key === "=") return zoomed(orbit, KEY_ZOOM);
  if (key === "-") return zoomed(orbit, 1 / KEY_ZOOM);
  return key === "Home" ? STARTS.corner : null;
}

/** How far a direction sees from the middle of what lies around it: the distance from which points reach just to both sides of the picture, and the shift that brings them to its middle. @param {Vector[]} points from that middle @param {Vector} across @param {Vector} forward @param {number} slope of the sides */
function fitted(points, across, forward, slope) {
  let [right, left] = [-Infinity, -Infinity];
  for (const point of points) {
    const [side, depth] = [dot(across, point), slope * dot(forward, point)];
    right = Math.max(right, side - depth);
    left = Math.max(left, -side - depth);
  }
  return { distance: (right + left) / (2 * slope), shift: (right - left) / 2 };
}

/**
 * The matrix from the room's frame to clip space (Akenine-Möller et al. 2018, section 4.7), column by column.
 * @param {Orbit} orbit
 * @param {import("./view3d_shapes.js").Bounds} bounds whose points fill the picture at a zoom of 1, as far as its proportions allow
 * @param {number} aspect width of the picture over its height
 * @returns {number[]}
 */
export function projection({ azimuth_deg, altitude_deg, zoom }, { middle, radius, points }, aspect) {
  const half = Math.tan((VIEW_DEG * Math.PI) / 360);
  const toEye = skyward(azimuth_deg, altitude_deg);
  const forward = minus([0, 0, 0], toEye);
  const right = unit(cross(forward, [0, 0, 1]));
  const up = cross(right, forward);
  const across = fitted(points, right, forward, FILLED * half * aspect);
  const down = fitted(points, up, forward, FILLED * half);
  const distance = Math.max(across.distance, down.distance) / zoom;
  const eye = moved(moved(moved(middle, right, across.shift), up, down.shift), toEye, distance);
  // the room may be much smaller than all that is drawn, and its middle beside that of the picture
  const [near, far] = [Math.max(distance - 2 * radius, distance / 50), distance + 2 * radius];
  const [sx, sy, sz] = [1 / (half * aspect), 1 / half, (far + near) / (far - near)];
  const column = (/** @type {0 | 1 | 2} */ k) => [sx * right[k], sy * up[k], sz * forward[k], forward[k]];
  const depth = dot(forward, eye);
  return [...column(0), ...column(1), ...column(2), -sx * dot(right, eye), -sy * dot(up, eye), -sz * depth - (2 * far * near) / (far - near), -depth];
}
