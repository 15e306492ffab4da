// The numbers of a result, each with its interval.
import { sensorLight } from "./job_files.js";
import { values } from "./map.js";
import { coverage, digits, halfWidth, thousands } from "./scale.js";
import { faces } from "./sensor.js";
import { state } from "./state.js";
import { whole } from "./verdict.js";
import { passed, verdicts } from "./year_tables.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @typedef {{ of: number, error: number | null | undefined }} Estimate */

/** A value with the half of its interval of 95 %. @param {Estimate} estimate @param {number} factor @param {string} unit */
export function interval({ of, error }, factor, unit) {
  const ends = unit ? `\u202f${unit}` : "";
  if (error === null || error === undefined) return `${digits(of, unit ? 0.5 : 0.05)}${ends}`;
  const half = factor * error;
  // an error as large as the value tells nothing but that it is not known yet
  if (half > Math.abs(of)) return `≈\u202f${digits(of, half)}${ends}`;
  return `${digits(of, half)} ±\u202f${halfWidth(half)}${ends}`;
}

/** What a grid's values are of, in words. @param {Grid} grid */
const where = ({ points_m, height_m }) => (points_m ? `at ${points_m.length === 1 ? "one sensor" : `${points_m.length} sensors`}` : height_m ? `${height_m} m above the floor` : "on the floor");

/** The large number. @param {Answer} answer */
export function headline({ job, grid }) {
  const statistics = grid?.statistics;
  if (!statistics) return html`<p class="number">no grid</p>`;
  const half =
    statistics.mean_lux_standard_error === null || statistics.mean_lux_standard_error === undefined
      ? null
      : coverage(statistics, job.progress.passes) * statistics.mean_lux_standard_error;
  return html`<p class="number"><strong id="mean">${digits(statistics.mean_lux, half ?? 0.5)}\u202flx</strong>
    <span>${half === null ? "" : `±\u202f${halfWidth(half)}`}</span></p>
    <p class="note">mean illuminance ${where(grid)}${half === null ? "" : "; ± is the 95\u202f% interval"}</p>`;
}

/** All numbers of the grid. @param {Answer} answer */
export function numbers({ job, grid }) {
  if (!grid) return nothing;
  const { statistics: of, external_horizontal_illuminance_lux: outside } = grid;
  const times = coverage(of, job.progress.passes);
  const rows = [
    ["median", interval({ of: of.median_lux ?? 0, error: of.median_lux_standard_error }, times, "lx")],
    ["minimum", interval({ of: of.min_lux, error: of.min_lux_standard_error }, times, "lx")],
    ["maximum", interval({ of: of.max_lux, error: of.max_lux_standard_error }, times, "lx")],
    [
      "uniformity",
      of.uniformity === null || of.uniformity === undefined
        ? "–"
        : interval({ of: of.uniformity, error: of.uniformity_standard_error }, times, ""),
    ],
    [
      "outside",
      html`${thousands(outside.sky + outside.sun)}\u202flx${outside.sun > 0 ? html` <small>(sun ${thousands(outside.sun)})</small>` : nothing}`,
    ],
  ];
  const factor = of.daylight_factor_percent;
  if (factor) {
    const percent = (/** @type {number | null | undefined} */ value) =>
      value === null || value === undefined ? "–" : `${value.toPrecision(2)}\u202f%`;
    rows.push([
      "daylight factor",
      html`${percent(factor.mean)} <small>median ${percent(factor.median)}, least ${percent(factor.minimum)}</small>`,
    ]);
  } else if (outside.sky + outside.sun > 0) {
    rows.push(["inside / outside", `${((100 * of.mean_lux) / (outside.sky + outside.sun)).toPrecision(2)}\u202f%`]);
  }
  const levels = of.area_above ?? [];
  const above = levels.map(
    ({ lux, percent }) =>
      html`<td><meter min="0" max="100" value=${percent} aria-label=${`${whole(grid)} with ${lux} lx or more`}></meter>${percent.toFixed(0)}\u202f%</td>`,
  );
  return html`<div class="blocks"><dl class="numbers">${rows.map(([name, value]) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>
    <table class="above"><caption>${grid.points_m ? "Sensors that have at least" : "Area that has at least"}</caption><thead><tr>${levels.map(({ lux }, at) => html`<th scope="col">${lux}${at === levels.length - 1 ? "\u202flx" : ""}</th>`)}</tr></thead><tbody><tr>${above}</tr></tbody></table>
    ${sensors({ job, grid })}${tubes(job)}${origins({ job, grid })}</div>${criteria({ job, grid })}`;
}

/** Criteria that name the moment of the job. @param {Answer} answer */
function criteria({ job, grid }) {
  const of = job.grids?.find(({ name }) => name === grid?.name)?.verdicts ?? [];
  return of.length ? html`<details class="criteria"><summary><h2>Criteria of this moment</h2> <small>${passed(of)}</small></summary>${verdicts(of)}</details>` : nothing;
}

/** Illuminances at single sensors. @param {Answer} answer */
function sensors(answer) {
  const light = sensorLight(answer);
  if (!light?.points_m) return nothing;
  const times = coverage(light, answer.job.progress.passes);
  const lux = (/** @type {number} */ at) => {
    const [value, error] = [light.illuminance_lux[0]?.[at], light.standard_error_lux[0]?.[at]];
    return value === null || value === undefined ? "outside" : interval({ of: value, error }, times, "lx");
  };
  return html`<table class="fluxes at-sensors"><caption>At the sensors</caption>
    <thead><tr><th scope="col">sensor</th><th scope="col">faces</th><th scope="col">illuminance</th></tr></thead>
    <tbody>${light.points_m.map((point, at) => html`<tr><th scope="row">${at + 1}</th><td>${faces(/** @type {import("./sensor.js").Sensor} */ (point))}</td><td>${lux(at)}</td></tr>`)}</tbody></table>`;
}

/** Most tubes of which each has a row of its own at once. */
const MOST_TUBES = 8;

/** Fluxes of the tubes: of each, or of all with the least and the most, where each is folded. @param {Job} job */
function tubes(job) {
  const of = job.tubes ?? [];
  if (!of.length) return nothing;
  const rows = of.map((tube, index) => ({
    name: String(index + 1),
    flux: [tube.at_collector, tube.at_diffuser, tube.into_room].map((of) => of?.flux_lm ?? null),
    share: tube.transmission_efficiency ?? null,
  }));
  if (rows.length <= MOST_TUBES) return fluxes("Lumens through the tubes", rows);
  const sums = [0, 1, 2].map((k) => rows.reduce((/** @type {number | null} */ sum, { flux }) => (sum === null || flux[k] === null ? null : sum + Number(flux[k])), 0));
  const [arrives, , enters] = sums;
  const all = { name: "all", flux: sums, share: arrives && typeof enters === "number" ? enters / arrives : null };
  const sorted = rows.toSorted((one, other) => Number(one.flux[2]) - Number(other.flux[2]));
  const [least, most] = [sorted[0], sorted.at(-1)];
  const ends = [least ? { ...least, name: `least: ${least.name}` } : all, most ? { ...most, name: `most: ${most.name}` } : all];
  return html`${fluxes("Lumens through the tubes", [all, ...ends])}<details class="each"><summary>Each of ${rows.length} tubes</summary>${fluxes("", rows)}</details>`;
}

/** A table of fluxes. @param {string} caption @param {{ name: string, flux: (number | null)[], share: number | null }[]} rows */
function fluxes(caption, rows) {
  const percent = (/** @type {number | null} */ share) => (share === null ? "–" : `${(100 * share).toFixed(1)}\u202f%`);
  return html`<table class="fluxes">${caption ? html`<caption>${caption}</caption>` : nothing}
    <thead><tr><th scope="col">tube</th><th scope="col">arrives</th><th scope="col">leaves</th><th
      scope="col">enters</th><th scope="col">share</th></tr></thead>
    <tbody>${rows.map(({ name, flux, share }) => html`<tr><th scope="row">${name}</th>${flux.map((lumens) => html`<td>${lumens === null ? "–" : thousands(lumens)}</td>`)}<td>${percent(share)}</td></tr>`)}</tbody></table>`;
}

/** The parts of the light of a grid that has them: its tubes, and its sources. @param {Grid} grid */
function parts({ components, by_tube }) {
  /** @type {[keyof NonNullable<Grid["components"]>, string][]} */
  const names = [
    ["sky_direct", "sky, direct"],
    ["sky_interreflected", "sky, reflected"],
    ["sun_direct", "sun, direct"],
    ["sun_interreflected", "sun, reflected"],
    ["luminaires_direct", "lamps, direct"],
    ["luminaires_interreflected", "lamps, reflected"],
  ];
  const sources = names.flatMap(([name, words]) => {
    const part = components?.[name];
    return part ? [/** @type {[string, Schemas["GridPart"]]} */ ([words, part])] : [];
  });
  const tubes = (by_tube ?? []).map((part, index) => /** @type {[string, Schemas["GridPart"]]} */ ([`tube ${index + 1}`, part]));
  return { tubes, sources };
}

/** Where the light comes from, in the mean over the grid. @param {Answer} answer */
function origins({ job, grid }) {
  const { tubes, sources } = grid ? parts(grid) : { tubes: [], sources: [] };
  const mean = grid?.statistics.mean_lux ?? 0;
  if (!(tubes.length + sources.length) || !(mean > 0)) return nothing;
  const row = (/** @type {[string, Schemas["GridPart"]]} */ [name, part]) => html`<tr><th scope="row">${name}</th><td><meter min="0" max="100" value=${(100 * part.mean_lux) / mean}
      aria-label=${`share of ${name}`}></meter></td><td>${((100 * part.mean_lux) / mean).toFixed(0)}\u202f%</td>
      <td>${interval({ of: part.mean_lux, error: part.mean_lux_standard_error }, coverage(grid?.statistics, job.progress.passes), "")}</td></tr>`;
  const folds = tubes.length > MOST_TUBES;
  return html`<table class="above origins"><caption>Where the mean comes from, lx${sources.length && !folds ? ": by tube, and by source" : ""}</caption>${(folds ? [sources] : [tubes, sources]).map((rows) => html`<tbody>${rows.map(row)}</tbody>`)}</table>
    ${folds ? html`<details class="each"><summary>From each of ${tubes.length} tubes</summary><table class="above origins"><tbody>${tubes.map(row)}</tbody></table></details>` : nothing}`;
}

/** The value under the pointer. */
export function readOut() {
  const { answer, cursor } = state;
  const grid = answer?.grid;
  if (!grid || !cursor)
    return html`<p class="readout note">Drag tubes${state.draft.room.plan ? ", walls and corners" : " and walls"}, or move them by the arrow keys. Point at the plan to read a value.</p>`;
  const [column, row] = cursor;
  const [value, error] = [grid.illuminance_lux[row]?.[column], grid.standard_error_lux[row]?.[column]];
  if (value === null && grid.area_m2?.[row]?.[column] === 0) return html`<p class="readout note">Outside the room, or too near a wall.</p>`;
  if (value === null) return html`<p class="readout note">Inside an object: there is no floor here.</p>`;
  if (value === undefined) return html`<p class="readout note"></p>`;
  const { rows, unit } = values(grid, state.layer);
  const shown = unit === "%" ? html`, ${rows[row]?.[column]?.toPrecision(2)}\u202f%` : nothing;
  return html`<p class="readout">${interval({ of: value, error }, coverage(grid, answer.job.progress.passes), "lx")}${shown}
    <small>${error ? "(95\u202f%) " : ""}at ${grid.x_m[column]?.toFixed(2)} m from west, ${grid.y_m[row]?.toFixed(2)} m from south${shares(grid, column, row)}</small></p>`;
}

/** Shares of the tubes, and of lamps, in a cell's light. @param {Grid} grid @param {number} column @param {number} row */
function shares(grid, column, row) {
  const whole = grid.illuminance_lux[row]?.[column] ?? 0;
  if (!grid.by_tube || !(whole > 0)) return nothing;
  const of = (/** @type {Schemas["GridPart"] | null | undefined} */ part) => part?.illuminance_lux[row]?.[column] ?? 0;
  const lamps = of(grid.components?.luminaires_direct) + of(grid.components?.luminaires_interreflected);
  const named = [...grid.by_tube.map((part, index) => [`tube ${index + 1}`, of(part)]), ["lamps", lamps]];
  const told = named.filter(([, lux]) => Number(lux) > 0).map(([name, lux]) => `${name} ${((100 * Number(lux)) / whole).toFixed(0)}\u202f%`);
  return html`<br>${told.join(", ")}`;
}
