// The page: the editor at /, one job at /jobs/ID.
import { accuracy, percent } from "./accuracy.js";
import * as api from "./api.js";
import { listed } from "./cities.js";
import { compare, keepAsA } from "./compare.js";
import { otherFaults } from "./field.js";
import { fit } from "./fit.js";
import { isUsed, outside } from "./form_outside.js";
import { place, suggestions } from "./form_place.js";
import { room } from "./form_room.js";
import { tubes } from "./form_tubes.js";
import { weather } from "./form_year.js";
import { jobPage } from "./job_page.js";
import { closes, jobs, toggle } from "./jobs.js";
import { edit, live, undo, use, year as yearJob } from "./live.js";
import { picture } from "./picture.js";
import { plan, yearOnPlan, yearShown } from "./plan.js";
import { preset, presets } from "./presets.js";
import { prediction } from "./prediction.js";
import { prose } from "./prose.js";
import { reasons } from "./reasons.js";
import { headline, numbers, readOut } from "./results.js";
import { alongside } from "./room.js";
import { section } from "./section.js";
import { forget, known, remember, share, take, unpacked } from "./share.js";
import { sky } from "./sky.js";
import { drawnBy, set, setYear, state } from "./state.js";
import { html, nothing, render } from "./vendor/lit-html.js";
import { judged, sentence, target } from "./verdict.js";
import { follow as followView, view3d } from "./view3d.js";
import { find, takeFile } from "./weather.js";
import { charts, layers, yearByHour } from "./year_panels.js";
import { yearReadOut } from "./year_plan.js";
import { criteria, judgedYear, yearFiles, yearResult } from "./year_result.js";
import { followClock } from "./zone.js";

const app = /** @type {HTMLElement} */ (document.querySelector("#app"));
const stacked = matchMedia("(max-width: 1199px)");
/** The preset that was opened last. @type {{ name: string, draft: JobDocument | null }} */
let opened = { name: "", draft: null };

/** Shows a room with its stored result. @param {string} name */
async function open(name) {
  const { draft, answer } = await preset(name);
  opened = { name, draft };
  known(draft);
  history.replaceState(null, "", location.pathname);
  set({ look: alongside(draft.room) });
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
  const tab = (/** @type {"moment" | "year"} */ of, /** @type {string} */ words) =>
    html`<button type="button" aria-pressed=${state.tab === of} @click=${() => set({ tab: of })}>${words}</button>`;
  const tabs = html`<div class="group" role="group" aria-label="Light of">${tab("moment", "A moment")}${tab("year", "A year")}</div>`;
  const toPlan = () => /** @type {SVGElement | null} */ (app.querySelector(".plan .tube, .plan .wall, .plan .corner"))?.focus();
  const skip = html`<button type="button" class="skip" @click=${toPlan}>To the plan</button>`;
  return html`<header>${edits ? skip : nothing}<h1><a href="/">skyduct</a></h1><p>How much daylight do these tubes bring into this room?</p>
    <nav aria-label="Page">${edits ? [tabs, rooms] : nothing}
      <button type="button" aria-expanded=${state.jobs ? "true" : "false"}
        @click=${() => void toggle()} @keydown=${closes}>Jobs</button>${edits ? sharing : nothing}<a href="/docs/">API</a></nav></header>`;
}

/** @param {string} title @param {unknown} content @param {boolean} opened */
const drawer = (title, content, opened) =>
  html`<details class="drawer" ?open=${opened}><summary><h2>${title}</h2></summary>${content}</details>`;

/** A form of drawers; on narrow pages they are closed, unless they say so themselves. @param {string} label @param {[string, unknown, boolean?][]} drawers */
const form = (label, drawers) => html`<form class="panel form" aria-label=${label}
  @submit=${(/** @type {Event} */ event) => event.preventDefault()}>${drawers.map(([title, content, open = !stacked.matches]) => drawer(title, content, open))}</form>`;

/** Plan, section and numbers; of a year its months and a day. @param {unknown} forms whose fields show their faults themselves */
function drawings(forms) {
  const { answer, current } = state;
  const [year, onPlan] = [yearShown(), yearOnPlan()];
  const beside = () => html`<section class="panel cut" aria-label="Section">${section()}</section>
    <section class=${`panel all-numbers ${current ? "" : "old"}`} aria-label="Numbers" tabindex="0"><h2>Numbers</h2>${answer ? numbers(answer) : nothing}</section>`;
  return html`<div class="stage">
    <section class="panel map" aria-label="Plan"><div class="head"><h2>Plan</h2>${year ? layers(year) : momentLayers()}<button type="button"
      ?disabled=${!state.past.length} @click=${undo} title="Ctrl+Z">Undo</button>${year ? nothing : html`<button type="button"
      ?disabled=${!answer || !current} @click=${keepAsA}>Keep as A</button>`}</div>
      ${otherFaults(forms)}${plan()}${onPlan ? yearReadOut(onPlan) : readOut()}</section>${year ? charts(year) : beside()}</div>`;
}

/** Buttons that choose what the plan shows of a moment. */
function momentLayers() {
  const factor = Boolean(state.answer?.grid?.daylight_factor_percent);
  const layer = (/** @type {"lux" | "daylight_factor"} */ of, /** @type {string} */ words) =>
    html`<button type="button" aria-pressed=${state.layer === of} ?disabled=${of !== "lux" && !factor}
      title=${of !== "lux" && !factor ? "Under an overcast sky only" : ""} @click=${() => set({ layer: of })}>${words}</button>`;
  const inParts = Boolean(state.draft?.grids?.[0]?.components);
  const toParts = () =>
    edit((draft) => {
      const grid = draft.grids?.[0];
      if (grid) grid.components = !inParts;
    });
  return html`<div class="group">${layer("lux", "Lux")}${layer("daylight_factor", "Daylight factor")}</div><button type="button"
    id="parts" aria-pressed=${inParts} title="Where the light comes from: each tube and each source by itself" @click=${toParts}>By tube</button>`;
}

/** The sentence, its target and the mean. */
function result() {
  const { answer, current, running } = state;
  if (!answer?.grid) return html`<p class="note">${answer ? "The document has no grid." : "Computing …"}</p>`;
  return html`<div class=${current ? "" : "old"}>${judged(answer, state.goal)}</div>${target()}<div
    class=${current ? "" : "old"}>${headline(answer)}</div><p class="note">${running ? html`<span class="busy">sharpening to ${percent(running.asked)}</span>` : "\u00a0"}</p>`;
}

/** Accuracy, methods and reasons, which nobody needs at first. */
function sure() {
  const { answer } = state;
  const error = answer?.job.progress.relative_error;
  const notes = answer ? answer.job.warnings.length + (answer.job.render_warnings?.length ?? 0) : 0;
  const words = [...(error ? [`error ${percent(error)}`] : []), ...(notes ? [notes === 1 ? "1 note" : `${notes} notes`] : [])];
  return html`<details class="panel sure"><summary><h2>How sure?</h2> <small>${words.join(", ")}</small></summary>
    <section class="accurate" aria-label="Accuracy">${accuracy()}${prediction()}</section>
    <section class="why" aria-label="Reasons">${answer ? reasons(answer.job) : nothing}</section></details>`;
}

function editor() {
  const [inYear, year] = [state.tab === "year", yearShown()];
  /** @type {[string, unknown, boolean]} */
  const around = ["Outside", outside(), isUsed()];
  const forms = [
    form("Tubes and room", [["Tubes", tubes()], ["Room", room()]]),
    inYear ? form("Weather and hours", [["Weather", weather(), !state.year.weather || undefined], around]) : form("Place, time and sky", [["Place and time", place()], ["Sky", sky()], around]),
  ];
  const below = () => html`${compare()}${view3d()}<section class="panel view" aria-label="Picture">${picture()}</section>`;
  return html`${header(true)}<main class="editor">${jobs()}
    <div class="column left">${forms[0]}</div>
    <div class="column middle">${drawings(forms)}${year ? yearByHour(year) : below()}</div>
    <div class="column right"><section class="panel result" aria-label="Result">${inYear ? yearResult() : result()}</section>${forms[1]}
      ${inYear ? criteria() : sure()}<section class="panel take" aria-label="Files">${inYear ? yearFiles() : take()}</section></div></main><p class="unseen" role="status">${heard()}</p>
    <p class="said" role="status">${prose(state.said)}</p>`;
}

/** What people who do not see the page hear of a result, once it rests. */
function heard() {
  const { answer, current, running, goal } = state;
  if (state.tab === "year") {
    const told = state.year.current && judgedYear();
    return told ? `${told.asked}: ${told.is}, ${told.found}` : "";
  }
  if (!answer?.grid || !current || running) return "";
  const { asked, is, found } = sentence(answer, goal);
  return `${asked}: ${is}. ${found}`;
}

/** @type {ReturnType<typeof setTimeout> | undefined} */
let soon;

async function start() {
  const id = /^\/jobs\/([0-9a-f-]{36})$/.exec(location.pathname)?.[1];
  if (id) return jobPage(id, app, () => header(false));
  drawnBy(() => {
    void followClock();
    yearJob.follow();
    render(editor(), app);
    fit(app, stacked.matches);
    followView(app);
    clearTimeout(soon);
    soon = setTimeout(() => void remember(), 400);
  });
  stacked.addEventListener("change", () => set());
  addEventListener("keydown", (event) => {
    const types = event.target instanceof HTMLInputElement && !["range", "radio", "checkbox"].includes(event.target.type);
    if (event.key !== "z" || !(event.ctrlKey || event.metaKey) || event.shiftKey || types) return;
    event.preventDefault();
    undo();
  });
  const unread = () => set({ said: "The link holds no document that can be read." });
  const follow = (/** @type {NonNullable<Awaited<ReturnType<typeof unpacked>>>} */ linked) => {
    const lux = linked.draft.grids?.[0]?.target_lux;
    const goal = linked.goal ?? (lux ? { lux, of: /** @type {const} */ ("mean") } : null);
    if (goal) set({ goal });
    set({ tab: linked.year ? "year" : "moment" });
    if (linked.year) {
      const { weather, ...shown } = linked.year;
      setYear({ ...shown, weather: null });
      if (weather) void find(weather);
    }
    known(linked.draft);
    set({ look: alongside(linked.draft.room) });
    use(linked.draft);
  };
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    const file = event.dataTransfer?.files[0];
    event.preventDefault();
    if (!file || !/\.(epw|wea)$/i.test(file.name)) return;
    set({ tab: "year" });
    void takeFile(file);
  });
  addEventListener("hashchange", async () => {
    const linked = await unpacked(location.hash);
    if (linked) return follow(linked);
    if (!location.hash) return;
    // the document that is shown stays, and its address
    forget();
    unread();
  });
  const linked = location.hash;
  const shared = await unpacked(linked);
  const lists = Promise.all([api.get("/v1/skies"), listed()]).then(([{ skies }, cities]) => {
    const host = document.body.appendChild(document.createElement("div"));
    render(suggestions(cities), host);
    set({ skies, cities });
  });
  if (shared) follow(shared);
  else await open("bathroom").catch((error) => set({ problem: api.problemOf(error) }));
  if (linked && !shared) unread();
  await lists;
}

void start();
