// Tables of a year: numbers with their intervals, and the criteria of standards and schemes.
import { bracketed, criterion } from "./year_sentence.js";
import { html } from "./vendor/lit-html.js";

/** Classes of outcomes. */
export const CLASSES = { pass: "yes", fail: "no", undecided: "not-sure" };

/**
 * Numbers of a grid's year with their intervals.
 * @param {Schemas["AnnualResult"]} summary @param {Schemas["GridYearResult"]} of
 * @param {number[]} thresholds illuminances of the daylight autonomies that are shown
 */
export function yearNumbers(summary, of, thresholds) {
  const number = (/** @type {Schemas["WithInterval"]} */ value, /** @type {string} */ unit) => bracketed({ ...value, limit: NaN }, unit);
  const autonomies = of.autonomies.filter(({ lux }) => thresholds.includes(lux));
  const light = summary.tubes.reduce((sum, { klm_h }) => sum + klm_h.value, 0);
  const rows = [
    ["hours that count", summary.conventions.occupied_hours.toFixed(0)],
    ["mean", number(of.mean_lux, "lx")],
    ...autonomies.map(({ lux, da_percent }) => [`at least ${lux} lx`, number(da_percent, "%")]),
    ["300 to 3000 lx", number(of.udi.autonomous_percent, "%")],
    ["exposure", number(of.exposure_klxh, "klx\u202fh")],
    ["light of the tubes", `${light.toFixed(0)}\u202fklm\u202fh`],
  ];
  return html`<dl class="numbers">${rows.map(([name, value]) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>`;
}

/** How many criteria are met, in words. @param {Schemas["VerdictResult"][]} of */
export const passed = (of) => `${of.filter(({ verdict }) => verdict === "pass").length} of ${of.length} pass`;

/** The criteria and how they end. @param {Schemas["VerdictResult"][]} of */
export function verdicts(of) {
  const row = (/** @type {Schemas["VerdictResult"]} */ verdict) => {
    const { name, is, found, limit } = criterion(verdict);
    return html`<tr class=${CLASSES[verdict.verdict]}><td>${name}<br><small>${found}, asked ${limit}</small></td><td><span class="mark">${is}</span></td></tr>`;
  };
  return html`<p class="note">As if the tubes were the room's only daylight. No scheme is met by single criteria.</p>
    <div class="list" tabindex="0" role="region" aria-label="Table of criteria"><table><tbody>${of.map(row)}</tbody></table></div>`;
}
