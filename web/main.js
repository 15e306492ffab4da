// The page: the editor at /, one job at /jobs/ID.
import { accuracy } from "./accuracy.js";
import * as api from "./api.js";
import { compare, keepAsA } from "./compare.js";
import { otherFaults } from "./field.js";
import { place } from "./form_place.js";
import { room } from "./form_room.js";
import { tubes } from "./form_tubes.js";
import { jobPage } from "./job_page.js";
import { jobs, toggle } from "./jobs.js";
import { edit, live, undo, use } from "./live.js";
import { picture } from "./picture.js";
import { plan } from "./plan.js";
import { preset, presets } from "./presets.js";
import { prediction } from "./prediction.js";
import { reasons } from "./reasons.js";
import { headline, numbers, readOut } from "./results.js";
import { section } from "./section.js";
import { known, remember, share, take, unpacked } from "./share.js";
import { sky } from "./sky.js";
import { drawnBy, set, state } from "./state.js";
import { html, nothing, render } from "./vendor/lit-html.js";
import { followClock } from "./zone.js";

const app = /** @type {HTMLElement} */ (document.querySelector("#app"));
const narrow = matchMedia("(max-width: 700px)");
const stacked = matchMedia("(max-width: 1100px)");
/** The preset that was opened last. @type {{ name: string, draft: JobDocument | null }} */
let opened = { name: "", draft: null };

/** Shows a room with its stored result. @param {string} name */
async function open(name) {
  const { draft, answer } = await preset(name);
  opened = { name, draft };
  known(draft);
  history.replaceState(null, "", location.pathname);
  live.present(draft, answer);
}

/** @param {boolean} edits whether the page edits a room */
function header(edits) {
  const choose = (/** @type {Event} */ event) => {
    const { value } = /** @type {HTMLSelectElement} */ (event.target);
    if (value) void open(value);
  };
  const chosen = opened.draft === state.draft ? opened.name : "";
  const options = presets.map(([name, words]) => html`<option value=${name} .selected=${name === chosen}>${words}</option>`);
  const rooms = html`<label class="inline">Room
    <select id="preset" @change=${choose}><option value="" .selected=${!chosen}>your own</option>${options}</select></label>`;
  const sharing = html`<button type="button" @click=${() => void share()}>Share</button>`;
  const toPlan = () => /** @type {SVGElement | null} */ (app.querySelector(".plan .tube, .plan .wall, .plan .corner"))?.focus();
  const skip = html`<button type="button" class="skip" @click=${toPlan}>To the plan</button>`;
  return html`<header>${edits ? skip : nothing}<h1><a href="/">skyduct</a></h1><p>How much daylight do these tubes bring into this room?</p>
    <nav aria-label="Page">${edits ? rooms : nothing}
      <button type="button" aria-expanded=${state.jobs ? "true" : "false"}
        @click=${() => void toggle()}>Jobs</button>${edits ? sharing : nothing}<a href="/docs/">Interface</a></nav></header>`;
}

/** @param {string} title @param {unknown} content @param {boolean} opened */
const drawer = (title, content, opened) =>
  html`<details class="drawer" ?open=${opened}><summary><h2>${title}</h2></summary>${content}</details>`;

function editor() {
  const { answer } = state;
  const factor = Boolean(answer?.grid?.daylight_factor_percent);
  const layer = (/** @type {"lux" | "daylight_factor"} */ of, /** @type {string} */ words) =>
    html`<button type="button" aria-pressed=${state.layer === of} ?disabled=${of !== "lux" && !factor}
      title=${of !== "lux" && !factor ? "Under an overcast sky only" : ""} @click=${() => set({ layer: of })}>${words}</button>`;
  const inParts = Boolean(state.draft?.grids?.[0]?.components);
  const toParts = () =>
    edit((draft) => {
      const grid = draft.grids?.[0];
      if (grid) grid.components = !inParts;
    });
  const open = !stacked.matches;
  const form = html`<form class="panel form" aria-label="The room and its tubes"
    @submit=${(/** @type {Event} */ event) => event.preventDefault()}>
    ${drawer("Place and time", place(), open)}${drawer("Sky", sky(), open)}${drawer("Room", room(), open)}${drawer("Tubes", tubes(), open)}</form>`;
  return html`${header(true)}<main>${jobs()}
    <div class="column left">${form}</div>
    <div class="column middle">
      <section class="panel map" aria-label="Plan"><div class="head"><h2>Plan</h2><div
        class="group">${layer("lux", "Lux")}${layer("daylight_factor", "Daylight factor")}</div><button type="button"
        id="parts" aria-pressed=${inParts} title="Where the light comes from: each tube and each source by itself" @click=${toParts}>By tube</button><button type="button"
        ?disabled=${!state.past.length} @click=${undo} title="Ctrl+Z">Undo</button><button type="button"
        ?disabled=${!answer || !state.current} @click=${keepAsA}>Keep as A</button></div>
        ${otherFaults(form)}${plan(narrow.matches)}${readOut()}</section>
      ${compare()}
      <section class="panel cut" aria-label="Section">${section()}</section>
      <section class="panel view" aria-label="Picture">${picture()}</section>
    </div>
    <div class="column right">
      <section class="panel result" aria-label="Result"><div
        class=${state.current ? "" : "old"}>${answer ? html`${headline(answer)}${numbers(answer)}` : html`<p class="note">Computing …</p>`}</div></section>
      <section class="panel accurate" aria-label="Accuracy">${accuracy()}${prediction()}</section>
      <section class="panel why" aria-label="Reasons">${answer ? reasons(answer.job) : nothing}</section>
      <section class="panel take" aria-label="Files">${take()}</section>
    </div></main><p class="unseen" role="status">${heard()}</p>
    <p class="said" role="status">${state.said}</p>`;
}

/** What people who do not see the page hear of a result, once it rests. */
function heard() {
  const { answer, current, running } = state;
  return answer?.grid && current && !running ? `${answer.grid.statistics.mean_lux.toPrecision(3)} lux in the mean` : "";
}

/** @type {ReturnType<typeof setTimeout> | undefined} */
let soon;

async function start() {
  const id = /^\/jobs\/([0-9a-f-]{36})$/.exec(location.pathname)?.[1];
  if (id) return jobPage(id, app, () => header(false));
  drawnBy(() => {
    void followClock();
    render(editor(), app);
    clearTimeout(soon);
    soon = setTimeout(() => void remember(), 400);
  });
  narrow.addEventListener("change", () => set());
  addEventListener("keydown", (event) => {
    const types = event.target instanceof HTMLInputElement && !["range", "radio", "checkbox"].includes(event.target.type);
    if (event.key !== "z" || !(event.ctrlKey || event.metaKey) || event.shiftKey || types) return;
    event.preventDefault();
    undo();
  });
  addEventListener("hashchange", () => void unpacked(location.hash).then((draft) => draft && (known(draft), use(draft))));
  const linked = location.hash;
  const shared = await unpacked(linked);
  const listed = Promise.all([api.get("/v1/skies"), api.get("/web/cities.json")]).then(([{ skies }, cities]) => set({ skies, cities }));
  if (shared) {
    known(shared);
    use(shared);
  } else await open("bathroom").catch((error) => set({ problem: api.problemOf(error) }));
  if (linked && !shared) set({ said: "The link holds no document that can be read." });
  await listed;
}

void start();
