// The panels of a year in the middle of the page: what the plan shows, the months, the day, and the year by day and hour.
import { setYear, state } from "./state.js";
import { html } from "./vendor/lit-html.js";
import { dayCurve, monthBars, ofMonth } from "./year_charts.js";
import { dayOfYear } from "./year_plan.js";
import { chooseHour } from "./form_hour.js";
import { strip } from "./year_strip.js";

/** Buttons that choose what the plan shows. @param {import("./year_job.js").YearAnswer} answer */
export function layers(answer) {
  const layer = (/** @type {"autonomy" | "lux"} */ of, /** @type {string} */ words, /** @type {string} */ title) =>
    html`<button type="button" title=${title} aria-pressed=${state.year.layer === of} @click=${() => setYear({ layer: of })}>${words}</button>`;
  return html`<div class="group">${layer("autonomy", "Autonomy", `Share of the hours that count with ${answer.wanted.lux} lx or more`)}${layer("lux", "Lux", "Illuminance of the hour that is shown")}</div>`;
}

/** Months and day, beside or below the plan. @param {import("./year_job.js").YearAnswer} answer */
export function charts(answer) {
  const old = state.year.current ? "" : "old";
  return html`<section class=${`panel cut ${old}`} aria-label="Light by month"><div class="head"><h2>Light by month</h2><small>${ofMonth(answer)}</small></div>${monthBars()}</section>
    <section class=${`panel all-numbers daily ${old}`} aria-label="Day"><div class="head"><h2>${dayOfYear(answer)}</h2><small class="key of-point">point</small><small
      class="key of-mean">mean</small></div>${dayCurve()}</section>`;
}

/** The year by day and hour, and what chooses one of them. @param {import("./year_job.js").YearAnswer} answer */
export const yearByHour = (answer) =>
  html`<section class=${`panel hours ${state.year.current ? "" : "old"}`} aria-label="Year by day and hour"><div class="choose-hour"><h2>Mean by day and hour</h2>${chooseHour(answer)}</div>${strip()}</section>`;
