// What every plan of a room has beside its map: its place in the drawing, furniture, openings and pipes of tubes, an arrow to the north.
import { across, down } from "./map.js";
import { objects as models } from "./models.js";
import { inPlan, isInFace, opening, rim as rimOf } from "./opening.js";
import { isInside } from "./outline.js";
import { numbered, places } from "./plan_labels.js";
import { joints } from "./ray.js";
import { extent, rings } from "./room.js";
import { AROUND } from "./stage.js";
import { diameter, isMesh, square } from "./tube.js";
import { nothing, svg } from "./vendor/lit-html.js";

/** @typedef {import("./map.js").Layout} Layout */
/** @typedef {JobDocument["room"]} Room */

/** Sides of a rim that is seen from the side. */
const SIDES = 48;

/** Sizes of a drawing that stands by itself, small and large. @type {[number, number]} */
export const SMALL = [364, 400];
/** @type {[number, number]} */
export const LARGE = [560, 560];

/** @param {Room} room @param {[number, number]} box size of the drawing @returns {Layout} */
export function layout(room, box) {
  const { west, north, width, depth } = extent(room);
  const { left, right, top, bottom } = AROUND.plan;
  const [across, down] = [box[0] - left - right, box[1] - top - bottom];
  const k = Math.max(1, Math.min(across / width, down / depth));
  return { k, left: left + (across - k * width) / 2 - k * west, top: top + (down - k * depth) / 2, north, box };
}

/** The layout in a box that is as high as the room needs, at most as high as the given one. @param {Room} room @param {[number, number]} box */
export function fitted(room, [width, height]) {
  const { k } = layout(room, [width, height]);
  return layout(room, [width, Math.min(height, k * extent(room).depth + AROUND.plan.top + AROUND.plan.bottom)]);
}

/** Boxes, and objects that are meshes as far as their triangles are there. @param {Room} room @param {Schemas["MeshesResult"] | null} meshes @param {Layout} at */
export const furniture = (room, meshes, at) => [
  (room.objects ?? []).map((object) => (object.kind === "box" ? box(object, at) : nothing)),
  models(meshes, [0, 1], { x: across(at, 0), y: down(at, 0), k: at.k }),
];

/** @param {Extract<Schemas["ObjectDocument"], { kind: "box" }>} object @param {Layout} at */
function box({ position_m, size_m, rotation_deg }, at) {
  const [x, y] = [across(at, position_m[0]), down(at, position_m[1])];
  const [width, depth] = [at.k * size_m[0], at.k * size_m[1]];
  return svg`<rect class="object" x=${x - width / 2} y=${y - depth / 2} width=${width} height=${depth}
    transform=${`rotate(${rotation_deg ?? 0} ${x} ${y})`}></rect>`;
}

/** A partition as a line of a class. @param {Schemas["PartitionDocument"]} partition @param {Layout} at @param {string} as */
export const partitionLine = ({ from_m, to_m }, at, as) =>
  svg`<line class=${as} x1=${across(at, from_m[0])} y1=${down(at, from_m[1])} x2=${across(at, to_m[0])} y2=${down(at, to_m[1])}></line>`;

/** The circle of a tube, or within a square opening. @param {Tube} tube @param {Layout} at */
export const ring = (tube, at) => ({ x: across(at, tube.centre_m[0]), y: down(at, tube.centre_m[1]), radius: (at.k * Math.max(diameter(tube), square(tube)?.side_m ?? 0)) / 2 });

/** The rings of tubes, the places of their numbers within the room, and what of both lines of equal illuminance are not labelled on, in metres. @param {Room} room @param {Tube[]} tubes @param {Layout} at */
export function marks(room, tubes, at) {
  const circles = tubes.map((tube) => ring(tube, at));
  const metres = (/** @type {number} */ x, /** @type {number} */ y) => /** @type {[number, number]} */ ([(x - at.left) / at.k, at.north - (y - at.top) / at.k]);
  const walls = rings(room);
  const labels = places(circles, (x, y) => isInside(walls, metres(x, y)));
  const taken = [...tubes.map(inPlan), ...labels.flatMap((label) => (label ? [metres(label.x, label.y)] : []))];
  return { numbers: numbered(circles, labels), taken };
}

/** The rim of an opening: seen at an angle an ellipse, in a wall a line. @param {Room} room @param {Tube} tube @param {Layout} at */
export function rim(room, tube, at) {
  if (isInFace(tube)) return svg`<path class="ring" d=${`M${rimOf(room, tube, SIDES).map(([x, y]) => `${across(at, x).toFixed(1)} ${down(at, y).toFixed(1)}`).join("L")}Z`}></path>`;
  const { x, y, radius } = ring(tube, at);
  const { side_m = 0, rotation_deg = 0 } = square(tube) ?? {};
  const side = at.k * side_m;
  return side > 0
    ? svg`<rect class="ring" x=${x - side / 2} y=${y - side / 2} width=${side} height=${side}
        transform=${`rotate(${rotation_deg} ${x} ${y})`}></rect>`
    : svg`<circle class="ring" cx=${x} cy=${y} r=${radius}></circle>`;
}

/** Where a tube goes that is not vertical. @param {Room} room @param {Tube} tube @param {Layout} at */
export function axis(room, tube, at) {
  if (isMesh(tube)) return nothing;
  const [x, y] = tube.centre_m;
  const points = joints(tube.segments, opening(room, tube).outward).map((joint) => `${across(at, x + joint[0])},${down(at, y + joint[1])}`);
  return isInFace(tube) || tube.segments.some(({ tilt_deg }) => tilt_deg)
    ? svg`<polyline class="axis ground" points=${points.join(" ")}></polyline><polyline class="axis" points=${points.join(" ")}></polyline>`
    : nothing;
}

/** An arrow to the north. @param {number} turned azimuth of the room's y axis */
export const north = (turned) =>
  svg`<g class="north" transform="translate(14 15)" role="img" aria-label=${`North; the room is turned by ${turned} degrees`}><g
    transform=${`rotate(${-turned})`}><path d="M0 -13 L5 5 L0 2 L-5 5 Z"></path></g><text x="24" y="5">N</text></g>`;
