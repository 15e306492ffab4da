// Calls of the service. What it refuses is thrown as its problem document.

/** A refusal of the service. */
export class Refused extends Error {
  /** @param {Problem} problem @param {Response} response */
  constructor(problem, { status, headers }) {
    super(problem.detail);
    this.problem = problem;
    /** Pause before the same is asked again; null where it would be refused again. @type {number | null} */
    this.againMs = [429, 503].includes(status) ? 1000 * (Number(headers.get("Retry-After")) || 1) : null;
  }
}

/** Pause before a service that does not answer is asked again. */
const RETRY_MS = 1000;

/** Pause before what failed is tried again; null where it would fail again. @param {unknown} error @returns {number | null} */
export const pauseAfter = (error) =>
  error instanceof TypeError ? RETRY_MS : error instanceof Refused ? error.againMs : null;

/** @param {unknown} error @returns {Problem} */
export function problemOf(error) {
  if (error instanceof Refused) return error.problem;
  const detail =
    error instanceof TypeError ? "the service does not answer" : String(error instanceof Error ? error.message : error);
  return { type: "about:blank", title: "No answer", status: 0, detail, instance: "" };
}

/** @param {string} path @param {RequestInit} [init] @returns {Promise<Response>} */
async function call(path, init) {
  const response = await fetch(path, init);
  if (response.ok) return response;
  /** @type {Problem} */
  const nothing = {
    type: "about:blank",
    title: response.statusText,
    status: response.status,
    detail: response.statusText,
    instance: path,
  };
  throw new Refused(await response.json().catch(() => nothing), response);
}

/** @template T @param {string} path @param {AbortSignal} [signal] @returns {Promise<T>} */
export const get = async (path, signal) => (await call(path, { signal: signal ?? null })).json();

/**
 * Posts a job. With seconds to wait, the answer may be the finished job with its grids.
 * @param {JobDocument} draft @param {{ wait?: number, key?: string, signal?: AbortSignal }} [how]
 * @returns {Promise<FinishedJob>}
 */
export async function postJob(draft, { wait, key, signal } = {}) {
  const headers = new Headers({ "Content-Type": "application/json" });
  if (wait !== undefined) headers.set("Prefer", `wait=${wait}`);
  if (key !== undefined) headers.set("Idempotency-Key", key);
  return (await call("/v1/jobs", { method: "POST", headers, body: JSON.stringify(draft), signal: signal ?? null })).json();
}

/**
 * What a document would take, after a moment's trial of all methods.
 * @param {JobDocument} draft
 * @returns {Promise<Schemas["PlanResource"]>}
 */
export async function predict(draft) {
  const headers = { "Content-Type": "application/json" };
  return (await call("/v1/plan?predict=true", { method: "POST", headers, body: JSON.stringify(draft) })).json();
}

/** @param {string} id @param {AbortSignal} [signal] */
export const job = (id, signal) => /** @type {Promise<Job>} */ (get(`/v1/jobs/${id}`, signal));

/**
 * The zone of a place, or the named one, and its offset at what a clock shows.
 * @param {Record<string, string>} of
 * @returns {Promise<Schemas["TimeZoneResource"]>}
 */
export const timeZone = (of) => get(`/v1/time_zone?${new URLSearchParams(of)}`);

/** Of what a job has by names of grids, that of the document's first grid. @template T @param {Job} job @param {Record<string, T> | null | undefined} by_name @returns {T | undefined} */
export const ofFirst = ({ document }, by_name) => by_name?.[document.grids?.[0]?.name ?? ""];

/**
 * The document's first grid, as far as it is computed; null where it has none yet.
 * @param {Job} job @param {AbortSignal} [signal]
 * @returns {Promise<Grid | null>}
 */
export async function firstGrid(job, signal) {
  const path = ofFirst(job, job.links.grids);
  if (!path) return null;
  return get(path, signal).catch(() => null);
}

/**
 * The passes of a job that are told, and what they tell of the time to other errors.
 * @param {string} id @param {AbortSignal} [signal]
 * @returns {Promise<{ passes: Schemas["PassReport"][], grids?: ErrorHistory | null, views?: ErrorHistory | null }>}
 */
export const convergence = (id, signal) => get(`/v1/jobs/${id}/convergence`, signal);

/** Stops a job; what was computed stays. @param {string} id */
export const cancelJob = (id) =>
  call(`/v1/jobs/${id}/cancel`, { method: "POST" }).then(
    () => {},
    () => {},
  );

/** Deletes a job that nobody looks at any more, also while the page closes. @param {string} id */
export const deleteJob = (id) =>
  call(`/v1/jobs/${id}`, { method: "DELETE", keepalive: true }).then(
    () => {},
    () => {},
  );

/** @param {File} file @returns {Promise<Mesh>} */
export const postMesh = async (file) =>
  (await call("/v1/meshes", { method: "POST", headers: { "Content-Type": "model/obj" }, body: file })).json();

/** @param {Blob} file an EPW or WEA file */
export const postWeather = async (file) => {
  const headers = { "Content-Type": "application/octet-stream" };
  return /** @type {Promise<Weather>} */ ((await call("/v1/weather", { method: "POST", headers, body: file })).json());
};

/** @param {string} path @param {AbortSignal} [signal] */
export const bytes = async (path, signal) => (await call(path, { signal: signal ?? null })).arrayBuffer();

/** Pauses before a stream that is refused is asked for again: the first one and the longest. */
const FIRST_PAUSE_MS = 1000;
const LONGEST_PAUSE_MS = 30_000;

/**
 * Follows a job until it ends. A stream that is refused, as too many are open, is asked for again after pauses that grow, from the
 * event on that was heard last.
 * @param {string} id @param {(name: string, data: any) => void} heard @param {AbortSignal} signal
 * @returns {Promise<string>} the name of the last event; rejects when there is no such job or nobody listens any more
 */
export function follow(id, heard, signal) {
  const last = ["succeeded", "failed", "cancelled"];
  return new Promise((resolve, reject) => {
    let after = "0";
    let pause = FIRST_PAUSE_MS;
    /** @type {EventSource | undefined} */
    let source;
    const listen = () => {
      if (signal.aborted) return;
      const events = (source = new EventSource(`/v1/jobs/${id}/events?after=${after}`));
      for (const name of ["planned", "pass", "image", "phase", ...last]) {
        events.addEventListener(name, (event) => {
          after = event.lastEventId;
          pause = FIRST_PAUSE_MS;
          heard(name, JSON.parse(event.data));
          if (last.includes(name)) (events.close(), resolve(name));
        });
      }
      events.addEventListener("error", () => events.readyState === EventSource.CLOSED && void ask());
    };
    // an EventSource tells neither what it was refused with nor `Retry-After`: the job tells whether there is anything to hear
    const ask = async () => {
      try {
        const { status } = await job(id, signal);
        if (last.includes(status)) return resolve(status);
      } catch (error) {
        if (error instanceof Refused && error.againMs === null) return reject(error);
        if (error instanceof Refused && error.againMs !== null) pause = Math.max(pause, error.againMs);
      }
      setTimeout(listen, pause);
      pause = Math.min(2 * pause, LONGEST_PAUSE_MS);
    };
    signal.addEventListener("abort", () => (source?.close(), reject(signal.reason)));
    listen();
  });
}
