// The plan of the room from above: the map, the tubes and the room's walls, which are moved by hand.
import { diameter, isMesh } from "./draft.js";
import { bar, across, down, isolines, largest, lux, measures, outlined, outside, values } from "./map.js";
import { drag, keys, moveCursor, still } from "./plan_hand.js";
import { walls } from "./plan_walls.js";
import { extent } from "./room.js";
import { scale } from "./scale.js";
import { set, state } from "./state.js";
import { nothing, svg } from "./vendor/lit-html.js";

/** Space around the room for words, in units of the drawing. */
const AROUND = { left: 40, right: 74, top: 34, bottom: 34 };

/** @param {JobDocument["room"]} room @param {boolean} narrow @returns {import("./map.js").Layout} */
export function layout(room, narrow) {
  const { west, north, width, depth } = extent(room);
  const [across, down] = narrow ? [250, 330] : [430, 420];
  const k = Math.min(across / width, down / depth);
  // a drawing of one width has letters of one size
  const free = Math.max(0, across - k * width);
  return {
    k,
    left: AROUND.left + free / 2 - k * west,
    top: AROUND.top,
    north,
    box: [AROUND.left + k * width + free + AROUND.right, AROUND.top + k * depth + AROUND.bottom],
  };
}

/**
 * The end of the scale: that of the larger of both variants, where there are two.
 * @param {Grid} grid
 * @param {"lux" | "daylight_factor"} layer
 */
export function sharedScale(grid, layer) {
  const others = [grid, state.kept?.answer.grid].filter((other) => !!other);
  return scale(Math.max(...others.map((other) => largest(values(other, layer).rows))));
}

/** The plan as an editor. @param {boolean} narrow */
export function plan(narrow) {
  const { draft, answer } = state;
  const { room } = draft;
  const at = drag.layout ?? layout(room, narrow);
  const seen = room.plan ? at : { ...at, north: extent(room).depth };
  const grid = answer?.grid ?? null;
  const { box } = at;
  return svg`<svg class="plan" viewBox=${`0 0 ${box[0]} ${box[1]}`} role="application"
    aria-label=${`Plan of the room: tubes and ${room.plan ? "corners" : "walls"} are moved by the arrow keys, with Shift in small steps`}
      @pointermove=${drag.move} @pointerup=${drag.end} @pointercancel=${drag.end} @pointerleave=${() => set({ cursor: null })}>
    <g class=${state.current ? "" : "old"}
      @pointermove=${(/** @type {PointerEvent} */ event) => grid?.x_m.length && moveCursor(event, grid, seen)}>
      ${outlined(room, seen, "floor")}
      ${grid?.x_m.length ? map(grid, seen) : nothing}
    </g>
    ${(room.partitions ?? []).map((sheet) => partition(sheet, seen))}
    ${(room.objects ?? []).map((object) => (object.kind === "box" ? furniture(object, seen) : nothing))}
    ${walls(room, seen)}
    ${(draft.tubes ?? []).map((tube, index) => opening(tube, index, seen))}
    ${measures(room, seen)}
    ${north(room.rotation_deg ?? 0)}
  </svg>`;
}

/** @param {Grid} grid @param {import("./map.js").Layout} at */
function map(grid, at) {
  const { rows, unit } = values(grid, state.layer);
  const { end, ticks } = sharedScale(grid, state.layer);
  const { room } = /** @type {JobDocument} */ (state.answer?.job.document);
  const tubes = (state.draft.tubes ?? []).map((tube) => tube.centre_m);
  const { east, north, depth } = extent(state.draft.room);
  const [column, row] = state.cursor ?? [-1, -1];
  const [x, y] = [grid.x_m[column], grid.y_m[row]];
  return [
    lux(grid, rows, at, end),
    isolines(grid, rows, at, room, tubes),
    // the answer may be that of a draft before
    outside(room, grid, at),
    outside(state.draft.room, grid, at),
    x !== undefined && y !== undefined
      ? svg`<circle class="spot" cx=${across(at, x)} cy=${down(at, y)} r="4"></circle>`
      : nothing,
    bar(end, ticks, unit, across(at, east) + 18, down(at, north), at.k * depth),
  ];
}

/** @param {Extract<Schemas["ObjectDocument"], { kind: "box" }>} object @param {import("./map.js").Layout} at */
function furniture(object, at) {
  const [x, y] = [across(at, object.position_m[0] ?? 0), down(at, object.position_m[1] ?? 0)];
  const [width, depth] = [at.k * (object.size_m[0] ?? 0), at.k * (object.size_m[1] ?? 0)];
  return svg`<rect class="object" x=${x - width / 2} y=${y - depth / 2} width=${width} height=${depth}
    transform=${`rotate(${object.rotation_deg ?? 0} ${x} ${y})`}></rect>`;
}

/** @param {Schemas["PartitionDocument"]} partition @param {import("./map.js").Layout} at */
const partition = ({ from_m: [x1, y1], to_m: [x2, y2] }, at) =>
  svg`<line class="partition" x1=${across(at, x1)} y1=${down(at, y1)} x2=${across(at, x2)} y2=${down(at, y2)}></line>`;

/** @param {Tube} tube @param {number} index @param {import("./map.js").Layout} at */
function opening(tube, index, at) {
  const [x, y] = [across(at, tube.centre_m[0]), down(at, tube.centre_m[1])];
  const radius = (at.k * diameter(tube)) / 2;
  return svg`<g class="tube" tabindex="0" role="button"
    aria-label=${`Tube ${index + 1} at ${tube.centre_m[0]} m from the west wall, ${tube.centre_m[1]} m from the south wall`}
      @touchstart=${still} @pointerdown=${(/** @type {PointerEvent} */ event) => drag.tube(event, index, at)}
        @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { tube: index })}>
      ${isMesh(tube) ? nothing : axis(tube, at)}
      <circle class="hold" cx=${x} cy=${y} r=${Math.max(radius, 16)}></circle>
      <circle class="ring" cx=${x} cy=${y} r=${radius}></circle>
      ${radius > 9 ? svg`<text x=${x} y=${y + 4}>${index + 1}</text>` : nothing}</g>`;
}

/** Where a bent tube goes, seen from above. @param {ParametricTube} tube @param {import("./map.js").Layout} at */
function axis(tube, at) {
  let [x, y] = tube.centre_m;
  const points = [`${across(at, x)},${down(at, y)}`];
  for (const { length_m, tilt_deg = 0, azimuth_deg = 0 } of tube.segments) {
    const lean = length_m * Math.sin((tilt_deg * Math.PI) / 180);
    x += lean * Math.sin((azimuth_deg * Math.PI) / 180);
    y += lean * Math.cos((azimuth_deg * Math.PI) / 180);
    points.push(`${across(at, x)},${down(at, y)}`);
  }
  return tube.segments.some(({ tilt_deg }) => tilt_deg)
    ? svg`<polyline class="axis" points=${points.join(" ")}></polyline>`
    : nothing;
}

/** An arrow to the north. @param {number} turned azimuth of the room's y axis */
export const north = (turned) =>
  svg`<g class="north" transform="translate(20 18)" role="img" aria-label=${`North; the room is turned by ${turned} degrees`}><g
    transform=${`rotate(${-turned})`}><path d="M0 -13 L5 5 L0 2 L-5 5 Z"></path></g><text x="0" y="20">N</text></g>`;
