// Openings of tubes in the room: the centre of each, the direction in which its pipe leaves, and its rim.
import { openingIn } from "./faces.js";
import { edges, isInside } from "./outline.js";
import { cross, dot, moved, unit } from "./ray.js";
import { ceilingAt, planes, rings } from "./room.js";
import { diameter, square } from "./tube.js";

/** @typedef {import("./ray.js").Vector} Vector */
/** @typedef {JobDocument["room"]} Room */

const RADIANS = Math.PI / 180;
/** Length in metres within which a point is at the ceiling, and a step into the room. */
const NEAR_M = 2e-3;

/** True if the opening of a tube lies in the plane of its face. @param {Tube} tube */
export const isInFace = (tube) => tube.normal === "face";

/** The place of a tube in plan. @param {Tube} tube @returns {[number, number]} */
export const inPlan = ({ centre_m: [x, y] }) => [x, y];

/** True if a tube comes through a wall. @param {Room} room @param {Tube} tube */
export function isInWall(room, tube) {
  const z = tube.centre_m[2];
  return isInFace(tube) && typeof z === "number" && z < ceilingAt(room, inPlan(tube)) - NEAR_M;
}

/** A wall near a point: the distance to it, the nearest point of it, its ends, and the unit vector out of the room. @typedef {{ metres: number, foot: [number, number], from: [number, number], to: [number, number], outward: Vector }} Wall */

/** The wall nearest to a point. @param {Room} room @param {[number, number]} point @returns {Wall} */
export function nearestWall(room, [x, y]) {
  const all = rings(room);
  const found = all.flatMap(edges).map(([from, to]) => {
    const [along, across] = [to[0] - from[0], to[1] - from[1]];
    const squared = along * along + across * across || 1;
    const share = Math.min(1, Math.max(0, ((x - from[0]) * along + (y - from[1]) * across) / squared));
    const foot = /** @type {[number, number]} */ ([from[0] + share * along, from[1] + share * across]);
    return { metres: Math.hypot(foot[0] - x, foot[1] - y), foot, from, to, outward: unit([across, -along, 0]) };
  });
  const wall = found.reduce((best, edge) => (edge.metres < best.metres ? edge : best));
  const [east, north] = [(wall.from[0] + wall.to[0]) / 2, (wall.from[1] + wall.to[1]) / 2];
  // outlines run in either sense
  const leaves = !isInside(all, [east + NEAR_M * wall.outward[0], north + NEAR_M * wall.outward[1]]);
  return leaves ? wall : { ...wall, outward: moved([0, 0, 0], wall.outward, -1) };
}

/**
 * Centre of a tube's opening in metres, and its unit normal out of the room.
 * @param {Room} room
 * @param {Tube} tube
 * @returns {{ centre: Vector, outward: Vector }}
 */
export function opening(room, tube) {
  const place = inPlan(tube);
  const found = room.faces && openingIn(room.faces, tube);
  if (found) return found;
  if (!isInFace(tube)) return { centre: [...place, ceilingAt(room, place) - (tube.drop_m ?? 0)], outward: [0, 0, 1] };
  if (isInWall(room, tube)) return { centre: [...place, tube.centre_m[2] ?? 0], outward: nearestWall(room, place).outward };
  const over = planes(room).map(({ height_m, rise }) => ({ height: height_m + dot([...rise, 0], [...place, 0]), rise }));
  const lowest = over.reduce((low, plane) => (plane.height < low.height ? plane : low));
  return { centre: [...place, lowest.height], outward: unit([-lowest.rise[0], -lowest.rise[1], 1]) };
}

/** A ring of corners around a point, across a direction. @param {Vector} middle @param {Vector} direction @param {number} radius @param {number} sides */
export function circle(middle, direction, radius, sides) {
  const one = unit(cross(direction, Math.abs(direction[2]) > 0.9 ? [1, 0, 0] : [0, 0, 1]));
  const two = cross(direction, one);
  return Array.from({ length: sides }, (_, k) => {
    const angle = (2 * Math.PI * k) / sides;
    return moved(moved(middle, one, radius * Math.cos(angle)), two, radius * Math.sin(angle));
  });
}

/** Four corners around a point in a level plane, turned clockwise seen from above. @param {Vector} middle @param {number} width @param {number} depth @param {number} rotation_deg @returns {Vector[]} */
export function rectangle([x, y, z], width, depth, rotation_deg) {
  const [cos, sin] = [Math.cos(rotation_deg * RADIANS), Math.sin(rotation_deg * RADIANS)];
  return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([i = 0, j = 0]) => {
    const [u, v] = [(i * width) / 2, (j * depth) / 2];
    return [x + u * cos + v * sin, y - u * sin + v * cos, z];
  });
}

/** Corners of a square around the middle of an opening, turned clockwise seen from outside; below a slope two sides are level at 0 degrees. @param {Vector} middle @param {Vector} outward @param {number} side @param {number} rotation_deg @returns {Vector[]} */
function squareIn(middle, outward, side, rotation_deg) {
  if (outward[2] > 1 - 1e-9) return rectangle(middle, side, side, rotation_deg);
  const level = unit(cross([0, 0, 1], outward));
  const up = cross(outward, level);
  return rectangle([0, 0, 0], side, side, rotation_deg).map(([u, v]) => moved(moved(middle, level, u), up, v));
}

/** Corners of the rim of an opening: of its circle so many, of a square four. @param {Room} room @param {Tube} tube @param {number} sides */
export function rim(room, tube, sides) {
  const { centre, outward } = opening(room, tube);
  const { side_m = 0, rotation_deg = 0 } = square(tube) ?? {};
  return side_m > 0 ? squareIn(centre, outward, side_m, rotation_deg) : circle(centre, outward, diameter(tube) / 2, sides);
}
