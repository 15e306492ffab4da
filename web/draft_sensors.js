// Changes of single sensors: places with a direction that they face, in a grid of points.
import { centimetres, roomiest, within } from "./draft.js";
import { ceilingAt, extent } from "./room.js";
import { NAMED, sensorsOf, vector } from "./sensor.js";

/** @typedef {import("./sensor.js").Sensor} Sensor */

/** Height of a new sensor: that of the eyes of somebody who sits. */
const HEIGHT_M = 1.2;

/** Adds a sensor where there is most room; it faces what the last one does, at first the north. @param {JobDocument} draft */
export function addSensor(draft) {
  const { grid, points } = sensorsOf(draft);
  const [x, y] = roomiest(draft.room, points);
  const last = points.at(-1);
  const height = last?.[2] ?? centimetres(Math.min(HEIGHT_M, ceilingAt(draft.room, [x, y]) / 2));
  const [east, north, up] = last?.slice(3) ?? vector(...NAMED.north);
  const sensor = /** @type {Sensor} */ ([centimetres(x), centimetres(y), height, east, north, up]);
  const grids = (draft.grids ??= []);
  const names = grids.map(({ name }) => name);
  if (grid < 0) grids.push({ name: names.includes("sensors") ? `sensors-${names.length + 1}` : "sensors", points_m: [sensor] });
  else points.push(sensor);
}

/** Removes a sensor, and with the last one its grid. @param {JobDocument} draft @param {number} index */
export function removeSensor(draft, index) {
  const { grid, points } = sensorsOf(draft);
  points.splice(index, 1);
  if (!points.length && Number(draft.grids?.length) > 1) draft.grids?.splice(grid, 1);
}

/** Moves a sensor within the room's extent. @param {JobDocument} draft @param {number} index @param {number} x @param {number} y */
export function moveSensor(draft, index, x, y) {
  const { west, east, south, north } = extent(draft.room);
  const sensor = sensorsOf(draft).points[index];
  if (!sensor) return;
  sensor[0] = centimetres(within(x, west, east));
  sensor[1] = centimetres(within(y, south, north));
}

/** Turns a sensor to an azimuth and an altitude. @param {JobDocument} draft @param {number} index @param {number} azimuth @param {number} altitude */
export function turnSensor(draft, index, azimuth, altitude) {
  const sensor = sensorsOf(draft).points[index];
  if (!sensor) return;
  const [east, north, up] = vector(azimuth, altitude);
  [sensor[3], sensor[4], sensor[5]] = [east, north, up];
}
