// Error against time as it falls, the accuracies to choose from, and the time to each.
import { edit, live } from "./live.js";
import { thousands } from "./scale.js";
import { set, state } from "./state.js";
import { html, nothing, svg } from "./vendor/lit-html.js";

/** Relative errors to choose from. */
export const TARGETS = [0.05, 0.02, 0.01, 0.005, 0.001];
const CHART = { width: 300, height: 150, right: 24, top: 10, bottom: 26 };
/** Widths in the chart of a character beside it, and of the space around its labels. */
const LABEL = { letter: 7, around: 11 };

/** @param {number} share */
export const percent = (share) => `${Number((100 * share).toPrecision(2))}\u202f%`;

/** @param {number} seconds */
export function duration(seconds) {
  if (seconds < 1) return `${Math.max(10, Math.round(seconds * 100) * 10)}\u202fms`;
  if (seconds < 90) return `${seconds.toFixed(seconds < 10 ? 1 : 0)}\u202fs`;
  return seconds < 5400 ? `${Math.round(seconds / 60)}\u202fmin` : `${thousands(seconds / 3600)}\u202fh`;
}

/** Beyond an hour nobody waits, and a time that is foretold is known the worse the farther it lies. */
const FARTHEST_SECONDS = 3600;

/** A time that is foretold. @param {number} seconds */
export const foretold = (seconds) => (seconds > FARTHEST_SECONDS ? ">\u202f1\u202fh" : duration(seconds));

/**
 * Seconds to an error, as the service foretold it after the last pass; of a job without events, as errors of random passes fall.
 * Null where nothing is known.
 * @param {Pass[]} passes
 * @param {number} to
 */
export function secondsTo(passes, to) {
  const last = passes.findLast((pass) => (pass.relative_error ?? 0) > 0);
  const foretold = last?.grids?.seconds_to.find(({ relative_error }) => relative_error === to);
  if (foretold) return foretold.seconds ?? null;
  return last?.relative_error ? last.seconds * (last.relative_error / to) ** 2 : null;
}

/** The time left of a job that runs, in words. @param {number | null | undefined} seconds */
export const timeLeft = (seconds) => (seconds ? `, about ${foretold(seconds)} left`.replace("about >", ">") : "");

/** The chart of both logarithms. @param {Pass[]} passes @param {number | null} target @param {{ width: number, height: number }} [size] */
export function chart(passes, target, { width, height } = CHART) {
  const points = passes.flatMap(({ seconds, relative_error: error }) =>
    error && error > 0 && seconds > 0 ? [{ seconds, error }] : [],
  );
  if (!points.length) return nothing;
  const { right, top, bottom } = CHART;
  const decades = (/** @type {number[]} */ values) => [
    Math.floor(Math.log10(Math.min(...values)) + 1e-9),
    Math.max(Math.ceil(Math.log10(Math.max(...values)) - 1e-9), Math.floor(Math.log10(Math.min(...values)) + 1e-9) + 1),
  ];
  const [t0 = 0, t1 = 1] = decades(points.map(({ seconds }) => seconds));
  const [e0 = -3, e1 = 0] = decades([...points.map(({ error }) => error), target ?? 0.01]);
  const powers = (/** @type {number} */ from, /** @type {number} */ to) =>
    Array.from({ length: to - from + 1 }, (_, i) => 10 ** (from + i));
  const left = LABEL.around + LABEL.letter * Math.max(...powers(e0, e1).map((power) => percent(power).length));
  const x = (/** @type {number} */ seconds) => left + ((width - left - right) * (Math.log10(seconds) - t0)) / (t1 - t0);
  const y = (/** @type {number} */ error) => height - bottom - ((height - top - bottom) * (Math.log10(error) - e0)) / (e1 - e0);
  const last = points.at(-1);
  return svg`<svg class="chart" viewBox=${`0 0 ${width} ${height}`} role="img"
    aria-label=${`Error against time: ${percent(last?.error ?? 0)} after ${duration(last?.seconds ?? 0)}`}>
    ${powers(t0, t1).map(
      (power) => svg`<line
      class="rule" x1=${x(power)} x2=${x(power)} y1=${top} y2=${height - bottom}></line><text class="middle" x=${x(power)}
      y=${height - 10}>${power < 1 ? `${Number((1000 * power).toPrecision(1))}\u202fms` : `${power}\u202fs`}</text>`,
    )}
    ${powers(e0, e1).map(
      (power) => svg`<line
      class="rule" x1=${left} x2=${width - right} y1=${y(power)} y2=${y(power)}></line><text class="end" x=${left - 5}
      y=${y(power) + 4}>${percent(power)}</text>`,
    )}
    ${target ? svg`<line class="target" x1=${left} x2=${width - right} y1=${y(target)} y2=${y(target)}></line>` : nothing}
    <polyline class="curve" points=${points.map(({ seconds, error }) => `${x(seconds).toFixed(1)},${y(error).toFixed(1)}`).join(" ")}></polyline>
    ${last ? svg`<circle class="now" cx=${x(last.seconds)} cy=${y(last.error)} r="3.5"></circle>` : nothing}</svg>`;
}

/** What a job's errors tell of the time to others. @param {ErrorHistory} history */
export function times({ fit, times }) {
  const seconds = (/** @type {Schemas["TimeToAccuracy"]} */ { known, seconds, from_seconds, to_seconds }) => {
    if (!seconds) return "–";
    if (known === "met") return duration(seconds);
    const interval = seconds <= FARTHEST_SECONDS && from_seconds && to_seconds;
    return foretold(seconds) + (interval ? ` (${foretold(from_seconds)} to ${foretold(to_seconds)})` : "");
  };
  const words = { met: "met", extrapolated: "predicted", unknown: "unknown" };
  const row = (/** @type {Schemas["TimeToAccuracy"]} */ it) => html`<tr><th scope="row">${percent(it.relative_error)}</th>
    <td>${seconds(it)}</td><td>${words[it.known]}</td></tr>`;
  return html`<table><caption>Time to an accuracy, met or predicted from the passes</caption><tbody>${times.map(row)}</tbody></table>
    ${fit ? html`<p class="note">So far the standard error falls with the ${fit.exponent.toFixed(2).replace("-", "\u2212")} ± ${(fit.coverage_factor * fit.standard_error).toFixed(2)} (95\u202f%) power of the time.</p>` : nothing}`;
}

/** The part of the page about accuracy. */
export function accuracy() {
  const { passes, running, answer, target } = state;
  const last = passes.findLast((pass) => pass.relative_error !== null);
  const now = last?.relative_error ?? answer?.job.progress.relative_error ?? null;
  const button = (/** @type {number} */ error) => {
    const told = state.history?.times.find(({ relative_error, known }) => relative_error === error && known === "extrapolated");
    const seconds = told?.seconds ?? secondsTo(passes, error);
    // a job that runs goes on, the next one begins anew
    const spent = running ? (last?.seconds ?? 0) : 0;
    const text =
      now !== null && now <= error ? "reached" : seconds === null ? "" : `≈\u202f${foretold(Math.max(0, seconds - spent))}`.replace("≈\u202f>", ">");
    const go = () => {
      set({ target: error });
      if (now === null || now > error || !state.current) void live.sharpen();
    };
    return html`<button type="button" aria-pressed=${target === error}
      @click=${go}>${percent(error)} <small>${text}</small></button>`;
  };
  const seconds = duration(last?.seconds ?? answer?.job.progress.seconds ?? 0);
  const told =
    now === null
      ? "No error is known yet."
      : html`<strong id="error">${percent(now)}</strong> after ${seconds}, ${last?.passes ?? answer?.job.progress.passes} passes`;
  return html`<h2>Accuracy</h2>
    <p>${told}${running ? html` <span class="busy">sharpening to ${percent(running.asked)}${timeLeft(last?.seconds_left)}</span>` : nothing}</p>
    ${chart(passes, target)}
    <div class="targets" role="group" aria-label="Accuracy to sharpen to">${TARGETS.map(button)}</div>
    <p class="note">Times are predicted from the errors so far.</p>
    <button type="button" id="check" aria-pressed=${Boolean(state.draft?.cross_check)} title="A second, independent method computes the same"
      @click=${() => edit((draft) => (draft.cross_check = !draft.cross_check))}>Second opinion</button>
    <button type="button" class="cancel" ?disabled=${!running?.id} @click=${() => live.cancel()}>Stop</button>`;
}
