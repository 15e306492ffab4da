// The folded part of the page with the room in three dimensions, whose drawing is loaded when it is opened.
import { meshes, surfaces } from "./job_files.js";
import { edit, live } from "./live.js";
import { shown, yearOnPlan } from "./plan.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** The canvas of the open view, and what draws on it once that is loaded. @type {{ canvas: HTMLCanvasElement | null, view: ReturnType<typeof import("./view3d_canvas.js").view> }} */
const open = { canvas: null, view: null };
/** Why there is no view where it should be; empty where there is one. */
let fails = "";
/** A context that is lost so soon after it was made would be lost again. */
const SOON_MS = 2000;

/** @param {HTMLCanvasElement} canvas */
async function load(canvas) {
  const start = performance.now();
  fails = "";
  // by the browser: a canvas that was given back is not the open one any more
  canvas.addEventListener("webglcontextlost", () => {
    if (open.canvas !== canvas) return;
    if (performance.now() - start < SOON_MS) fails = "The browser took the graphics memory of this view: close it and open it again.";
    else renew(canvas);
    set();
  });
  try {
    const { view } = await import("./view3d_canvas.js");
    // closed meanwhile
    if (open.canvas !== canvas) return;
    open.view = view(canvas);
    if (!open.view) fails = "This browser has no WebGL 2, which draws this view.";
  } catch (error) {
    console.warn(error);
    if (open.canvas === canvas) fails = "This view could not be loaded: load the page again to have it.";
  }
  set();
}

/** Puts a new canvas in the place of one that draws no more. @param {HTMLCanvasElement} canvas */
function renew(canvas) {
  const next = /** @type {HTMLCanvasElement} */ (canvas.cloneNode());
  const isChosen = document.activeElement === canvas;
  canvas.replaceWith(next);
  if (isChosen) next.focus({ preventScroll: true });
}

/** Draws what the page shows while the view is open; gives back what it took once it is closed. @param {HTMLElement} app */
export function follow(app) {
  const canvas = /** @type {HTMLCanvasElement | null} */ (app.querySelector(".space[open] canvas"));
  if (canvas !== open.canvas) {
    open.view?.dispose();
    // a canvas whose view was given back draws no more
    if (open.canvas?.isConnected) renew(open.canvas);
    Object.assign(open, { canvas, view: null });
    if (canvas) void load(canvas);
  }
  const { problem, answered, answer, layer } = state;
  const sun = answer?.job.provenance?.sun;
  const [azimuth_deg, altitude_deg] = [Number(sun?.azimuth_deg), Number(sun?.altitude_deg)];
  if (!open.view) return;
  const of = problem?.errors?.length ? answered : state.draft;
  const lit = surfaces(of);
  open.view.show({
    draft: of,
    // in the scale of the plan, where that has lux
    faces: layer === "lux" && !yearOnPlan() ? lit : null,
    meshes: meshes(of),
    sun: sun?.on && altitude_deg > 0 ? { azimuth_deg, altitude_deg } : null,
    map: shown(),
  });
}

/** A length with two digits. @param {number} value in m */
const metres = (value) => Number(value.toPrecision(2));

/** The part of the page with the view. */
export function view3d() {
  const { draft } = state;
  const cell = meshes(draft)?.cell_m;
  const move = (/** @type {(camera: typeof import("./view3d_camera.js")) => Parameters<NonNullable<typeof open.view>["move"]>[0]} */ by) => async () =>
    open.view?.move(by(await import("./view3d_camera.js")));
  const button = (/** @type {string} */ words, /** @type {() => void} */ click, /** @type {string} */ title) =>
    html`<button type="button" title=${title} aria-label=${title} @click=${click}>${words}</button>`;
  const onFaces = (/** @type {Event} */ { target }) =>
    edit((next) => {
      if (/** @type {HTMLInputElement} */ (target).checked) next.surfaces = true;
      else delete next.surfaces;
    });
  const scene = state.current && !state.answer?.stored ? state.answer?.job.links.scene : null;
  // a job whose file is taken stays
  const keeping = () => live.keep();
  return html`<details class="panel space" @toggle=${() => set()}><summary><h2>In three dimensions</h2></summary>
    <div class="head"><div class="group">${button("Corner", move(({ STARTS }) => () => STARTS.corner), "From a corner")}${button("Above", move(({ STARTS }) => () => STARTS.above), "From above")}</div>
      <div class="group">${button("+", move(({ zoomed }) => (orbit) => zoomed(orbit, 1.3)), "Nearer")}${button("−", move(({ zoomed }) => (orbit) => zoomed(orbit, 1 / 1.3)), "Farther")}</div>
      <label class="check"><input type="checkbox" .checked=${draft.surfaces ?? false} @change=${onFaces}>Light on all faces, too (scene.glb)</label>
      ${scene ? html`<a href=${scene} download="scene.glb" @click=${keeping} @auxclick=${keeping} @contextmenu=${keeping}>scene.glb</a>` : nothing}</div>
    ${fails ? html`<p class="note" role="status">${fails}</p>` : nothing}
    <canvas tabindex="0" role="application" aria-label="The room in three dimensions: arrow keys turn it, plus and minus zoom, Home goes back"></canvas>
    <p class="note">Drag it or press arrow keys to turn it; pinch to zoom. After a click or a tap the wheel zooms, and a finger turns it up and
      down, too. ${draft.surfaces ? "Work plane and faces have" : "The work plane has"} the colours of the plan.
      ${cell ? `Models are drawn without details below ${metres(cell)} m.` : ""}</p></details>`;
}
