// What a year says: the sentence, what would do, numbers with their intervals, criteria, and files.
import { TARGETS, percent } from "./accuracy.js";
import { addTube } from "./draft.js";
import { judgedBy } from "./goal.js";
import { edit, year as job } from "./live.js";
import { faultInWords, prose } from "./prose.js";
import { yearFile } from "./share.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";
import { target } from "./verdict.js";
import { inWords } from "./year_search.js";
import { yearSentence } from "./year_sentence.js";
import { CLASSES, passed, verdicts, yearNumbers } from "./year_tables.js";

/** The target by which a year is judged: its illuminance is that for which the year was computed. @param {import("./year_job.js").YearAnswer} answer */
const goalOf = ({ wanted }) => ({ ...state.goal, lux: wanted.lux });

/** The sentence about the year that is shown. */
export function judgedYear() {
  const { answer } = state.year;
  if (!answer) return null;
  return yearSentence(answer.of, goalOf(answer), answer.wanted.schedule);
}

/** The job that is on its way, and its faults. */
function progress() {
  const { running, problem } = state.year;
  const error = running?.error ? `, error ${percent(running.error)}` : "";
  const passes = running && running.passes > 0 ? `: ${running.passes} ${running.passes === 1 ? "pass" : "passes"}${error}` : "";
  const faults = problem?.errors?.length ? problem.errors.map(faultInWords) : problem ? html`<p>${problem.title}: ${prose(problem.detail)}</p>` : nothing;
  const phase = running?.ended ? "adding up the hours of the year" : "computing the year";
  return html`${running ? html`<p class="note busy">${phase}${passes}</p>` : nothing}${problem ? html`<div class="fault" role="alert">${faults}</div>` : nothing}`;
}

/** Further tubes that would do, and a button that adds them. */
function wouldDo() {
  const { search } = state.year;
  if (!search) return nothing;
  const { count, ended, diameter_m, times } = search;
  const add = () => edit((draft) => Array.from({ length: count ?? 0 }, () => addTube(draft)));
  return html`<p id="would-do">${inWords(search, diameter_m, times)}
    ${ended && count !== null ? html`<button type="button" @click=${add}>Add ${count === 1 ? "it" : "them"}</button>` : nothing}</p>`;
}

/** A button that asks for a smaller error, where there is one. @param {number} error */
function finer(error) {
  const next = TARGETS.find((target) => target < error);
  return next ? html`<button type="button" @click=${() => set({ target: next })}>Compute to ${percent(next)}</button>` : nothing;
}

/** The answer, its target, and how far it is. */
export function yearResult() {
  const { answer, current, weather } = state.year;
  const sentence = judgedYear();
  if (!answer || !sentence)
    return html`<p class="verdict">Is it enough, over the year?</p>
      <p class="note">${weather ? "" : "A weather file tells the sky and the sun of every hour: drop one below, or try the synthetic year."}</p>
      ${progress()}${target()}`;
  return html`<div class=${current ? "" : "old"}><p class=${`verdict ${CLASSES[sentence.outcome]}`}>${sentence.asked}: <strong
      id="verdict">${sentence.is},</strong> ${sentence.found}</p>
    <p class="note">In brackets: the 95\u202f% interval of the numerical error. Real years differ from a typical one by several percent.</p>${
    sentence.outcome === "undecided" ? finer(answer.wanted.error) : nothing
  }</div>
    ${wouldDo()}${progress()}${target()}`;
}

/** A list of what a year tells, before there is one. */
const promised = () => html`<section class="panel" aria-label="What a year tells"><h2>What a year tells</h2><ul class="changes">
  <li>Whether the target is met in half of the hours, with the 95\u202f% interval, and about how many more tubes would do.</li>
  <li>The autonomy of every point: the share of the hours in which it has the target.</li>
  <li>The light of every hour: on the plan, at a point, and in the mean.</li>
  <li>Criteria of EN 17037, LEED, WELL, BREEAM and NBR 15575.</li>
  <li>Tables for other programs (CSV, NumPy, Radiance), and a report.</li></ul></section>`;

/** Numbers, and the criteria of standards and schemes. */
export function criteria() {
  const { answer, current } = state.year;
  if (!answer) return promised();
  const { of, summary, wanted } = answer;
  return html`<section class=${`panel criteria ${current ? "" : "old"}`} aria-label="Numbers and criteria"><h2>Numbers</h2>${yearNumbers(summary, of, [wanted.lux])}
    <details><summary><h2>Criteria</h2> <small>${passed(of.verdicts)}</small></summary>${verdicts(of.verdicts)}</details></section>`;
}

/** Links of a year's files. */
export function yearFiles() {
  const { answer, current } = state.year;
  const keeping = () => job.keep();
  if (!answer || !current) return html`<h2>Files</h2><p class="note">Files are there once the year is.</p>`;
  const { links, id } = answer.job;
  const by = judgedBy(goalOf(answer));
  const files = (links.annual ?? []).map((path) => html`<a href=${path} download=${yearFile(path)}>${yearFile(path)}</a>`);
  return html`<h2>Files</h2><p class="links" @click=${keeping} @auxclick=${keeping} @contextmenu=${keeping}>${files}
    <a href=${`${links.report_pdf}${by}`} download="report.pdf">report.pdf</a><a href=${`/jobs/${id}${by}`}>page of this job</a><a href=${`${links.report}${by}`}>report</a></p>`;
}
