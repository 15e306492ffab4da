// The form of obstructions outdoors: boxes such as a chimney or the house next door, and how bright what is below the horizon looks.
import { number } from "./field.js";
import { edit } from "./live.js";
import { ceilings, extent } from "./room.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @typedef {Extract<Schemas["ObstructionDocument"], { kind: "box" }>} Box */

/** Luminance of what hides the sky, over that of the sky, where a document does not say. */
const USUAL_RATIO = 0.1;
/** Plan of a chimney to begin with, its height above the highest ceiling, and its distance from the room. */
const CHIMNEY = { plan_m: 0.8, above_m: 2.5, away_m: 2 };

/** Number of the obstruction whose numbers are shown. @type {number | null} */
let chosen = null;

/** Adds a chimney south of the room, from the level of the floor to above the highest ceiling. */
function add() {
  const { west, south, width } = extent(state.draft.room);
  const top = Math.max(...ceilings(state.draft.room).flat(2).map(([, , z]) => z));
  const { plan_m, above_m, away_m } = CHIMNEY;
  const size_m = /** @type {[number, number, number]} */ ([plan_m, plan_m, Math.round(100 * (top + above_m)) / 100]);
  edit((draft) => {
    const of = ((draft.surroundings ??= {}).obstructions ??= []);
    of.push({ kind: "box", size_m, position_m: [west + width / 2, south - away_m, 0], rotation_deg: 0 });
    chosen = of.length - 1;
  });
}

/** @param {number} index */
function remove(index) {
  chosen = null;
  edit((draft) => {
    draft.surroundings?.obstructions?.splice(index, 1);
    if (draft.surroundings?.obstructions?.length === 0) delete draft.surroundings.obstructions;
    if (draft.surroundings && !Object.keys(draft.surroundings).length) delete draft.surroundings;
  });
}

/** Boxes outdoors: which one, and its numbers. */
export function obstructions() {
  const of = state.draft.surroundings?.obstructions ?? [];
  const at = chosen !== null && chosen < of.length ? chosen : null;
  const choose = (/** @type {number} */ index) => {
    chosen = index === chosen ? null : index;
    set();
  };
  const tabs = of.map((_, index) => html`<button type="button" aria-label=${`Obstruction ${index + 1}`} aria-pressed=${index === at}
    @click=${() => choose(index)}>${index + 1}</button>`);
  const box = at === null ? undefined : of[at];
  return html`<h3>Obstructions</h3><div class="group tabs" role="group" aria-label="Obstructions">${tabs}<button type="button"
      title="A box that hides the sky, such as a chimney or a house" @click=${add}>Add a box</button></div>
    ${box && at !== null ? numbers(box, at) : nothing}${of.length || state.draft.surroundings?.horizon || state.draft.surroundings?.horizon_pvgis ? brightness() : nothing}`;
}

/** @param {Box} box @param {number} index */
function numbers({ size_m, position_m, rotation_deg = 0 }, index) {
  const at = `/surroundings/obstructions/${index}`;
  const change = (/** @type {(box: Box) => void} */ change) =>
    edit(({ surroundings }) => {
      const box = surroundings?.obstructions?.[index];
      if (box) change(box);
    });
  const metres = (/** @type {"size_m" | "position_m"} */ field, /** @type {0 | 1 | 2} */ axis, /** @type {string} */ label, /** @type {number} */ value) =>
    number({ pointer: `${at}/${field}/${axis}`, label, unit: "m", value, step: 0.1, set: (to) => change((box) => (box[field][axis] = to)) });
  return html`<div class="card"><div class="head"><h3>Box ${index + 1}</h3><button type="button"
      aria-label=${`Remove obstruction ${index + 1}`} @click=${() => remove(index)}>Remove</button></div>
    <div class="pair">
      ${metres("position_m", 0, "Middle x", position_m[0])}
      ${metres("position_m", 1, "Middle y", position_m[1])}
      ${metres("position_m", 2, "Base above the floor", position_m[2])}
      ${metres("size_m", 2, "Height of the box", size_m[2])}
      ${metres("size_m", 0, "Width of the box", size_m[0])}
      ${metres("size_m", 1, "Depth of the box", size_m[1])}
      ${number({ pointer: `${at}/rotation_deg`, label: "Turned clockwise", unit: "°", value: rotation_deg, step: 5, set: (to) => change((box) => (box.rotation_deg = to)) })}
    </div></div>`;
}

/** How bright what hides the sky looks. */
const brightness = () =>
  number({
    pointer: "/surroundings/luminance_ratio",
    label: "What hides the sky, in its luminance",
    value: state.draft.surroundings?.luminance_ratio ?? USUAL_RATIO,
    step: 0.05,
    min: 0,
    max: 1,
    set: (to) =>
      edit((draft) => {
        const next = (draft.surroundings ??= {});
        if (to === USUAL_RATIO) delete next.luminance_ratio;
        else next.luminance_ratio = to;
      }),
  });
