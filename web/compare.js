// Two variants side by side on one scale, and their difference.
import { across, cells, down, largest, legend, lux, outlined, outside, values } from "./map.js";
import { placeInWords } from "./places.js";
import { extent } from "./room.js";
import { SMALL, layout } from "./room_plan.js";
import { coverage, diverging, halfWidth, rising, scale } from "./scale.js";
import { set, state } from "./state.js";
import { html, nothing, svg } from "./vendor/lit-html.js";

/** Keeps the result that is shown as variant A. */
export function keepAsA() {
  if (state.answer) set({ kept: { draft: state.draft, answer: state.answer } });
}

/** @param {Answer} answer @param {(at: import("./map.js").Layout) => Drawn} map @param {string} label */
function small(answer, map, label) {
  const { room } = answer.job.document;
  const { west, width, depth } = extent(room);
  const natural = layout(room, SMALL);
  const at = { ...natural, left: 4 - natural.k * west, top: 4 };
  return html`<figure><figcaption>${label}</figcaption>${svg`<svg viewBox=${`0 0 ${at.k * width + 8} ${at.k * depth + 8}`} role="img" aria-label=${label}>
    ${map(at)}${answer.grid ? outside(room, answer.grid, at) : nothing}${outlined(room, at, "frame")}
    ${(answer.job.document.tubes ?? []).map(
      ({ centre_m }) => svg`<circle class="ring" cx=${across(at, centre_m[0])}
      cy=${down(at, centre_m[1])} r="5"></circle>`,
    )}</svg>`}</figure>`;
}

/** The comparison, once a variant is kept. */
export function compare() {
  const { kept, answer } = state;
  if (!kept || !answer?.grid || !kept.answer.grid) return nothing;
  const [a, b] = [kept.answer, answer];
  const [gridA, gridB] = [kept.answer.grid, answer.grid];
  const layer = gridA.daylight_factor_percent && gridB.daylight_factor_percent ? state.layer : "lux";
  const [ofA, ofB] = [values(gridA, layer), values(gridB, layer)];
  const { end } = scale(Math.max(largest(ofA.rows), largest(ofB.rows)), 4);
  const alike = gridA.x_m.join() === gridB.x_m.join() && gridA.y_m.join() === gridB.y_m.join();
  return html`<section class="panel compare" aria-label="Comparison"><div class="head"><h2>A and B</h2>
      <button type="button" @click=${keepAsA}>B becomes A</button><button type="button"
        @click=${() => set({ kept: null })}>Close</button></div>
    <div class="three">
      ${small(a, (at) => lux(gridA, ofA.rows, at, end), `A: ${mean(a)}`)}
      ${small(b, (at) => lux(gridB, ofB.rows, at, end), `B: ${mean(b)}`)}
      ${
        alike
          ? difference(b, gridB, ofA.rows, ofB.rows, ofB.unit, between(a, b))
          : html`<p
        class="note">${between(a, b)}. The rooms differ, so that their maps have no difference.</p>`
      }
      <div class="both">${legend(0, end, ofB.unit, (value) => rising(value / end), 240)}</div>
    </div>
    ${changed(kept.draft, state.draft)}</section>`;
}

/** Most changes that are listed. */
const MOST = 8;

/**
 * What differs between two documents, field by field: its place in words, and the values as the documents have them.
 * @param {any} a
 * @param {any} b
 * @param {string} at
 * @returns {string[]}
 */
export function changes(a, b, at = "") {
  const isList = (/** @type {unknown} */ value) => Array.isArray(value) && value.every((item) => typeof item !== "object");
  const text = (/** @type {any} */ value) =>
    value === undefined ? "none" : isList(value) ? value.join(", ") : typeof value === "string" ? value : JSON.stringify(value);
  const nested = [a, b].every((value) => value !== null && typeof value === "object" && !isList(value));
  if (!nested) return text(a) === text(b) ? [] : [`${placeInWords(at)}: ${text(a)} → ${text(b)}`];
  const keys = [...new Set([...Object.keys(a), ...Object.keys(b)])];
  return keys.flatMap((key) => changes(a[key], b[key], `${at}/${key}`));
}

/** The changes from A to B in words. @param {JobDocument} a @param {JobDocument} b */
function changed(a, b) {
  const found = changes(a, b);
  const more = found.length > MOST ? [`and ${found.length - MOST} more`] : [];
  return html`<ul class="changes">${[...found.slice(0, MOST), ...more].map((change) => html`<li>${change}</li>`)}</ul>`;
}

/** @param {Answer} answer */
const mean = ({ grid }) => `${grid?.statistics.mean_lux.toFixed(0)}\u202flx`;

/** The difference of the means with its interval. @param {Answer} a @param {Answer} b */
function between(a, b) {
  const [ofA, ofB] = [a.grid?.statistics, b.grid?.statistics];
  if (!ofA || !ofB) return "";
  const change = ofB.mean_lux - ofA.mean_lux;
  const half =
    Math.max(coverage(ofA, a.job.progress.passes), coverage(ofB, b.job.progress.passes)) *
    Math.hypot(ofA.mean_lux_standard_error ?? 0, ofB.mean_lux_standard_error ?? 0);
  return `B − A: ${change < 0 ? "−" : "+"}${Math.abs(change).toFixed(half < 1 ? 1 : 0)} ±\u202f${halfWidth(half)}\u202flx (95\u202f%)`;
}

/**
 * @param {Answer} answer
 * @param {Grid} grid
 * @param {number[][]} rowsA
 * @param {number[][]} rowsB
 * @param {string} unit
 * @param {string} label
 */
function difference(answer, grid, rowsA, rowsB, unit, label) {
  const rows = rowsB.map((row, j) => row.map((value, i) => value - (rowsA[j]?.[i] ?? 0)));
  const most = largest(rows.map((row) => row.map(Math.abs)));
  if (!(most > 0)) return html`<p class="note">${label}. The maps are the same.</p>`;
  const { end } = scale(most, 4);
  const colour = (/** @type {number} */ value) => diverging(value / end);
  return html`<div>${small(answer, (at) => cells(grid, rows, at, `difference ${end}`, colour), label)}${legend(-end, end, unit, colour, 130)}</div>`;
}
