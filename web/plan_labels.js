// Where the numbers of tubes stand on the plan: within their rings, or beside them where these are small or crowd.
import { svg } from "./vendor/lit-html.js";

/** @typedef {{ x: number, y: number, radius: number }} Ring */
/** Place of a number, and whether a line leads to its ring. @typedef {{ x: number, y: number, apart: boolean }} Label */

/** Size of a digit, space between two numbers, and the least radius of a ring that holds a number. */
const DIGIT = { width: 7.5, height: 11 };
const BETWEEN = 4;
const LEAST_RADIUS = 10;
/** Directions and distances from the ring at which a place is looked for. */
const DIRECTIONS = 16;
const NEAREST = 9;
const DISTANCES = [NEAREST, 19, 30, 42];

/** Number of rings above which numbers stand within them or not at all: places beside many rings take too long to find. */
const MOST_MOVED = 200;

/** @param {{ x: number, y: number }} a @param {number} width @param {Ring} ring */
function isOn({ x, y }, width, ring) {
  const [dx, dy] = [Math.max(0, Math.abs(x - ring.x) - width / 2), Math.max(0, Math.abs(y - ring.y) - DIGIT.height / 2)];
  return Math.hypot(dx, dy) < ring.radius;
}

/** Places of the numbers of rings, none over another one or over a ring that is not its own; null where there is no room. @param {Ring[]} rings @param {(x: number, y: number) => boolean} [isInRoom] @returns {(Label | null)[]} */
export function places(rings, isInRoom = () => true) {
  /** @type {{ x: number, y: number, width: number }[]} */
  const taken = [];
  return rings.map((ring, index) => {
    const width = DIGIT.width * String(index + 1).length;
    const around = rings.length > MOST_MOVED ? [] : DISTANCES.flatMap((distance) =>
      Array.from({ length: DIRECTIONS }, (_, i) => {
        const [angle, away] = [(2 * Math.PI * (i + 0.5)) / DIRECTIONS, ring.radius + distance];
        return { x: ring.x + away * Math.sin(angle), y: ring.y - away * Math.cos(angle), apart: distance > NEAREST };
      }),
    );
    const within = ring.radius >= LEAST_RADIUS ? [{ x: ring.x, y: ring.y, apart: false }] : [];
    const isFree = (/** @type {Label} */ place) =>
      (!around.includes(place) || isInRoom(place.x, place.y)) &&
      rings.every((other, at) => (at === index && !around.includes(place)) || !isOn(place, width, other)) &&
      taken.every((other) => Math.abs(other.x - place.x) > (other.width + width) / 2 + BETWEEN || Math.abs(other.y - place.y) > DIGIT.height);
    const found = [...within, ...around].find(isFree) ?? null;
    if (found) taken.push({ x: found.x, y: found.y, width });
    return found;
  });
}

/** The numbers of tubes at their places. @param {Ring[]} rings @param {(Label | null)[]} places */
export const numbered = (rings, places) =>
  places.map((place, index) => {
    const ring = rings[index];
    if (!place || !ring) return null;
    const lead = svg`<line class="lead" x1=${ring.x} y1=${ring.y} x2=${place.x} y2=${place.y}></line>`;
    return svg`${place.apart ? lead : null}<text class="tube-number" x=${place.x} y=${place.y + 4}>${index + 1}</text>`;
  });
