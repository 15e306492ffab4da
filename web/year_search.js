// The search for the number of further tubes with which a room would pass: few trials, from a guess on.

/** A trial with further tubes: what it gives in percent, and whether it passes. @typedef {{ count: number, value: number, passes: boolean }} Trial */
/**
 * Trials of a search; the least number that passes, null where none did; whether the number below fails.
 * @typedef {{ tried: Trial[], count: number | null, isLeast: boolean, ended: boolean }} Search
 */

/**
 * Looks for the least number of further tubes that passes: more while trials fail, then between those that fail and pass. It is the least
 * as far as more tubes never give less.
 * @param {(count: number) => Promise<Trial | null>} trial tries a number; null where so many have no room
 * @param {number} guess number to begin with
 * @param {{ count: number, trials: number }} most
 * @param {(search: Search) => void} told hears of each trial
 */
export async function search(trial, guess, most, told) {
  /** @type {Search} */
  const found = { tried: [], count: null, isLeast: false, ended: false };
  let [fails, ceiling] = [0, most.count];
  let next = Math.max(1, Math.min(ceiling, guess));
  for (let trials = 0; trials < most.trials && !found.isLeast && fails < ceiling; trials++) {
    const it = await trial(next);
    if (it) found.tried.push(it);
    if (it?.passes) found.count = next;
    else if (it) fails = next;
    else ceiling = next - 1;
    found.isLeast = found.count === fails + 1;
    told({ ...found });
    const above = found.count ?? ceiling + 1;
    next = found.count === null ? Math.min(ceiling, Math.max(fails + 1, Math.ceil(1.5 * fails))) : Math.floor((fails + above) / 2);
    if (it === null) next = Math.max(1, Math.min(ceiling, Math.ceil((fails + ceiling) / 2)));
  }
  told({ ...found, ended: true });
}

/** @param {number} count */
const tubes = (count) => (count === 1 ? "1 more tube" : `${count} more tubes`);

/** The search in words. @param {Search} search @param {number} diameter_m of the tubes @param {number | null} times the light that it takes, about */
export function inWords({ tried, count, isLeast, ended }, diameter_m, times) {
  const light = times !== null && Number.isFinite(times) && times > 1 ? `It takes about ${times.toPrecision(2)} times the light. ` : "";
  const of = (/** @type {boolean} */ enough) => tried.filter(({ passes }) => passes === enough).toSorted((a, b) => a.count - b.count);
  const list = (/** @type {string} */ name, /** @type {Trial[]} */ trials) =>
    trials.length ? [`${name}: ${trials.map(({ count, value }) => `${count} with ${value.toFixed(0)}\u202f%`).join(", ")}`] : [];
  const lists = [...list("not surely enough", of(false)), ...list("enough", of(true))];
  const told = lists.length ? ` (${lists.join("; ")})` : "";
  if (!ended) return `${light}Looking for the number of tubes that would do${told} …`;
  if (count === null) return `${light}${tried.length ? `No number of more tubes of ${diameter_m} m that was tried would do${told}.` : `No more tubes of ${diameter_m} m have room.`}`;
  return `${light}${isLeast ? "About" : "At most about"} ${tubes(count)} of ${diameter_m} m would do${told}.`;
}
