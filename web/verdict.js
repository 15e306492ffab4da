// The answer in a sentence: whether the room has the light that is asked for, by the interval of 95 %.
import { at } from "./cities.js";
import { dayName, hourName, read } from "./clock.js";
import { choice, number } from "./field.js";
import { PARTS, WORDS, words } from "./goal.js";
import { coverage, digits } from "./scale.js";
import { skyName } from "./sky.js";
import { set, state } from "./state.js";
import { html } from "./vendor/lit-html.js";

/** The mean, and the ends of its interval; infinite where its error is not known. @param {Answer} answer */
function mean({ job, grid }) {
  const of = grid?.statistics;
  const value = of?.mean_lux ?? 0;
  const error = of?.mean_lux_standard_error;
  const half = error === null || error === undefined ? Infinity : coverage(of, job.progress.passes) * error;
  return { value, half, from: value - half, to: value + half };
}

/** The percentage of the area that has an illuminance, and what it is if all cells lie at the lower or upper end of their intervals. @param {Answer} answer @param {number} lux */
function share({ job, grid }, lux) {
  const times = coverage(grid ?? undefined, job.progress.passes);
  const sums = { all: 0, value: 0, from: 0, to: 0 };
  for (const [j, row] of (grid?.illuminance_lux ?? []).entries())
    for (const [i, value] of row.entries()) {
      if (value === null) continue;
      const half = times * (grid?.standard_error_lux[j]?.[i] ?? Infinity);
      const area = grid?.area_m2?.[j]?.[i] ?? 1;
      sums.all += area;
      if (value >= lux) sums.value += area;
      if (value - half >= lux) sums.from += area;
      if (value + half >= lux) sums.to += area;
    }
  const percent = (/** @type {number} */ area) => (sums.all ? (100 * area) / sums.all : 0);
  return { value: percent(sums.value), from: percent(sums.from), to: percent(sums.to) };
}

/**
 * Whether a target is met.
 * @param {Answer} answer
 * @param {import("./goal.js").Goal} goal
 * @returns {{ is: "yes" | "no" | "not sure", mean: ReturnType<typeof mean>, share: ReturnType<typeof share> }}
 */
export function verdict(answer, { lux, of }) {
  const found = { mean: mean(answer), share: share(answer, lux) };
  const [{ from, to }, least] = of === "mean" ? [found.mean, lux] : [found.share, PARTS[of]];
  return { is: from >= least ? "yes" : to < least ? "no" : "not sure", ...found };
}

/** What parts of a grid are parts of, in words. @param {{ points_m?: unknown } | null} [grid] */
export const whole = (grid) => (grid?.points_m ? "sensors" : "area");

/** The same with the verb of what it has. @param {{ points_m?: unknown } | null} [grid] */
export const has = (grid) => `${whole(grid)} ${grid?.points_m ? "have" : "has"}`;

/** When and below which sky, in words. @param {JobDocument} document */
export function when({ time, sky, location }) {
  const { year, day, hour } = read(time);
  const clock = hour === 12 ? "noon" : hour === 0 ? "midnight" : hourName(hour);
  const city = at(state.cities, location)?.name;
  const sun = sky?.sun_position;
  const moment = sun ? ` with the sun ${sun.altitude_deg}° high` : time ? ` at ${clock} on ${dayName(year, day)}${city ? ` in ${city}` : ""}` : "";
  return [moment, ...(skyName(sky) ? [skyName(sky)] : [])].join(", ");
}

/** The sentence in words: what is asked for, and what is found. @param {Answer} answer @param {import("./goal.js").Goal} goal */
export function sentence(answer, goal) {
  const { is, mean, share } = verdict(answer, goal);
  const part = goal.of === "mean" ? "" : ` ${words(goal.of)}`;
  // no more digits than tell it from the target
  const rough = Math.min(mean.value / 10, Math.abs(mean.value - goal.lux));
  const lux = digits(mean.value, Number.isFinite(mean.half) ? Math.max(mean.half, rough) : 0.5);
  const found = goal.of === "mean" ? `${lux}\u202flx` : `${share.value.toFixed(0)}\u202f% of the ${has(answer.grid)} it`;
  return { asked: `${goal.lux}\u202flx${part}`, is, found: `${found}${when(answer.job.document)}.` };
}

/** The sentence, with what the verdict is by. @param {Answer} answer @param {import("./goal.js").Goal} goal */
export function judged(answer, goal) {
  const { asked, is, found } = sentence(answer, goal);
  const { share, mean } = verdict(answer, goal);
  const by = Number.isFinite(mean.half)
    ? `Judged by the 95\u202f% interval of ${goal.of === "mean" ? "the mean" : "each cell's illuminance"}.`
    : "The error is not known yet.";
  const also = goal.of === "mean" ? ` ${share.value.toFixed(0)}\u202f% of the ${has(answer.grid)} ${goal.lux}\u202flx or more.` : "";
  return html`<p class=${`verdict ${is.replace(" ", "-")}`}>${asked}: <strong id="verdict">${is}.</strong> ${found}</p>
    <p class="note">${by}${also}</p>`;
}

/** The form of the target. */
export function target() {
  const { goal } = state;
  return html`<div class="pair goal">
    ${number({ pointer: "/target/lux", label: "Target", unit: "lx", value: goal.lux, step: 50, min: 1, set: (lux) => lux > 0 && set({ goal: { ...state.goal, lux } }) })}
    ${choice({ pointer: "/target/of", label: "To be met", value: goal.of, options: WORDS, set: (of) => set({ goal: { ...state.goal, of } }) })}</div>`;
}
