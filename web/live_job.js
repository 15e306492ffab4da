// The jobs that keep the result up with the draft: a short one at every change, one at a time, and a sharper one when the hand rests.
import { ofFirst, pauseAfter, problemOf } from "./api.js";

/** Error and time after which the first answer comes. */
const FIRST = { relative_error: 0.05, max_seconds: 0.2 };
/** Longest time to sharpen by itself, and when asked to. */
const BY_ITSELF_SECONDS = 20;
const ASKED_SECONDS = 600;
/** Rest of the hand before the result is sharpened, and time after which a first answer to an older draft is given up. */
const REST_MS = 350;
const LATE_MS = 1500;
/** Pause between looks at the grid of a job that sharpens. */
const LOOK_MS = 700;

/**
 * Phases, and what ends each; a change of the draft ends all but `stale`, and a call of `sharpen` ends every one:
 * - `idle`: nothing is computed;
 * - `answering`: the first answer is on its way; it leads to `resting`, or to `posting` where it ran out of time, a change to `stale`, an
 *   error to `waiting` or `failed`;
 * - `stale`: the first answer to an older draft is on its way; with it, with an error, or once it is late, `answering` begins anew;
 * - `resting`: the draft has its first answer; after a rest of the hand it leads to `posting`, or to `idle` where that is sharp enough;
 * - `posting`: the job that sharpens is being posted; it leads to `running`, an error to `waiting` or `failed`;
 * - `running`: the job that sharpens runs; its end leads to `idle` or `failed`, an error to `waiting` or `failed`;
 * - `waiting`: the service was busy or away; after a pause it is asked for the same again;
 * - `failed`: the service refused the draft, or its job failed.
 * @typedef {"idle" | "answering" | "stale" | "resting" | "posting" | "running" | "waiting" | "failed"} Phase
 */

/** A key of its own for a post; `randomUUID` is not there on pages of plain HTTP beyond loopback. */
const randomKey = () =>
  Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");

/** A point of the curve of error against time, of a job without events. @param {Job} job @returns {Pass} */
const reached = ({ progress: { passes, seconds, relative_error = null } }) => ({ passes, seconds, relative_error });

export class LiveJob {
  /** @type {Phase} */
  phase = "idle";
  /** True while a hand holds something: nothing is sharpened meanwhile. */
  held = false;
  /** End of the phase after a pause. @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;
  /** Abort of the work that is on its way, for what takes its place. */
  #work = new AbortController();
  /** Time at which the first answer was asked for. */
  #asked = 0;
  /** Counts changes: an answer to an older one never replaces a newer one's. */
  #changes = 0;
  #shown = 0;
  /** Jobs that the page made for itself: deleted once nothing shows them. @type {Set<string>} */
  #own = new Set();
  #service;
  #page;

  /**
   * @param {Pick<typeof import("./api.js"), "postJob" | "job" | "firstGrid" | "convergence" | "follow" | "cancelJob" | "deleteJob">} service
   * @param {Pick<typeof import("./state.js"), "state" | "set">} page
   */
  constructor(service, page) {
    this.#service = service;
    this.#page = page;
  }

  /** Enters a phase. @param {Phase} phase @param {number} [pauseMs] @param {() => void} [ends] ends it after the pause */
  #enter(phase, pauseMs, ends) {
    clearTimeout(this.#timer);
    this.phase = phase;
    if (ends) this.#timer = setTimeout(ends, pauseMs);
  }

  /** Begins work in the place of what is on its way. @param {"answering" | "posting"} phase */
  #begin(phase) {
    const { state, set } = this.#page;
    this.#work.abort();
    this.#work = new AbortController();
    this.#enter(phase);
    const id = state.running?.id;
    set({ running: null });
    if (id !== state.answer?.job.id) this.#release(id);
    return this.#work.signal;
  }

  /** Computes a draft that was changed: at once, or after the answer that is on its way. */
  changed() {
    this.#changes++;
    const late = this.#asked + LATE_MS - performance.now();
    if (this.phase === "answering") this.#enter("stale", late, () => void this.#answer());
    else if (this.phase !== "stale") void this.#answer();
  }

  /** Notes that a hand took something, or let it go. @param {boolean} held */
  hold(held) {
    this.held = held;
    if (this.phase === "resting") this.#rest();
  }

  #rest() {
    const { state } = this.#page;
    const isSharp = () => (state.answer?.job.accuracy?.relative_error ?? 1) <= state.target;
    const ends = () => (isSharp() ? this.#enter("idle") : void this.sharpen(BY_ITSELF_SECONDS));
    this.#enter("resting", REST_MS, this.held ? undefined : ends);
  }

  async #answer() {
    const { state } = this.#page;
    const signal = this.#begin("answering");
    this.#asked = performance.now();
    const change = this.#changes;
    const key = randomKey();
    const draft = { ...state.draft, views: [], stop: { ...state.draft.stop, ...FIRST } };
    try {
      const job = await this.#service.postJob(draft, { wait: 10, key, signal });
      this.#own.add(job.id);
      const answer = job.status === "failed" ? { job, grid: null } : await this.#ended(job, signal);
      signal.throwIfAborted();
      if (answer.job.status === "failed") this.#unanswered(answer.job);
      else this.#answered(change, answer);
    } catch (error) {
      if (signal.aborted) void this.#forget(draft, key);
      else this.#failed(error, () => void this.#answer());
    }
  }

  /** Returns a posted job with its grid, also one that takes longer than the answer. @param {FinishedJob} posted @param {AbortSignal} signal */
  async #ended(posted, signal) {
    if (posted.grid_results) return { job: posted, grid: ofFirst(posted, posted.grid_results) ?? null };
    await this.#service.follow(posted.id, () => {}, signal);
    const job = await this.#service.job(posted.id, signal);
    return { job, grid: await this.#service.firstGrid(job, signal) };
  }

  /** Takes the first answer. @param {number} change that it answers @param {Answer} answer */
  #answered(change, answer) {
    this.#show(change, answer);
    if (this.phase === "stale") void this.#answer();
    else this.#rest();
  }

  /** Takes a first answer that failed: a room whose passes take longer than that may is sharpened at once. @param {Job} job */
  #unanswered(job) {
    this.#release(job.id);
    if (job.stopped_by !== "max_seconds") throw new Error(job.problem?.detail ?? "the job failed");
    if (this.phase === "stale") void this.#answer();
    else void this.sharpen(BY_ITSELF_SECONDS);
  }

  /** Takes the failure of what is on its way. @param {unknown} error @param {() => void} again asks for the same again */
  #failed(error, again) {
    if (this.phase === "stale") return void this.#answer();
    this.#page.set({ problem: problemOf(error), running: null });
    const pause = pauseAfter(error);
    if (pause === null) this.#enter("failed");
    else this.#enter("waiting", pause, again);
  }

  /**
   * Deletes the job of a post whose answer nobody waited for: the same post with its key names it.
   * @param {JobDocument} draft
   * @param {string} key
   */
  async #forget(draft, key) {
    const job = await this.#service.postJob(draft, { key }).catch(() => null);
    if (job) await this.#service.deleteJob(job.id);
  }

  /**
   * Computes the draft to the target, with the errors told as they fall.
   * @param {number} [seconds]
   * @param {number} [target]
   */
  async sharpen(seconds = ASKED_SECONDS, target = this.#page.state.target) {
    const { state, set } = this.#page;
    const signal = this.#begin("posting");
    const change = this.#changes;
    const before = state.passes;
    const draft = { ...state.draft, views: [], stop: { ...state.draft.stop, relative_error: target, max_seconds: seconds } };
    set({ running: { id: null, asked: target } });
    try {
      const posted = await this.#service.postJob(draft);
      if (signal.aborted) return void this.#service.deleteJob(posted.id);
      if (seconds < ASKED_SECONDS) this.#own.add(posted.id);
      this.#enter("running");
      set({ running: { id: posted.id, asked: target }, passes: [] });
      let looked = performance.now();
      const heard = (/** @type {string} */ name, /** @type {any} */ data) => {
        if (name !== "pass") return;
        set({ passes: [...state.passes, data] });
        if (performance.now() - looked <= LOOK_MS) return;
        looked = performance.now();
        void this.#look(posted, change, signal);
      };
      await this.#service.follow(posted.id, heard, signal);
      const job = await this.#service.job(posted.id, signal);
      const grid = await this.#service.firstGrid(job, signal);
      const { grids: history = null } = await this.#service.convergence(job.id, signal);
      signal.throwIfAborted();
      if (grid) this.#show(change, { job, grid });
      this.#sharpened(job, history, before);
    } catch (error) {
      if (!signal.aborted) this.#failed(error, () => void this.sharpen(seconds, target));
    }
  }

  /** Shows what a job that runs has. @param {Job} posted @param {number} change that it answers @param {AbortSignal} signal */
  async #look(posted, change, signal) {
    const grid = await this.#service.firstGrid(posted, signal);
    const job = await this.#service.job(posted.id, signal).catch(() => null);
    const runs = this.phase === "running" && !signal.aborted;
    if (job && grid && runs && !this.#page.state.answer?.stored) this.#show(change, { job, grid });
  }

  /**
   * Takes the end of the job that sharpens.
   * @param {Job} job
   * @param {ErrorHistory | null} history
   * @param {Pass[]} before curve of the answer that it was to replace
   */
  #sharpened(job, history, before) {
    const { state, set } = this.#page;
    if (state.answer?.job.id === job.id) set({ history });
    else (set({ passes: before }), this.#release(job.id));
    if (job.problem) set({ problem: problemOf(new Error(job.problem.detail)) });
    set({ running: null });
    this.#enter(job.problem ? "failed" : "idle");
  }

  /**
   * Shows an answer, unless a newer draft's or a better one is shown.
   * @param {number} change that it answers
   * @param {Answer} answer
   */
  #show(change, answer) {
    const { state, set } = this.#page;
    const [before, { id }] = [state.answer, answer.job];
    const runs = state.running?.id === id;
    const error = (/** @type {Job} */ job) => job.progress.relative_error ?? Infinity;
    // the first look at a job that sharpens may be worse than what is shown
    const isWorse = before && before.job.id !== id && !before.stored && error(before.job) < error(answer.job);
    if (change < this.#shown || (change === this.#shown && isWorse)) return runs ? undefined : this.#release(id);
    this.#shown = change;
    if (before?.job.id !== id) this.#release(before?.job.id);
    const current = change === this.#changes;
    set({ answer, current, passes: runs ? state.passes : [reached(answer.job)], history: null, ...(current ? { problem: null } : {}) });
  }

  /**
   * Shows a draft with its stored result, which has no files in this service: a job of its own takes its place.
   * @param {JobDocument} draft @param {Answer} answer
   */
  present(draft, answer) {
    const { state, set } = this.#page;
    this.#shown = ++this.#changes;
    this.#release(state.answer?.job.id);
    const passes = [reached(answer.job)];
    set({ draft, answer: { ...answer, stored: true }, current: true, problem: null, passes, history: null });
    void this.sharpen(BY_ITSELF_SECONDS, Math.max(passes[0]?.relative_error ?? state.target, 1e-3));
  }

  /** Stops the job that sharpens; its result so far is shown where it is better. */
  cancel() {
    const id = this.#page.state.running?.id;
    if (!id) return;
    this.#own.delete(id);
    void this.#service.cancelJob(id);
  }

  /** Keeps the job that is shown, because somebody refers to it. */
  keep() {
    const id = this.#page.state.answer?.job.id;
    if (id) this.#own.delete(id);
  }

  /** Deletes a job of the page's own. @param {string | null | undefined} id */
  #release(id) {
    if (id && this.#own.delete(id)) void this.#service.deleteJob(id);
  }

  /** Deletes all jobs of the page's own: what nobody sees any more takes no place in the service. */
  leave() {
    this.#own.forEach((id) => this.#release(id));
  }
}
