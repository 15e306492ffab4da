// The answer of a year in a sentence: whether the target is met in half of the hours that count, by the interval of 95 %.
import { PARTS, words } from "./goal.js";

/** @typedef {import("./goal.js").Goal} Goal */
/** @typedef {import("./year.js").Schedule} Schedule */
/** A share in percent with its interval, the limit that it is held against, and the outcome. @typedef {{ value: number, low: number, high: number, limit: number, is: "pass" | "fail" | "undecided" }} Found */

/** Share of the hours in percent in which a point must have the target. */
const HALF = 50;
/** Limits in percent: of hours for the mean, of the area else. */
export const LIMITS = { mean: HALF, ...PARTS };

/** @type {[Schedule, string][]} */
export const SCHEDULES = [
  ["daylight_hours", "daylight hours"],
  ["lm83", "hours from 8 to 18"],
  ["weekdays", "hours from 8 to 18 on weekdays"],
];

/** Outcomes in words. */
export const OUTCOMES = { pass: "passes", fail: "fails", undecided: "undecided" };

/** Part of a job document that asks for the year by which a target is judged. @param {string} weather @param {Schedule} schedule @param {number} lux @returns {NonNullable<JobDocument["annual"]>} */
export const asked = (weather, schedule, lux) => ({
  weather,
  schedule: schedule === "weekdays" ? { kind: "weekly", days: ["mon", "tue", "wed", "thu", "fri"], from: "08:00", to: "18:00" } : { kind: schedule },
  thresholds_lux: [...new Set([100, 300, 500, 750, lux])].sort((a, b) => a - b),
  sda: { threshold_lux: lux, time_percent: HALF },
});

/**
 * Compares a grid's year with a target: the part of the area that has it in half of the hours, or, for a target in the mean, the part of
 * the hours in which a point has it, in the mean over the area. What the year has no number of is not a number.
 * @param {Schemas["GridYearResult"]} grid @param {Goal} goal @param {Schemas["SdaDocument"]} [sda] what its year's autonomy of the area is by
 * @returns {Found}
 */
export function judge(grid, { lux, of }, sda = {}) {
  const autonomy = grid.autonomies.find((autonomy) => autonomy.lux === lux)?.da_percent;
  const area = (sda.threshold_lux ?? lux) === lux ? grid.sda_percent : undefined;
  const { value, low, high } = (of === "mean" ? autonomy : area) ?? { value: NaN, low: NaN, high: NaN };
  const limit = of === "mean" ? (sda.time_percent ?? HALF) : LIMITS[of];
  return { value, low, high, limit, is: low >= limit ? "pass" : high < limit ? "fail" : "undecided" };
}

/** A value and its interval with no more digits than tell them from the limit, and the ends from each other. @param {Omit<Found, "is">} found @param {string} unit */
export function bracketed({ value, low, high, limit }, unit) {
  const all = [value, low, high];
  const tells = (/** @type {number} */ places) =>
    all.every((of) => of === limit || Number(of.toFixed(places)) !== limit) && (low === high || low.toFixed(places) !== high.toFixed(places));
  const places = [0, 1].find(tells) ?? 2;
  const [of, from, to] = all.map((number) => number.toFixed(places));
  return `${of}\u202f${unit} [${from},\u202f${to}]`;
}

/**
 * The sentence in words: what is asked for, the outcome, and what is found.
 * @param {Schemas["GridYearResult"]} grid @param {Goal} goal @param {string} schedule a name of a schedule, or a kind of them
 * @param {Schemas["SdaDocument"]} [sda] what the autonomy of the area is by
 */
export function yearSentence(grid, goal, schedule, sda) {
  const found = judge(grid, goal, sda);
  const hours = SCHEDULES.find(([name]) => name === schedule)?.[1] ?? "hours that count";
  const share = sda?.time_percent ?? HALF;
  const where = goal.of === "mean" ? ", in the mean over the area" : "";
  const asked = `${goal.lux}\u202flx${goal.of === "mean" ? "" : ` ${words(goal.of)}`} for ${share === HALF ? "half" : `${share}\u202f%`} of the ${hours}${where}`;
  const of = goal.of === "mean" ? " of the hours" : "";
  return { asked, is: OUTCOMES[found.is], found: `${bracketed(found, `%${of}`)}.`, outcome: found.is };
}

/** A criterion of a standard or a scheme in words. @param {Schemas["VerdictResult"]} verdict */
export function criterion({ scheme, clause, limit, unit = "", verdict, ...of }) {
  return { name: `${scheme}, ${clause}`, is: OUTCOMES[verdict], found: bracketed({ ...of, limit }, unit), limit: `${limit}\u202f${unit}` };
}
