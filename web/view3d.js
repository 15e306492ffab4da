// The folded part of the page with the room in three dimensions, whose drawing is loaded when it is opened.
import { edit } from "./live.js";
import { shown } from "./plan.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** The canvas of the open view, and what draws on it once that is loaded. @type {{ canvas: HTMLCanvasElement | null, view: ReturnType<typeof import("./view3d_canvas.js").view> }} */
const open = { canvas: null, view: null };
/** True where the browser cannot draw it. */
let fails = false;

/** @param {HTMLCanvasElement} canvas */
async function load(canvas) {
  const { view } = await import("./view3d_canvas.js");
  // closed meanwhile
  if (open.canvas !== canvas) return;
  open.view = view(canvas);
  fails = !open.view;
  set();
}

/** Draws what the page shows while the view is open; gives back what it took once it is closed. @param {HTMLElement} app */
export function follow(app) {
  const canvas = /** @type {HTMLCanvasElement | null} */ (app.querySelector(".space[open] canvas"));
  if (canvas !== open.canvas) {
    open.view?.dispose();
    // a canvas whose view was given back draws no more
    if (open.canvas?.isConnected) open.canvas.replaceWith(open.canvas.cloneNode());
    Object.assign(open, { canvas, view: null });
    if (canvas) void load(canvas);
  }
  const { draft, problem, answered, answer } = state;
  const sun = answer?.job.provenance?.sun;
  const [azimuth_deg, altitude_deg] = [Number(sun?.azimuth_deg), Number(sun?.altitude_deg)];
  open.view?.show({
    draft: problem?.errors?.length ? answered : draft,
    sun: sun?.on && altitude_deg > 0 ? { azimuth_deg, altitude_deg } : null,
    map: shown(),
  });
}

/** The part of the page with the view. */
export function view3d() {
  const { draft } = state;
  const models = [...(draft.room.objects ?? []), ...(draft.tubes ?? [])].filter((one) => "mesh" in one).length;
  const move = (/** @type {(camera: typeof import("./view3d_camera.js")) => Parameters<NonNullable<typeof open.view>["move"]>[0]} */ by) => async () =>
    open.view?.move(by(await import("./view3d_camera.js")));
  const button = (/** @type {string} */ words, /** @type {() => void} */ click, /** @type {string} */ title) =>
    html`<button type="button" title=${title} aria-label=${title} @click=${click}>${words}</button>`;
  const faces = (/** @type {Event} */ { target }) =>
    edit((next) => {
      if (/** @type {HTMLInputElement} */ (target).checked) next.surfaces = true;
      else delete next.surfaces;
    });
  const scene = state.current && !state.answer?.stored ? state.answer?.job.links.scene : null;
  return html`<details class="panel space" @toggle=${() => set()}><summary><h2>In three dimensions</h2></summary>
    <div class="head"><div class="group">${button("Corner", move(({ STARTS }) => () => STARTS.corner), "From a corner")}${button("Above", move(({ STARTS }) => () => STARTS.above), "From above")}</div>
      <div class="group">${button("+", move(({ zoomed }) => (orbit) => zoomed(orbit, 1.3)), "Nearer")}${button("−", move(({ zoomed }) => (orbit) => zoomed(orbit, 1 / 1.3)), "Farther")}</div>
      <label class="check"><input type="checkbox" .checked=${draft.surfaces ?? false} @change=${faces}>Light on all faces, too (scene.glb)</label>
      ${scene ? html`<a href=${scene} download="scene.glb">scene.glb</a>` : nothing}</div>
    ${fails ? html`<p class="note">This browser has no WebGL 2, which draws this view.</p>` : nothing}
    <canvas tabindex="0" role="application" aria-label="The room in three dimensions: arrow keys turn it, plus and minus zoom, Home goes back"></canvas>
    <p class="note">Drag it or press arrow keys to turn it; pinch, or turn the wheel after a click, to zoom. The work plane has the colours of the plan.
      ${models ? `${models === 1 ? "A model is" : `${models} models are`} not drawn.` : ""}</p></details>`;
}
