// The form of a year: its weather file, and the hours that count.
import { choice, file } from "./field.js";
import { prose } from "./prose.js";
import { setYear, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";
import { takeFile, trySynthetic } from "./weather.js";
import { SCHEDULES } from "./year_sentence.js";

/** The test of a file's sun in words. @param {Schemas["ClosureReport"]} closure @param {number} taken minutes */
function sunTest({ records, best_offset_minutes: best, rms_at_best_w_m2: rms }, taken) {
  const minutes = (/** @type {number} */ of) => `${of > 0 ? "+" : ""}${of}\u202fmin`.replace("-", "\u2212");
  const at = Math.abs(best - taken) < 1 ? `${minutes(taken)} from the stamps, as taken` : `fits best ${minutes(best)} from the stamps, taken ${minutes(taken)}`;
  return `${at}; ${rms.toPrecision(2)}\u202fW/m² in ${records} h`;
}

/** @param {Weather} weather */
function told({ report }) {
  const degrees = (/** @type {number} */ value, /** @type {string} */ plus, /** @type {string} */ minus) => `${Math.abs(value)}° ${value < 0 ? minus : plus}`;
  const { name, latitude_deg, longitude_deg, elevation_m, records, from, to, closure, repairs, warnings } = report;
  const rows = [
    ["place", `${degrees(latitude_deg, "N", "S")}, ${degrees(longitude_deg, "E", "W")}, ${elevation_m} m`],
    ["records", `${records}, from ${from} to ${to}`],
    ["sun", closure ? sunTest(closure, report.sun_offset_minutes) : "not possible with this file"],
    ["repaired", repairs.length ? repairs.map(({ kind, count, first_line: line }) => `${count} × ${kind.replaceAll("_", " ")} (line ${line})`).join("; ") : "nothing"],
  ];
  return html`<h3>${name || "A place without a name"}</h3>
    <dl class="numbers">${rows.map(([of, words]) => html`<div><dt>${of}</dt><dd>${words}</dd></div>`)}</dl>
    ${warnings.map(({ detail }) => html`<p class="warning" role="note">${detail}</p>`)}`;
}

/** The part of the form about weather. */
export function weather() {
  const { weather, reading, fault, synthetic, schedule } = state.year;
  return html`${weather ? told(weather) : nothing}
    ${file({ accept: ".epw,.wea", label: `${weather ? "Another" : "A"} year of weather: drop an EPW or WEA file here, or choose one`, take: (it) => void takeFile(it) })}
    ${synthetic && weather ? nothing : html`<button type="button" id="synthetic" ?disabled=${reading} @click=${() => void trySynthetic()}>Try the synthetic year</button>`}
    <p class="note">${synthetic && weather ? "Made from formulas; it is that of no real place." : html`Files of most places are at <a href="https://climate.onebuilding.org">climate.onebuilding.org</a>.`}
      ${reading ? html`<span class="busy">reading</span>` : nothing}</p>
    ${fault ? html`<p class="fault" role="alert">${prose(fault)}</p>` : nothing}
    ${choice({ pointer: "/annual/schedule", label: "Hours that count", value: schedule, options: SCHEDULES, set: (to) => setYear({ schedule: to }) })}`;
}
