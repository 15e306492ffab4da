// The year of a job at an address of its own: numbers, criteria and figures of each grid.
import { fresh } from "./fresh.js";
import { judgedBy } from "./goal.js";
import { has } from "./verdict.js";
import { bracketed, judge, yearSentence } from "./year_sentence.js";
import { CLASSES, passed, verdicts, yearNumbers } from "./year_tables.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @typedef {import("./goal.js").Goal} Goal */

/** The path of a figure of a grid's year. @param {Job} job @param {string} name */
const path = (job, name) => (job.links.annual ?? []).find((path) => path.endsWith(`/annual/${name}.svg`));

/** A figure that the service draws, which scrolls sideways where its letters would be too small to read. @param {string} path @param {string} address from which it is shown @param {string} words */
export const figure = (path, address, words) =>
  html`<a class="figure" href=${path}><img class="rendered" src=${address} alt=${words}></a>`;

/** A figure of a year in its panel. @param {Job} job @param {boolean} runs whether the job runs on @param {string} name @param {string} words @param {string} [query] what of it is asked for */
function panel(job, runs, name, words, query = "") {
  const known = path(job, name);
  if (!known) return nothing;
  const of = `${known}${query}`;
  const address = runs ? fresh(of, job.progress.passes) : of;
  return address ? html`<section class="panel view" aria-label=${words}><h2>${words}</h2>${figure(of, address, words)}</section>` : nothing;
}

/** True of a target of which a grid's year has a number. @param {Schemas["GridYearResult"]} of @param {Goal} goal @param {Schemas["SdaDocument"]} [sda] */
const isKnown = (of, goal, sda) => !Number.isNaN(judge(of, goal, sda).value);

/** Verdict on a grid's target, or else a sentence about its spatial autonomy. @param {Schemas["GridYearResult"]} of @param {JobDocument} document @param {Goal | null} goal */
function sentence(of, document, goal) {
  const { sda, schedule } = document.annual ?? {};
  const note = html`<p class="note">In brackets: the 95\u202f% interval of the numerical error.</p>`;
  if (goal && isKnown(of, goal, sda)) {
    const { asked, is, found, outcome } = yearSentence(of, goal, schedule?.kind ?? "lm83", sda);
    return html`<p class=${`verdict ${CLASSES[outcome]}`}>${asked}: <strong id="verdict">${is},</strong> ${found}</p>${note}`;
  }
  const lux = sda?.threshold_lux ?? 300;
  const share = sda?.time_percent ?? 50;
  return html`<p class="verdict"><strong>${bracketed({ ...of.sda_percent, limit: NaN }, "%")}</strong> of the ${has(document.grids?.find(({ name }) => name === of.name))} ${lux}\u202flx in ${share}\u202f% of the hours that count.</p>${note}`;
}

/** How far the files of several years differ. @param {Schemas["AnnualResult"]} summary @param {string} name of the grid */
function spread({ others, over_files }, name) {
  const metrics = over_files?.find((grid) => grid.name === name)?.metrics ?? [];
  if (!others?.length || !metrics.length) return nothing;
  const row = (/** @type {Schemas["MetricOverFiles"]} */ { name, least, median, largest }) =>
    html`<tr><th scope="row">${name.replaceAll("_", " ")}</th>${[least, median, largest].map((of) => html`<td>${of.toFixed(1)}</td>`)}</tr>`;
  return html`<details><summary><h2>Over ${others.length + 1} weather files</h2></summary><table><thead><tr><th scope="col">metric</th><th
    scope="col">least</th><th scope="col">median</th><th scope="col">largest</th></tr></thead><tbody>${metrics.map(row)}</tbody></table></details>`;
}

/** Panels of a job's year. @param {Job} job @param {Schemas["AnnualResult"]} summary @param {boolean} runs whether the job runs on @param {(grid: string) => Goal | null} goalOf target of a grid */
export function yearOf(job, summary, runs, goalOf) {
  const query = (/** @type {Schemas["GridYearResult"]} */ of) => {
    const goal = goalOf(of.name);
    return goal && isKnown(of, goal, job.document.annual?.sda) ? judgedBy(goal) : "";
  };
  const file = summary.site;
  // a figure may stand far from the numbers of its grid
  const named = (/** @type {string} */ words, /** @type {string} */ name) => (summary.grids.length > 1 ? `${words}, ${name}` : words);
  return summary.grids.map(
    (of) => html`<section class="panel criteria year" aria-label=${`Year of ${of.name}`}><h2>${of.name}, a year</h2>
      <p>${file.name}</p>${sentence(of, job.document, goalOf(of.name))}
      ${yearNumbers(summary, of, of.autonomies.map(({ lux }) => lux))}
      <details><summary><h2>Criteria</h2> <small>${passed(of.verdicts)}</small></summary>${verdicts(of.verdicts)}</details>${spread(summary, of.name)}</section>
      ${panel(job, runs, `autonomy.${of.name}`, named("Daylight autonomy", of.name), query(of))}
      ${panel(job, runs, `useful.${of.name}`, named("Useful daylight", of.name))}
      ${panel(job, runs, `by_hour.${of.name}`, named("Mean by day and hour", of.name))}`,
  );
}

/** The light of the tubes by month. @param {Job} job @param {boolean} runs */
export const fluxesOf = (job, runs) => panel(job, runs, "fluxes", "Light of the tubes by day and hour");
