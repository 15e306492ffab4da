// The year of the draft: its job, what is read of it, and the search for what would do where it fails.
import { Refused, pauseAfter, problemOf } from "./api.js";
import { addTube, changed } from "./draft.js";
import { readNpy } from "./npy.js";
import { diameter } from "./tube.js";
import { hoursOf, inRows, lightNeeded } from "./year.js";
import { search } from "./year_search.js";
import { LIMITS, asked, judge } from "./year_sentence.js";

/** Largest error and longest time at which a year ends, and the rest of the hand before it begins. */
const STOP = { relative_error: 0.01, max_seconds: 60 };
const REST_MS = 500;
/** Largest number of further tubes that is tried, and of trials. */
const MOST = { count: 24, trials: 6 };

/** Things that a year and its search depend on. @typedef {{ draft: JobDocument, weather: string, schedule: import("./year.js").Schedule, error: number, lux: number, of: import("./goal.js").Goal["of"] }} Wanted */
/**
 * A year that was computed: the job, its first grid with autonomies and their errors by rows, and the hours.
 * @typedef {{ job: Job, grid: Grid, summary: Schemas["AnnualResult"], of: Schemas["GridYearResult"], autonomy: number[][],
 *   errors: number[][], hours: import("./year.js").YearHours, wanted: Wanted }} YearAnswer
 */
/**
 * Years as the page shows them.
 * @typedef {object} YearView
 * @property {Weather | null} weather
 * @property {boolean} synthetic whether the weather is the synthetic year
 * @property {string} fault what is wrong with a weather file
 * @property {boolean} reading whether a weather file is on its way
 * @property {import("./year.js").Schedule} schedule
 * @property {number} day of the weather file, from 1
 * @property {number} hour from which on the record lasts
 * @property {"autonomy" | "lux"} layer what the plan shows
 * @property {[number, number] | null} pin column and row of the point that is followed; null: the middle
 * @property {YearAnswer | null} answer the newest year; an older one while a new one is on its way
 * @property {boolean} current whether the answer is what is wanted now
 * @property {{ passes: number, error: number | null, ended: boolean } | null} running whether its passes have ended, too
 * @property {Problem | null} problem
 * @property {(import("./year_search.js").Search & { of: import("./goal.js").Goal["of"], times: number, diameter_m: number }) | null} search
 */

/** The document of a draft's year: the weather takes the place of sky, time and place; of lamps there is no year. @param {JobDocument} draft @param {NonNullable<JobDocument["annual"]>} annual @param {number} error relative error at which it ends */
export function yearDocument(draft, annual, error) {
  const document = structuredClone(draft);
  for (const name of /** @type {const} */ (["sky", "time", "location", "views", "surfaces", "cross_check"])) delete document[name];
  delete document.room.luminaires;
  for (const grid of document.grids ?? []) {
    delete grid.components;
    delete grid.responses;
  }
  return { ...document, annual, stop: { ...draft.stop, ...STOP, relative_error: error } };
}

/** @param {Wanted | null} a @param {Wanted | null} b */
const isYear = (a, b) =>
  a?.draft === b?.draft && /** @type {const} */ (["weather", "schedule", "error", "lux"]).every((name) => a?.[name] === b?.[name]);

export class YearJob {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;
  #work = new AbortController();
  /** Year that was asked for last. @type {Wanted | null} */
  #wanted = null;
  /** Jobs that the page made for itself: deleted once nothing shows them. @type {Set<string>} */
  #own = new Set();
  #service;
  #page;

  /**
   * @param {Pick<typeof import("./api.js"), "postJob" | "job" | "firstGrid" | "follow" | "deleteJob" | "get" | "bytes">} service
   * @param {Pick<typeof import("./state.js"), "state" | "set">} page
   */
  constructor(service, page) {
    this.#service = service;
    this.#page = page;
  }

  /** @param {Partial<YearView>} values */
  #tell(values) {
    this.#page.set({ year: { ...this.#page.state.year, ...values } });
  }

  /** Begins anew, after a rest of the hand, if what the year depends on has changed since the last call; ends all work outside the tab. */
  follow() {
    const { tab, draft, goal, target, year } = this.#page.state;
    const { weather, schedule, answer, search } = year;
    const error = Math.min(target, STOP.relative_error);
    /** @type {Wanted | null} */
    const wanted = tab === "year" && weather ? { draft, weather: weather.id, schedule, error, ...goal } : null;
    if (isYear(wanted, this.#wanted) && wanted?.of === this.#wanted?.of) return;
    this.#wanted = wanted;
    clearTimeout(this.#timer);
    this.#work.abort();
    const current = answer !== null && isYear(wanted, answer.wanted);
    // what was found for the year that is shown stays, also while the page shows a moment
    const isFound = search?.ended && (wanted ? current && search.of === wanted.of : year.current);
    this.#tell({ current: wanted ? current : year.current, running: null, search: isFound ? search : null, problem: null });
    if (wanted && !isFound) this.#timer = setTimeout(() => void (current ? this.#search(answer, wanted) : this.#compute(wanted)), REST_MS);
  }

  #begin() {
    this.#work.abort();
    this.#work = new AbortController();
    return this.#work.signal;
  }

  /** Computes a year, and looks for what would do where it fails. @param {Wanted} wanted */
  async #compute(wanted) {
    const signal = this.#begin();
    const heard = (/** @type {string} */ name, /** @type {any} */ data) => {
      if (name === "pass") this.#tell({ running: { passes: data.passes, error: data.relative_error ?? null, ended: false } });
      if (name === "phase") this.#tell({ running: { passes: data.passes, error: this.#page.state.year.running?.error ?? null, ended: true } });
    };
    this.#tell({ running: { passes: 0, error: null, ended: false }, problem: null });
    /** @type {Job | undefined} */
    let job;
    try {
      job = await this.#ended(wanted.draft, wanted, signal, heard);
      const answer = await this.#read(job, wanted, signal);
      signal.throwIfAborted();
      this.#release(this.#page.state.year.answer?.job.id);
      this.#tell({ answer, current: true, running: null });
      void this.#search(answer, wanted);
    } catch (error) {
      this.#release(job?.id);
      if (signal.aborted) return;
      this.#tell({ problem: problemOf(error), running: null });
      const pause = pauseAfter(error);
      if (pause !== null) this.#timer = setTimeout(() => void this.#compute(wanted), pause);
    }
  }

  /**
   * Runs the job of a draft's year until it ends.
   * @param {JobDocument} draft @param {Wanted} wanted @param {AbortSignal} signal @param {(name: string, data: any) => void} [heard]
   */
  async #ended(draft, { weather, schedule, error, lux }, signal, heard = () => {}) {
    const { id } = await this.#service.postJob(yearDocument(draft, asked(weather, schedule, lux), error));
    this.#own.add(id);
    try {
      signal.throwIfAborted();
      await this.#service.follow(id, heard, signal);
      const job = await this.#service.job(id, signal);
      if (job.problem) throw new Error(job.problem.detail);
      return job;
    } catch (failure) {
      this.#release(id);
      throw failure;
    }
  }

  /** Reads the year of a job's first grid. @param {Job} job @param {Wanted} wanted @param {AbortSignal} signal @returns {Promise<YearAnswer>} */
  async #read(job, wanted, signal) {
    const paths = job.links.annual ?? [];
    const path = (/** @type {string} */ ending) => paths.find((path) => path.includes("/annual/points.") && path.endsWith(ending)) ?? "";
    const [grid, summary, points, array] = await Promise.all([
      this.#service.firstGrid(job, signal),
      this.#service.get(paths[0] ?? "", signal).then((read) => /** @type {Schemas["AnnualResult"]} */ (read)),
      this.#service.get(path(".json"), signal).then((read) => /** @type {Schemas["PointsYearResult"]} */ (read)),
      this.#service.bytes(path(".npy"), signal),
    ]);
    const of = summary.grids[0];
    if (!grid || !of) throw new Error("the job has no grid");
    const { year_of_sun: year, records_per_hour: perHour } = summary.conventions;
    const [month = 1, date = 1] = (this.#page.state.year.weather?.report.from ?? "01-01").split("-").map(Number);
    const day = Math.round((Date.UTC(year, month - 1, date) - Date.UTC(year, 0)) / 86_400_000) + 1;
    const hours = hoursOf(readNpy(array), grid, perHour, { year, day });
    const shares = points.columns.find(({ name }) => name === `da_${wanted.lux}_percent`);
    const [autonomy, errors] = [shares?.values, shares?.standard_errors].map((of) => inRows(hours, (sensor) => of?.[sensor] ?? NaN));
    return { job, grid, summary, of, hours, wanted, autonomy: autonomy ?? [], errors: errors ?? [] };
  }

  /** Tries further tubes where a year fails. @param {YearAnswer} answer @param {Wanted} wanted */
  async #search(answer, wanted) {
    const { draft, schedule, lux, of } = wanted;
    const tubes = draft.tubes ?? [];
    if (judge(answer.of, wanted).is !== "fail") return;
    const signal = this.#begin();
    const more = (/** @type {number} */ count) => changed(draft, (next) => Array.from({ length: count }, () => addTube(next)));
    const times = lightNeeded(answer.hours, schedule, lux, LIMITS[of]);
    const added = more(1).tubes?.at(-1);
    const known = { of, times, diameter_m: added ? diameter(added) : 0 };
    const trial = async (/** @type {number} */ count) => {
      try {
        const job = await this.#ended(more(count), wanted, signal);
        const read = this.#service.get(job.links.annual?.[0] ?? "", signal);
        /** @type {Schemas["AnnualResult"]} */
        const summary = await read.finally(() => this.#release(job.id));
        const grid = summary.grids[0];
        const found = grid && judge(grid, wanted);
        return found ? { count, value: found.value, passes: found.is === "pass" } : null;
      } catch (error) {
        // a tube that has no room; other faults are not of the number of tubes
        if (error instanceof Refused && error.problem.errors?.some(({ pointer }) => pointer === "/tubes" || pointer.startsWith("/tubes/"))) return null;
        throw error;
      }
    };
    const told = (/** @type {import("./year_search.js").Search} */ found) => !signal.aborted && this.#tell({ search: { ...found, ...known } });
    const begun = { tried: [], count: null, isLeast: false, ended: false };
    told(begun);
    const guess = Number.isFinite(times) ? Math.ceil(tubes.length * (times - 1)) : MOST.count;
    await search(trial, guess, MOST, told).catch((error) => {
      if (!signal.aborted) this.#tell({ search: null, problem: problemOf(error) });
    });
  }

  /** Keeps the job that is shown, because somebody refers to it. */
  keep() {
    const id = this.#page.state.year.answer?.job.id;
    if (id) this.#own.delete(id);
  }

  /** Deletes a job of the page's own. @param {string | undefined} id */
  #release(id) {
    if (id && this.#own.delete(id)) void this.#service.deleteJob(id);
  }

  /** Deletes all jobs of the page's own. */
  leave() {
    this.#own.forEach((id) => this.#release(id));
  }
}
