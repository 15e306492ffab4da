// Openings of tubes in the room: the centre of each, and the direction in which its pipe leaves.
import { dot, unit } from "./ray.js";
import { ceilingAt, planes, rings } from "./room.js";

/** @typedef {import("./ray.js").Vector} Vector */
/** @typedef {JobDocument["room"]} Room */

/** True if the opening of a tube lies in the plane of its face. @param {Tube} tube */
export const isInFace = (tube) => tube.normal === "face";

/** The place of a tube in plan. @param {Tube} tube @returns {[number, number]} */
export const inPlan = ({ centre_m: [x, y] }) => [x, y];

/** Unit vector out of the room through the wall nearest to a point. @param {Room} room @param {[number, number]} point @returns {Vector} */
function outOfWall(room, [x, y]) {
  const edges = rings(room).flatMap((ring) => ring.map((from, k) => ({ from, to: ring[(k + 1) % ring.length] ?? from })));
  const found = edges.map(({ from, to }) => {
    const [along, across] = [to[0] - from[0], to[1] - from[1]];
    const squared = along * along + across * across || 1;
    const share = Math.min(1, Math.max(0, ((x - from[0]) * along + (y - from[1]) * across) / squared));
    // outlines run counter-clockwise, and holes clockwise
    return { metres: Math.hypot(from[0] + share * along - x, from[1] + share * across - y), outward: unit([across, -along, 0]) };
  });
  return found.reduce((best, edge) => (edge.metres < best.metres ? edge : best), { metres: Infinity, outward: /** @type {Vector} */ ([0, 0, 1]) }).outward;
}

/**
 * Centre of a tube's opening in metres, and its unit normal out of the room.
 * @param {Room} room
 * @param {Tube} tube
 * @returns {{ centre: Vector, outward: Vector }}
 */
export function opening(room, tube) {
  const place = inPlan(tube);
  if (!isInFace(tube)) return { centre: [...place, ceilingAt(room, place) - (tube.drop_m ?? 0)], outward: [0, 0, 1] };
  const z = tube.centre_m[2];
  if (typeof z === "number" && z < ceilingAt(room, place) - 2e-3) return { centre: [...place, z], outward: outOfWall(room, place) };
  const over = planes(room).map(({ height_m, rise }) => ({ height: height_m + dot([...rise, 0], [...place, 0]), rise }));
  const lowest = over.reduce((low, plane) => (plane.height < low.height ? plane : low));
  return { centre: [...place, lowest.height], outward: unit([-lowest.rise[0], -lowest.rise[1], 1]) };
}
