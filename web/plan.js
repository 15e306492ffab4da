// The plan of the room from above: the map, the tubes and the room's walls, which are moved by hand.
import { meshes } from "./job_files.js";
import { bar, across, down, isolines, largest, lux, measures, outlined, outside, reaching, values } from "./map.js";
import { cellAt, drag, draw, keys, moveCursor, still } from "./plan_hand.js";
import { partition } from "./plan_partitions.js";
import { sensor } from "./plan_sensors.js";
import { walls } from "./plan_walls.js";
import { extent } from "./room.js";
import { axis, furniture, layout, marks, north, rim, ring } from "./room_plan.js";
import { scale } from "./scale.js";
import { sensorsOf } from "./sensor.js";
import { set, setYear, state } from "./state.js";
import { nothing, svg } from "./vendor/lit-html.js";
import { mapOf, pin, pinnedAt } from "./year_plan.js";

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
  const { numbers, taken } = marks(room, draft.tubes ?? [], seen);
  return svg`<svg class="plan" viewBox=${`0 0 ${box[0]} ${box[1]}`} role="application"
    aria-label=${`Plan of the room: tubes, ${room.plan ? "corners" : "walls"} and partitions are moved by the arrow keys, with Shift in small steps`}
      @pointermove=${drag.move} @pointerup=${drag.end} @pointercancel=${drag.end} @pointerleave=${() => set({ cursor: null })}>
    <g class=${of?.current === false ? "old" : ""}
      @pointermove=${(/** @type {PointerEvent} */ event) => grid && moveCursor(event, grid, seen)}
      @click=${(/** @type {MouseEvent} */ event) => year && grid && setYear({ pin: cellAt(event, grid, seen) })}>
      ${outlined(room, seen, "floor")}
      ${of && grid ? map(of, seen, taken) : furniture(room, meshes(draft), seen)}
    </g>
    ${walls(room, seen)}
    ${(room.partitions ?? []).map((sheet, index) => partition(sheet, index, seen))}
    ${(draft.tubes ?? []).map((tube, index) => opening(tube, index, seen))}
    ${numbers}
    ${sensorsOf(draft).points.map((one, index) => sensor(one, index, seen))}
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

/** @param {NonNullable<ReturnType<typeof shown>>} of @param {import("./map.js").Layout} at @param {[number, number][]} marks of tubes */
function map({ grid, rows, unit, end, ticks, room }, at, marks) {
  const year = yearOnPlan();
  const sensors = sensorsOf(state.draft).points.map(([x, y]) => /** @type {[number, number]} */ ([x, y]));
  const taken = [...marks, ...sensors, ...(year ? pinnedAt(year) : [])];
  const { east, north, depth } = extent(state.draft.room);
  const [column, row] = state.cursor ?? [-1, -1];
  const [x, y] = [grid.x_m[column], grid.y_m[row]];
  return [
    lux(grid, reaching(grid, rows, room), at, end),
    furniture(state.draft.room, meshes(state.draft), at),
    isolines(grid, rows, at, room, taken, unit, end),
    // the answer may be that of a draft before
    outside(room, grid, at),
    outside(state.draft.room, grid, at),
    x !== undefined && y !== undefined
      ? svg`<circle class="spot" cx=${across(at, x)} cy=${down(at, y)} r="4"></circle>`
      : nothing,
    bar(end, ticks, unit, across(at, east) + 18, down(at, north), at.k * depth),
  ];
}

/** @param {Tube} tube @param {number} index @param {import("./map.js").Layout} at */
function opening(tube, index, at) {
  const { x, y, radius } = ring(tube, at);
  return svg`<g class=${index === state.tube ? "tube chosen" : "tube"} tabindex="0" role="button"
    aria-label=${`Tube ${index + 1} at ${tube.centre_m[0]} m from the west wall, ${tube.centre_m[1]} m from the south wall`}
      @touchstart=${still} @focus=${() => set({ tube: index })} @pointerdown=${(/** @type {PointerEvent} */ event) => drag.tube(event, index, at)}
        @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { tube: index })}>
      ${axis(state.draft.room, tube, at)}
      <circle class="hold" cx=${x} cy=${y} r=${Math.max(radius, 16)}></circle>
      ${rim(state.draft.room, tube, at)}</g>`;
}
