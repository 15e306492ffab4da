// What each accuracy would take, as a trial of a moment foretells it, before anything is computed.
import { TARGETS, foretold, percent } from "./accuracy.js";
import * as api from "./api.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** Asks what the draft would take. The trial takes all processors for a moment: nobody asks for it by moving something. */
async function ask() {
  const { draft, target } = state;
  set({ prediction: { draft, told: null } });
  try {
    const { predictions } = await api.predict({ ...draft, views: [], stop: { ...draft.stop, relative_error: target } });
    if (state.prediction?.draft === draft) set({ prediction: { draft, told: predictions ?? null } });
  } catch (error) {
    set({ prediction: null, said: api.problemOf(error).detail });
  }
}

/** Few jobs take as little, and nobody waits for them; the times tell them apart all the same. @param {number} seconds */
const short = (seconds) => (seconds < 0.1 ? `${Math.max(1, Math.round(1000 * seconds))}\u202fms` : foretold(seconds));

/** @param {Schemas["PredictedTime"] | undefined} time */
function seconds(time) {
  if (!time?.seconds) return html`<span title=${(time?.reason ?? "").replaceAll("`", "")}>not known</span>`;
  const from = short(time.seconds_from ?? time.seconds);
  const to = time.seconds_to ? short(time.seconds_to) : "more";
  return html`${short(time.seconds)} <small>${from} to ${to}</small>`;
}

/** @param {Schemas["OutputPredictions"]} grids */
function table({ methods }) {
  const at = (/** @type {number} */ error) => (/** @type {Schemas["MethodPredictions"]} */ { accuracies }) =>
    accuracies.find(({ relative_error }) => relative_error === error);
  const planned = methods.find((row) => row.planned);
  const word = (/** @type {string | undefined} */ name) => (name ?? "the plan").replaceAll("_", " ");
  const row = (/** @type {number} */ error) => {
    const cheapest = methods.find((row) => at(error)(row)?.cheapest);
    const other = cheapest && cheapest !== planned;
    return html`<tr><th scope="row">${percent(error)}</th><td>${seconds(planned && at(error)(planned))}</td>
      <td>${other ? html`${word(cheapest.method)}: ${seconds(at(error)(cheapest))}` : cheapest ? "the same" : "not known"}</td></tr>`;
  };
  return html`<table id="predicted"><caption>As a short trial of each method predicts</caption>
    <thead><tr><th scope="col">Accuracy</th><th scope="col">By ${word(planned?.method)}</th><th scope="col">Cheapest</th></tr></thead>
    <tbody>${TARGETS.map(row)}</tbody></table>`;
}

/** The part of the page about times to come. */
export function prediction() {
  const { draft, prediction: asked } = state;
  const of = asked?.draft === draft ? asked : null;
  const told = of?.told?.grids;
  return html`<button type="button" id="predict" ?disabled=${of !== null && !of.told} @click=${ask}
      title="Tries each method for a moment">What would each accuracy take?</button>
    ${told ? table(told) : nothing}`;
}
