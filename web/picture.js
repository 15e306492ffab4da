// The picture of the room as it clears up.
import * as api from "./api.js";
import { percent } from "./accuracy.js";
import { roomiest } from "./draft.js";
import { clearance } from "./outline.js";
import { ceilingAt, extent, rings } from "./room.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/**
 * @typedef {{ draft: JobDocument, id: string | null, shown: string | null, passes: number, error: number | null, ended: boolean,
 *   style: Style, abort: AbortController }} Picture
 */

/** How luminances are shown. @typedef {"tone" | "false_colour"} Style */

/** Where the camera stands, by what people would say. */
const CAMERAS = /** @type {const} */ ({ corner: "from a corner", door: "from the south wall", above: "from above" });
/** @type {keyof typeof CAMERAS} */
let camera = "corner";

/** Distance of a camera from the walls of a plan. */
const FROM_WALL_M = 0.15;

/** A view of a room above a plan: from where its middle is seen from the corner or the door, or from above the middle. @param {JobDocument["room"]} room @returns {View} */
function viewOfPlan(room) {
  const { west, south, east } = extent(room);
  const [x, y] = roomiest(room, []);
  const walls = rings(room);
  const common = { name: "room", size_px: /** @type {[number, number]} */ ([480, 360]) };
  const over = 0.98 * ceilingAt(room, [x, y]);
  if (camera === "above") return { ...common, eye_m: [x, y, over], look_at_m: [x, y, 0], up: [0, 1, 0], vertical_fov_deg: 110 };
  const from = camera === "door" ? (west + east) / 2 : east;
  /** @param {number} share of the way to the middle @returns {[number, number]} */
  const on = (share) => [from + share * (x - from), south + share * (y - south)];
  const share = Array.from({ length: 100 }, (_, i) => i / 100).find((share) => clearance(walls, on(share)) >= FROM_WALL_M) ?? 0.9;
  const eye = on(share);
  const height = ceilingAt(room, eye);
  return { ...common, eye_m: [...eye, Math.min(1.6, 0.8 * height)], look_at_m: [x, y, 0.4 * height], vertical_fov_deg: 75 };
}

/** @param {JobDocument["room"]} room @returns {View} */
function view(room) {
  if (room.plan) return viewOfPlan(room);
  const { width, depth, height } = extent(room);
  const eye = Math.min(1.6, 0.8 * height);
  const common = { name: "room", size_px: /** @type {[number, number]} */ ([480, 360]) };
  if (camera === "above")
    return {
      ...common,
      eye_m: [width / 2, depth / 2, 0.98 * height],
      look_at_m: [width / 2, depth / 2, 0],
      up: [0, 1, 0],
      vertical_fov_deg: 110,
    };
  if (camera === "door")
    return {
      ...common,
      eye_m: [width / 2, 0.05 * depth, eye],
      look_at_m: [width / 2, depth, 0.5 * height],
      vertical_fov_deg: 75,
    };
  return {
    ...common,
    eye_m: [0.95 * width, 0.05 * depth, eye],
    look_at_m: [0.3 * width, 0.75 * depth, 0.4 * height],
    vertical_fov_deg: 70,
  };
}

async function start() {
  stop();
  const abort = new AbortController();
  const draft = {
    ...state.draft,
    grids: [],
    views: [view(state.draft.room)],
    stop: { view_relative_error: 0.03, max_seconds: 60 },
  };
  /** @type {Picture} */
  const picture = { draft: state.draft, id: null, shown: null, passes: 0, error: null, ended: false, style: "tone", abort };
  const change = (/** @type {Partial<Picture>} */ to) => {
    Object.assign(picture, to);
    if (state.picture === picture) set({ picture });
  };
  set({ picture });
  try {
    const { id } = await api.postJob(draft);
    change({ id });
    await api.follow(
      id,
      (name, data) => {
        if (name === "image") change({ shown: data.url });
        if (name === "pass") change({ passes: data.passes, error: data.view_relative_error });
      },
      abort.signal,
    );
    change({ shown: `/v1/jobs/${id}/views/room.png`, ended: true });
  } catch (error) {
    if (abort.signal.aborted) return;
    const problem = api.problemOf(error);
    // the button stands far from where the problem is told
    set({ picture: null, problem, said: `No picture: ${(problem.errors?.[0] ?? problem).detail}` });
  }
}

/** Stops the picture; what is there stays. */
function stop() {
  const { picture } = state;
  if (picture?.id && !picture.ended) void api.cancelJob(picture.id);
}

/** @param {string} address */
const image = (address) => html`<img src=${address} width="480" height="360" alt="The room as the camera sees it">`;

/** @param {string} files address of the picture's files, without a suffix */
const falseColours = (files) =>
  html`<img src=${`${files}.png?style=false_colour`} alt="Luminances of the room as the camera sees it, in colours with a scale">`;

/** The picture, or what is there of it. @param {Picture} picture @param {string} files */
function canvas({ shown, ended, style }, files) {
  if (!shown) return html`<p class="note">The first pass is on its way …</p>`;
  return ended && style === "false_colour" ? falseColours(files) : image(shown);
}

/** What can be done with a picture that is done. @param {Picture} picture @param {string} files */
function done(picture, files) {
  const style = (/** @type {Style} */ to, /** @type {string} */ words) => html`<button type="button"
    aria-pressed=${picture.style === to} @click=${() => set({ picture: Object.assign(picture, { style: to }) })}>${words}</button>`;
  return html`<div class="group">${style("tone", "As seen")}${style("false_colour", "Luminances")}</div>
    <p class="links"><a href=${`${files}.exr`} download>EXR</a><a href=${`${files}.png`} download>PNG</a>
      <a href=${`/jobs/${picture.id}`}>page of this job</a></p>`;
}

/** The part of the page with the picture. */
export function picture() {
  const { picture, draft } = state;
  const choose = (/** @type {Event} */ event) =>
    (camera = /** @type {keyof typeof CAMERAS} */ (/** @type {HTMLSelectElement} */ (event.target).value));
  const cameras = Object.entries(CAMERAS).map(
    ([key, words]) => html`<option value=${key} ?selected=${key === camera}>${words}</option>`,
  );
  const head = html`<div class="head"><h2>Picture</h2><label class="inline">Camera <select @change=${choose}>${cameras}</select></label>
    <button type="button" @click=${() => void start()}>Render the picture</button>
    ${picture && !picture.ended ? html`<button type="button" @click=${stop}>Stop</button>` : nothing}</div>`;
  if (!picture) return head;
  const files = `/v1/jobs/${picture.id}/views/room`;
  return html`${head}<div class="canvas">${canvas(picture, files)}</div>
    <p class="note">${picture.passes} ${picture.passes === 1 ? "pass" : "passes"}${picture.error ? `, error ${percent(picture.error)}` : ""}
      ${picture.draft === draft ? "" : " (the room before the last change)"}</p>
    ${picture.ended ? done(picture, files) : nothing}`;
}
