// The form of a room: its shape and its ceiling; of a plan, the corner that is chosen.
import { resize } from "./draft.js";
import { addCorner, removeCorner, setCeiling, setLength, setRise, setShape, shape, stretch } from "./draft_plan.js";
import { choice, number } from "./field.js";
import { edit } from "./live.js";
import { nameAfter } from "./names.js";
import { lengthOf } from "./outline.js";
import { alongside, extent, outline } from "./room.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @typedef {JobDocument["room"]} Room */

/** A number of metres. @param {string} pointer @param {string} label @param {number} value @param {(to: number) => void} set */
const metres = (pointer, label, value, set) => number({ pointer, label, unit: "m", value, step: 0.05, set });

/** Shape, size and ceiling of the room. */
export function shapes() {
  const { room } = state.draft;
  const { width, depth } = extent(room);
  const level = room.ceiling?.kind ?? "flat";
  const size = (/** @type {0 | 1} */ axis) => (/** @type {number} */ to) =>
    edit((next) => (next.room.plan ? stretch(next, axis, to) : resize(next, axis, to)));
  return html`
    <div class="pair">
      ${choice({
        pointer: "/room/plan/outline_m",
        label: "Shape",
        value: shape(room),
        options: [
          ["rectangle", "rectangle"],
          ["L", "L"],
          ["U", "U"],
          ["T", "T"],
          ["free", "free form"],
        ],
        set: (to) => (edit((next) => (setShape(next, to), nameAfter(next, to))), set({ corner: null })),
      })}
      ${choice({
        pointer: "/room/ceiling/kind",
        label: "Ceiling shape",
        value: level,
        options: [
          ["flat", "flat"],
          ["sloped", "sloped"],
          ["gable", "gable"],
        ],
        set: (to) => {
          edit((next) => setCeiling(next, to));
          if (to !== "flat") set({ look: alongside(state.draft.room) });
        },
      })}
    </div>
    <div class="triple">
      ${metres(room.plan ? "/room/plan/width" : "/room/size_m/0", "Width", width, size(0))}
      ${metres(room.plan ? "/room/plan/depth" : "/room/size_m/1", "Depth", depth, size(1))}
      ${level === "flat" ? height(room) : nothing}
    </div>
    ${slope(room)}${room.plan ? corner(room) : nothing}`;
}

/** Height of a level ceiling. @param {Room} room */
function height({ size_m, ceiling }) {
  if (ceiling?.kind !== "flat")
    return metres("/room/size_m/2", "Height", size_m?.[2] ?? 0, (to) => edit(({ room }) => room.size_m && (room.size_m[2] = to)));
  return metres("/room/ceiling/height_m", "Height", ceiling.height_m, (to) => edit(({ room }) => Object.assign(room.ceiling ?? {}, { height_m: to })));
}

/** Numbers of a ceiling that is not level. @param {Room} room */
function slope({ ceiling }) {
  if (!ceiling || ceiling.kind === "flat") return nothing;
  const put = (/** @type {Partial<typeof ceiling>} */ to) => edit(({ room }) => Object.assign(room.ceiling ?? {}, to));
  const degrees = (/** @type {string} */ name, /** @type {string} */ label, /** @type {number} */ value, /** @type {(to: number) => void} */ set) =>
    number({ pointer: `/room/ceiling/${name}`, label, unit: "°", value, step: 5, set });
  if (ceiling.kind === "gable")
    return html`<div class="triple">
      ${metres("/room/ceiling/eaves_m", "Eaves", ceiling.eaves_m, (to) => put({ eaves_m: to }))}
      ${metres("/room/ceiling/ridge_m", "Ridge", ceiling.ridge_m, (to) => put({ ridge_m: to }))}
      ${degrees("ridge_azimuth_deg", "Ridge toward", ceiling.ridge_azimuth_deg, (to) => put({ ridge_azimuth_deg: to }))}</div>`;
  const [x, y, z] = ceiling.point_m;
  return html`<div class="triple">
    ${metres("/room/ceiling/point_m", `Height at ${x}, ${y}`, z, (to) => put({ point_m: [x, y, to] }))}
    ${degrees("rise_toward_deg", "Rises toward", ceiling.rise_toward_deg, (to) => edit((next) => setRise(next, to)))}
    ${degrees("pitch_deg", "Pitch", ceiling.pitch_deg, (to) => put({ pitch_deg: to }))}</div>`;
}

/** The corner that is chosen, and the walls beside it. @param {Room} room */
function corner(room) {
  const corners = outline(room);
  const chosen = state.corner;
  const place = chosen === null ? undefined : corners[chosen];
  if (chosen === null || !place)
    return html`<p class="note">Choose a corner on the plan to move it by numbers. A double click on a wall adds one.</p>`;
  const before = (chosen + corners.length - 1) % corners.length;
  const move = (/** @type {0 | 1} */ axis) => (/** @type {number} */ to) =>
    edit(({ room }) => room.plan && (room.plan.outline_m[chosen] = axis === 0 ? [to, place[1]] : [place[0], to]));
  const wall = (/** @type {number} */ edge, /** @type {string} */ label) =>
    metres(`/room/plan/wall_${edge}`, label, Math.round(1e4 * lengthOf(corners, edge)) / 1e4, (to) => edit((next) => setLength(next, edge, to)));
  const next = corners[(chosen + 1) % corners.length] ?? place;
  const add = () => {
    edit((draft) => addCorner(draft, chosen, [(place[0] + next[0]) / 2, (place[1] + next[1]) / 2]));
    set({ corner: chosen + 1 });
  };
  return html`<h3>Corner ${chosen + 1} of ${corners.length}</h3>
    <div class="pair">
      ${metres(`/room/plan/outline_m/${chosen}/0`, "Corner x", place[0], move(0))}
      ${metres(`/room/plan/outline_m/${chosen}/1`, "Corner y", place[1], move(1))}
      ${wall(before, "Wall before it")}${wall(chosen, "Wall after it")}
    </div>
    <div class="group"><button type="button" @click=${add}>Add a corner after it</button><button type="button"
      ?disabled=${corners.length < 4} @click=${() => edit((draft) => removeCorner(draft, chosen))}>Remove it</button></div>`;
}
