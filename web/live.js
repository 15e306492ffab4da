// Keeps the result up with the draft: a short job at every change, one at a time, and a sharper one when the hand rests.
import * as api from "./api.js";
import { changed } from "./draft.js";
import { set, state } from "./state.js";

/** Error and time after which the first answer comes. */
const FIRST = { relative_error: 0.05, max_seconds: 0.2 };
/** Longest time to sharpen by itself, and when asked to. */
const BY_ITSELF_SECONDS = 20;
const ASKED_SECONDS = 600;
/** Rest of the hand before the result is sharpened, and before a first answer that is late is given up. */
const REST_MS = 350;
const LATE_MS = 1500;
/** Pause between looks at the grid of a job that sharpens. */
const LOOK_MS = 700;
/** Pause before a service that does not answer is asked again. */
const RETRY_MS = 1000;

/** Pause before what failed is tried again; null where it would fail again. @param {unknown} error @returns {number | null} */
export const pauseAfter = (error) =>
  error instanceof TypeError ? RETRY_MS : error instanceof api.Refused ? error.againMs : null;

/** Counts changes: an answer to an older one never replaces a newer one's. */
let sequence = 0;
let shown = 0;
/** @type {{ abort: AbortController, since: number } | null} */
let first = null;
let again = false;
/** @type {AbortController | null} */
let sharpening = null;
/** @type {ReturnType<typeof setTimeout> | undefined} */
let rest;
/** @type {ReturnType<typeof setTimeout> | undefined} */
let retry;
/** Jobs that the page made for itself: deleted once nothing shows them. @type {Set<string>} */
const own = new Set();
let held = false;
/** A movement of the hand is one step to go back. */
let begun = false;
/** How many steps back are kept. */
const STEPS = 200;

/** Changes the draft, and computes it. @param {(draft: JobDocument) => void} change */
export function edit(change) {
  if (!begun) set({ past: [...state.past.slice(1 - STEPS), state.draft] });
  begun = held;
  use(changed(state.draft, change));
}

/** Goes back before the last change. */
export function undo() {
  const draft = state.past.at(-1);
  if (!draft || held) return;
  set({ past: state.past.slice(0, -1) });
  use(draft);
}

/** Takes a draft over, and computes it. @param {JobDocument} draft */
export function use(draft) {
  set({ draft, current: false, problem: null });
  compute();
}

/** Computes the draft: at once, or after the answer that is on its way. */
export function compute() {
  sequence++;
  clearTimeout(rest);
  clearTimeout(retry);
  stopSharpening();
  if (!first) void answerFirst();
  else {
    again = true;
    if (performance.now() - first.since > LATE_MS) first.abort.abort();
  }
}

/** While a hand holds something, nothing is sharpened. @param {boolean} now */
export function hold(now) {
  held = now;
  begun = false;
  if (!now) restSoon();
}

function restSoon() {
  clearTimeout(rest);
  if (held || first || again || !state.current) return;
  rest = setTimeout(() => {
    if ((state.answer?.job.accuracy?.relative_error ?? 1) > state.target) void sharpen(BY_ITSELF_SECONDS);
  }, REST_MS);
}

/** A key of its own for a post; `randomUUID` is not there on pages of plain HTTP beyond loopback. */
const randomKey = () =>
  Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");

async function answerFirst() {
  const mine = sequence;
  const abort = new AbortController();
  const key = randomKey();
  const draft = { ...state.draft, views: [], stop: { ...state.draft.stop, ...FIRST } };
  first = { abort, since: performance.now() };
  const late = setTimeout(() => again && abort.abort(), LATE_MS);
  try {
    const job = await api.postJob(draft, { wait: 10, key, signal: abort.signal });
    own.add(job.id);
    if (job.status === "failed") throw new Error(job.problem?.detail ?? "the job failed");
    const grid = job.grid_results ? (Object.values(job.grid_results)[0] ?? null) : await ended(job.id, abort.signal);
    show(mine, { job: grid && !job.grid_results ? await api.job(job.id) : job, grid });
  } catch (error) {
    if (abort.signal.aborted) void forget(draft, key);
    else if (mine === sequence) {
      set({ problem: problemOf(error) });
      const pause = pauseAfter(error);
      if (pause !== null) retry = setTimeout(compute, pause);
    }
  } finally {
    clearTimeout(late);
    first = null;
    if (again) {
      again = false;
      void answerFirst();
    } else restSoon();
  }
}

/** The grid of a job that took longer than the answer. @param {string} id @param {AbortSignal} signal */
async function ended(id, signal) {
  await api.follow(id, () => {}, signal);
  return api.firstGrid(await api.job(id));
}

/**
 * Deletes the job of a post whose answer nobody waited for: the same post with its key names it.
 * @param {JobDocument} draft
 * @param {string} key
 */
async function forget(draft, key) {
  const job = await api.postJob(draft, { key }).catch(() => null);
  if (job) await api.deleteJob(job.id);
}

/** @param {unknown} error @returns {Problem} */
export function problemOf(error) {
  if (error instanceof api.Refused) return error.problem;
  const detail =
    error instanceof TypeError ? "the service does not answer" : String(error instanceof Error ? error.message : error);
  return { type: "about:blank", title: "No answer", status: 0, detail, instance: "" };
}

/**
 * Shows an answer, unless a newer draft's or a better one is shown.
 * @param {number} of the change that it answers
 * @param {Answer} answer
 */
function show(of, answer) {
  const before = state.answer?.job;
  const error = (/** @type {Job | undefined} */ job) => job?.progress.relative_error ?? Infinity;
  const worse =
    of === shown && before && before.id !== answer.job.id && !state.answer?.stored && error(before) < error(answer.job);
  // the first look at a job that sharpens may be worse than what is shown
  if (of < shown || worse) return state.running?.id === answer.job.id ? undefined : release(answer.job.id);
  shown = of;
  if (before?.id !== answer.job.id) release(before?.id);
  const { passes, seconds, relative_error = null } = answer.job.progress;
  const points = state.running?.id === answer.job.id ? state.passes : [{ passes, seconds, relative_error }];
  set({ answer, current: of === sequence, passes: points, history: null, problem: of === sequence ? null : state.problem });
}

/** Deletes a job of the page's own. @param {string | undefined} id */
function release(id) {
  if (id && own.delete(id)) void api.deleteJob(id);
}

/** Keeps the job that is shown, because somebody refers to it. @returns {string | undefined} */
export function keep() {
  const id = state.answer?.job.id;
  if (id) own.delete(id);
  return id;
}

function stopSharpening() {
  if (!sharpening) return;
  sharpening.abort();
  sharpening = null;
  const id = state.running?.id ?? undefined;
  set({ running: null });
  if (id !== state.answer?.job.id) release(id);
}

/**
 * Computes the draft to the target, with the errors told as they fall.
 * @param {number} [seconds]
 * @param {number} [target]
 */
export async function sharpen(seconds = ASKED_SECONDS, target = state.target) {
  stopSharpening();
  clearTimeout(rest);
  clearTimeout(retry);
  const mine = sequence;
  const abort = new AbortController();
  sharpening = abort;
  const before = state.passes;
  const draft = { ...state.draft, views: [], stop: { ...state.draft.stop, relative_error: target, max_seconds: seconds } };
  set({ running: { id: null, since: performance.now(), asked: target } });
  try {
    const posted = await api.postJob(draft);
    if (seconds < ASKED_SECONDS) own.add(posted.id);
    if (abort.signal.aborted) return void (own.delete(posted.id), api.deleteJob(posted.id));
    set({ running: { id: posted.id, since: performance.now(), asked: target }, passes: [] });
    let looked = performance.now();
    const look = async () => {
      looked = performance.now();
      const grid = await api.firstGrid(posted, abort.signal);
      const job = await api.job(posted.id, abort.signal).catch(() => null);
      if (job && grid && !abort.signal.aborted && !state.answer?.stored) show(mine, { job, grid });
    };
    await api.follow(
      posted.id,
      (name, data) => {
        if (name !== "pass") return;
        set({ passes: [...state.passes, data] });
        if (performance.now() - looked > LOOK_MS) void look();
      },
      abort.signal,
    );
    const job = await api.job(posted.id, abort.signal);
    const grid = await api.firstGrid(job, abort.signal);
    if (abort.signal.aborted) return;
    const { grids: history = null } = await api.convergence(job.id, abort.signal);
    if (abort.signal.aborted) return;
    if (grid) show(mine, { job, grid });
    if (state.answer?.job.id === job.id) set({ history });
    else (set({ passes: before }), release(job.id));
    if (job.problem) set({ problem: problemOf(new Error(job.problem.detail)) });
  } catch (error) {
    if (!abort.signal.aborted) {
      set({ problem: problemOf(error) });
      const pause = pauseAfter(error);
      if (pause !== null) retry = setTimeout(() => void sharpen(seconds, target), pause);
    }
  } finally {
    if (sharpening === abort) {
      sharpening = null;
      set({ running: null });
    }
  }
}

/**
 * Shows a draft with its stored result, which has no files in this service: a job of its own takes its place.
 * @param {JobDocument} draft @param {Answer} answer
 */
export function present(draft, answer) {
  shown = ++sequence;
  again = false;
  first?.abort.abort();
  release(state.answer?.job.id);
  const { passes, seconds, relative_error = null } = answer.job.progress;
  set({
    draft,
    answer: { ...answer, stored: true },
    current: true,
    problem: null,
    passes: [{ passes, seconds, relative_error }],
  });
  set({ history: null });
  void sharpen(BY_ITSELF_SECONDS, Math.max(relative_error ?? state.target, 1e-3));
}

/** Stops the job that sharpens; its result so far is shown where it is better. */
export function cancel() {
  const id = state.running?.id;
  if (id) {
    own.delete(id);
    void api.cancelJob(id);
  }
}

// what nobody sees any more takes no place in the service
addEventListener("pagehide", () => own.forEach((id) => void api.deleteJob(id)));
