// Single sensors of a document, and the directions that they face.
import { toward } from "./room.js";

/** Place of a sensor in metres, and the direction that it faces. @typedef {[number, number, number, number, number, number]} Sensor */
/** What a sensor faces; north is up on the plan. @typedef {"up" | "north" | "east" | "south" | "west" | "other"} Facing */

const RADIANS = Math.PI / 180;

/** Azimuth and altitude of the directions that have a name. @type {Record<Exclude<Facing, "other">, [number, number]>} */
export const NAMED = { up: [0, 90], north: [0, 0], east: [90, 0], south: [180, 0], west: [270, 0] };

/** The number of a document's grid of sensors, -1 where it has none, and the sensors. @param {JobDocument} draft @returns {{ grid: number, points: Sensor[] }} */
export function sensorsOf({ grids }) {
  const grid = (grids ?? []).findIndex(({ points_m }) => points_m);
  return { grid, points: grids?.[grid]?.points_m ?? [] };
}

/** Unit vector of a direction. @param {number} azimuth @param {number} altitude @returns {[number, number, number]} */
export function vector(azimuth, altitude) {
  const fine = (/** @type {number} */ part) => Math.round(1e6 * part) / 1e6 + 0;
  const [east, north] = toward(azimuth);
  const level = Math.cos(altitude * RADIANS);
  return [fine(level * east), fine(level * north), fine(Math.sin(altitude * RADIANS))];
}

/** Azimuth and altitude of what a sensor faces, in tenths of degrees. @param {Sensor} sensor @returns {[number, number]} */
export function angles([, , , east, north, up]) {
  const tenths = (/** @type {number} */ radians) => Math.round((10 * radians) / RADIANS) / 10 + 0;
  const level = Math.hypot(east, north);
  return [level > 1e-6 * Math.abs(up) ? (tenths(Math.atan2(east, north)) + 360) % 360 : 0, tenths(Math.atan2(up, level))];
}

/** What a sensor faces. @param {Sensor} sensor @returns {Facing} */
export function facing(sensor) {
  const found = Object.entries(NAMED).find(([, of]) => of.join() === angles(sensor).join());
  return /** @type {Facing} */ (found?.[0] ?? "other");
}

/** Names of azimuths, in steps of 45 degrees. */
const COMPASS = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];

/** What a sensor faces, in words. @param {Sensor} sensor */
export function faces(sensor) {
  const [azimuth, altitude] = angles(sensor);
  const upright = altitude > 0 ? "up" : "down";
  if (Math.abs(altitude) === 90) return upright;
  const toward = COMPASS[azimuth / 45] ?? `${azimuth}°`;
  return altitude ? `${toward}, ${Math.abs(altitude)}° ${upright}` : toward;
}
