// The time zone of a document's clock: that of its place, another one that was chosen, or the offset that the document came with.
import * as api from "./api.js";
import { hourName, local, offset, read } from "./clock.js";
import { edit, use } from "./live.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** Name of the zone that was chosen for the place; null: the place's own. @type {string | null} */
let chosen = null;
/** Whether the clock is of a zone: the document's offset follows its rules. */
let follows = true;
/** What was asked for last, and what the page itself made: there the offset is put right; elsewhere it is judged. */
let asked = "";
let own = "";
/** The answer to what was asked for. @type {Schemas["TimeZoneResource"] | null} */
let told = null;

/** What a zone is asked for with; null where there is no clock. @param {JobDocument} draft */
function question({ location, time, sky }) {
  const clock = local(time);
  if (!location || !clock || sky?.sun_position) return null;
  const place = { latitude_deg: String(location.latitude_deg), longitude_deg: String(location.longitude_deg) };
  return { ...place, local_time: clock, ...(chosen ? { time_zone: chosen } : {}) };
}

/** Changes place or clock of the draft; the offset follows as soon as it is known. @param {(draft: JobDocument) => void} change */
export function setClock(change) {
  const before = state.draft.location;
  edit(change);
  const { location } = state.draft;
  if (before?.latitude_deg !== location?.latitude_deg || before?.longitude_deg !== location?.longitude_deg) take(null);
  own = JSON.stringify(question(state.draft));
}

/** Takes a zone for the clock; null: the place's own. @param {string | null} name */
function take(name) {
  chosen = name;
  follows = true;
  asked = "";
  own = JSON.stringify(question(state.draft));
  set();
}

/** True of one instant on one clock, however it is written. @param {string | null | undefined} a @param {string | null | undefined} b */
const isSame = (a, b) => Date.parse(a ?? "") === Date.parse(b ?? "") && offset(a) === offset(b);

/** Asks for the clock of the draft, if that was not asked for; the offset follows the answer. */
export async function followClock() {
  const wanted = question(state.draft);
  const key = JSON.stringify(wanted);
  if (key === asked) return;
  asked = key;
  if (!wanted) return void (told = null);
  try {
    const answer = await api.timeZone(wanted);
    // the draft may have changed without having been drawn, and thus asked for, since
    if (asked !== key || JSON.stringify(question(state.draft)) !== key) return;
    told = answer;
    const { time } = state.draft;
    const holds = isSame(answer.time, time) || (own !== key && isSame(answer.second_time, time));
    if (own !== key) follows = holds;
    if (!follows || holds) return set();
    if (answer.shown === "never")
      set({ said: `Clocks of ${answer.time_zone} leap over ${wanted.local_time.slice(11, 16)} on this day: ${answer.time.slice(11, 16)} is taken.` });
    use({ ...state.draft, time: answer.time });
  } catch (error) {
    if (asked !== key) return;
    told = null;
    const pause = api.pauseAfter(error);
    if (pause !== null) setTimeout(() => asked === key && ((asked = ""), set()), pause);
    set();
  }
}

/** Zones that can be chosen. */
const names = Intl.supportedValuesOf("timeZone");

/** The zone of the clock, to be chosen; where clocks show the hour twice, which of the two is meant. */
export function zone() {
  const { time } = state.draft;
  const value = follows ? (chosen ?? "") : "offset";
  const ofPlace = chosen || !follows || !told ? "that of the place" : told.time_zone;
  const whose = `UTC${offset(time)}, ${follows ? (chosen ? "chosen" : "that of the place") : "that of the document"}`;
  const choose = (/** @type {Event} */ event) => take(/** @type {HTMLSelectElement} */ (event.target).value || null);
  const option = (/** @type {string} */ name, /** @type {string} */ words) =>
    html`<option value=${name} .selected=${name === value}>${words}</option>`;
  const others = chosen && !names.includes(chosen) ? [chosen, ...names] : names;
  return html`<div class="field"><label for="zone">Time zone</label><output for="zone">${whose}</output><select id="zone" @change=${choose}>
      ${follows ? nothing : option("offset", `UTC${offset(time)}`)}${option("", ofPlace)}
      ${others.map((name) => option(name, name))}</select></div>
    ${told?.second_time && follows ? twice(told.time, told.second_time) : nothing}
    <p class="note">Time zones: © <a href="https://www.openstreetmap.org/copyright">OpenStreetMap contributors</a>.
      Cities: © <a href="https://www.geonames.org">GeoNames</a>, CC BY 4.0.</p>`;
}

/** @param {string} first @param {string} second */
function twice(first, second) {
  const isFirst = isSame(first, state.draft.time);
  const other = () => edit((next) => void (next.time = isFirst ? second : first));
  return html`<p class="note">Clocks show ${hourName(read(first).hour)} twice on this day: the ${isFirst ? "first" : "second"} is meant.
    <button type="button" @click=${other}>Take the ${isFirst ? "second" : "first"}</button></p>`;
}
