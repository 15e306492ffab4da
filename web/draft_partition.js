// Changes of the partitions of a room: sheets that stand on the floor.
import { centimetres, within } from "./draft.js";
import { extent } from "./room.js";

/** @typedef {import("./outline.js").Point} Point */
/** The ends of a partition. @typedef {"from_m" | "to_m"} End */

/** Height of a partition to begin with; under a low ceiling less, four fifths of its least height. */
const HEIGHT_M = 1.4;
/** Shortest partition that is kept of a stroke of the hand. */
const SHORTEST_M = 0.1;

/** The place in the room's extent that is nearest. @param {JobDocument["room"]} room @param {Point} place @returns {Point} */
function inside(room, [x, y]) {
  const { west, south, east, north } = extent(room);
  return [centimetres(within(x, west, east)), centimetres(within(y, south, north))];
}

/** Adds a partition, and returns its number. @param {JobDocument} draft @param {Point} from @param {Point} to */
export function addPartition({ room }, from, to) {
  const height_m = centimetres(Math.min(HEIGHT_M, 0.8 * extent(room).lowest));
  const partitions = (room.partitions ??= []);
  return partitions.push({ from_m: inside(room, from), to_m: inside(room, to), height_m, surface: { reflectance: 0.5 } }) - 1;
}

/** Moves an end of a partition, in line with the room's axes where it is within reach of that. @param {JobDocument} draft @param {number} index @param {End} end @param {Point} place @param {number} reach */
export function movePartitionEnd({ room }, index, end, place, reach) {
  const partition = room.partitions?.[index];
  if (!partition) return;
  const [otherX, otherY] = partition[end === "from_m" ? "to_m" : "from_m"];
  const on = (/** @type {number} */ value, /** @type {number} */ line) => (Math.abs(value - line) < reach ? line : value);
  partition[end] = inside(room, [on(place[0], otherX), on(place[1], otherY)]);
}

/** Moves a partition as a whole, from where it stood. @param {JobDocument} draft @param {number} index @param {Schemas["PartitionDocument"]} before @param {Point} by */
export function movePartition({ room }, index, before, [x, y]) {
  const { west, south, east, north } = extent(room);
  const [xs, ys] = [[before.from_m[0], before.to_m[0]], [before.from_m[1], before.to_m[1]]];
  const [dx, dy] = [within(x, west - Math.min(...xs), east - Math.max(...xs)), within(y, south - Math.min(...ys), north - Math.max(...ys))];
  const partition = room.partitions?.[index];
  if (!partition) return;
  for (const end of /** @type {End[]} */ (["from_m", "to_m"])) partition[end] = [centimetres(before[end][0] + dx), centimetres(before[end][1] + dy)];
}

/** @param {JobDocument} draft @param {number} index */
export function removePartition({ room }, index) {
  room.partitions?.splice(index, 1);
  if (!room.partitions?.length) delete room.partitions;
}

/** True of a partition too short to be meant. @param {Schemas["PartitionDocument"]} partition */
export const isStub = ({ from_m: [x1, y1], to_m: [x2, y2] }) => Math.hypot(x2 - x1, y2 - y1) < SHORTEST_M;
