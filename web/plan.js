// The plan of the room from above: the map, the tubes and the room's walls, which are moved by hand.
import { meshes } from "./job_files.js";
import { bar, across, down, isolines, largest, lux, measures, outlined, outside, reaching, values } from "./map.js";
import { objects as models } from "./models.js";
import { cellAt, drag, draw, keys, moveCursor, still } from "./plan_hand.js";
import { numbered } from "./plan_labels.js";
import { partition } from "./plan_partitions.js";
import { walls } from "./plan_walls.js";
import { inPlan, isInFace, opening as openingOf, rim as rimOf } from "./opening.js";
import { joints } from "./ray.js";
import { extent } from "./room.js";
import { scale } from "./scale.js";
import { AROUND } from "./stage.js";
import { set, setYear, state } from "./state.js";
import { diameter, isMesh, square } from "./tube.js";
import { nothing, svg } from "./vendor/lit-html.js";
import { mapOf, pin, pinnedAt } from "./year_plan.js";

/** Sides of a rim that is seen from the side. */
const SIDES = 48;

/** Size of a drawing that stands by itself. @type {[number, number]} */
export const SMALL = [364, 400];

/** @param {JobDocument["room"]} room @param {[number, number]} box size of the drawing @returns {import("./map.js").Layout} */
export function layout(room, box) {
  const { west, north, width, depth } = extent(room);
  const { left, right, top, bottom } = AROUND.plan;
  const [across, down] = [box[0] - left - right, box[1] - top - bottom];
  const k = Math.max(1, Math.min(across / width, down / depth));
  return { k, left: left + (across - k * width) / 2 - k * west, top: top + (down - k * depth) / 2, north, box };
}

/** The layout in a box that is as high as the room needs, at most as high as the given one. @param {JobDocument["room"]} room @param {[number, number]} box */
export function fitted(room, [width, height]) {
  const { k } = layout(room, [width, height]);
  return layout(room, [width, Math.min(height, k * extent(room).depth + AROUND.plan.top + AROUND.plan.bottom)]);
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

/** The year that is shown instead of a moment's light. */
export const yearShown = () => (state.tab === "year" ? state.year.answer : null);

/** The year whose map the plan shows: while a room that was changed has none, the plan has its light at a moment. */
export function yearOnPlan() {
  const year = yearShown();
  const isRoom = year && (state.year.current || JSON.stringify(year.wanted.draft.room) === JSON.stringify(state.draft.room));
  return isRoom ? year : null;
}

/** What the map shows; null before there is an answer. */
export function shown() {
  const { answer, current, layer } = state;
  const year = yearOnPlan();
  if (year) return mapOf(year);
  if (!answer?.grid) return null;
  return { grid: answer.grid, room: answer.job.document.room, current, ...values(answer.grid, layer), ...sharedScale(answer.grid, layer) };
}

/** The plan as an editor. */
export function plan() {
  const { draft } = state;
  const { room } = draft;
  const at = drag.layout ?? layout(room, state.sizes.plan);
  const seen = room.plan ? at : { ...at, north: extent(room).depth };
  const [of, year] = [shown(), yearOnPlan()];
  const grid = of?.grid.x_m.length ? of.grid : null;
  const { box } = at;
  return svg`<svg class="plan" viewBox=${`0 0 ${box[0]} ${box[1]}`} role="application"
    aria-label=${`Plan of the room: tubes, ${room.plan ? "corners" : "walls"} and partitions are moved by the arrow keys, with Shift in small steps`}
      @pointermove=${drag.move} @pointerup=${drag.end} @pointercancel=${drag.end} @pointerleave=${() => set({ cursor: null })}>
    <g class=${of?.current === false ? "old" : ""}
      @pointermove=${(/** @type {PointerEvent} */ event) => grid && moveCursor(event, grid, seen)}
      @click=${(/** @type {MouseEvent} */ event) => year && grid && setYear({ pin: cellAt(event, grid, seen) })}>
      ${outlined(room, seen, "floor")}
      ${of && grid ? map(of, seen) : nothing}
    </g>
    ${(room.objects ?? []).map((object) => (object.kind === "box" ? furniture(object, seen) : nothing))}
    ${models(meshes(draft), [0, 1], { x: across(seen, 0), y: down(seen, 0), k: seen.k })}
    ${walls(room, seen)}
    ${(room.partitions ?? []).map((sheet, index) => partition(sheet, index, seen))}
    ${(draft.tubes ?? []).map((tube, index) => opening(tube, index, seen))}
    ${numbered((draft.tubes ?? []).map((tube) => ring(tube, seen)))}
    ${year && grid ? pin(year, seen) : nothing}
    ${measures(room, seen)}
    ${north(room.rotation_deg ?? 0)}
    ${
      state.draws
        ? svg`<rect class="sheet" width=${box[0]} height=${box[1]} @touchstart=${still}
      @pointerdown=${(/** @type {PointerEvent} */ event) => draw(event, seen)}></rect>`
        : nothing
    }
  </svg>`;
}

/** The ring of a tube. @param {Tube} tube @param {import("./map.js").Layout} at */
const ring = (tube, at) => ({ x: across(at, tube.centre_m[0]), y: down(at, tube.centre_m[1]), radius: (at.k * diameter(tube)) / 2 });

/** @param {NonNullable<ReturnType<typeof shown>>} of @param {import("./map.js").Layout} at */
function map({ grid, rows, unit, end, ticks, room }, at) {
  const year = yearOnPlan();
  const taken = [...(state.draft.tubes ?? []).map(inPlan), ...(year ? pinnedAt(year) : [])];
  const { east, north, depth } = extent(state.draft.room);
  const [column, row] = state.cursor ?? [-1, -1];
  const [x, y] = [grid.x_m[column], grid.y_m[row]];
  return [
    lux(grid, reaching(grid, rows, room), at, end),
    isolines(grid, rows, at, room, taken),
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

/** @param {Tube} tube @param {number} index @param {import("./map.js").Layout} at */
function opening(tube, index, at) {
  const { x, y, radius } = ring(tube, at);
  return svg`<g class=${index === state.tube ? "tube chosen" : "tube"} tabindex="0" role="button"
    aria-label=${`Tube ${index + 1} at ${tube.centre_m[0]} m from the west wall, ${tube.centre_m[1]} m from the south wall`}
      @touchstart=${still} @focus=${() => set({ tube: index })} @pointerdown=${(/** @type {PointerEvent} */ event) => drag.tube(event, index, at)}
        @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { tube: index })}>
      ${isMesh(tube) ? nothing : axis(tube, at)}
      <circle class="hold" cx=${x} cy=${y} r=${Math.max(radius, 16)}></circle>
      ${rim(state.draft.room, tube, at)}</g>`;
}

/** The rim of an opening. @param {JobDocument["room"]} room @param {Tube} tube @param {import("./map.js").Layout} at */
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

/** Where a bent tube goes, seen from above. @param {ParametricTube} tube @param {import("./map.js").Layout} at */
function axis(tube, at) {
  const [x, y] = tube.centre_m;
  const points = joints(tube.segments, openingOf(state.draft.room, tube).outward).map((joint) => `${across(at, x + joint[0])},${down(at, y + joint[1])}`);
  return isInFace(tube) || tube.segments.some(({ tilt_deg }) => tilt_deg)
    ? svg`<polyline class="axis ground" points=${points.join(" ")}></polyline><polyline class="axis" points=${points.join(" ")}></polyline>`
    : nothing;
}

/** An arrow to the north. @param {number} turned azimuth of the room's y axis */
export const north = (turned) =>
  svg`<g class="north" transform="translate(20 18)" role="img" aria-label=${`North; the room is turned by ${turned} degrees`}><g
    transform=${`rotate(${-turned})`}><path d="M0 -13 L5 5 L0 2 L-5 5 Z"></path></g><text x="0" y="20">N</text></g>`;
