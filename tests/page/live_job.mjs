// The jobs that keep the result up with the draft: their phases against a service in the test's hand, and the service itself.
import assert from "node:assert/strict";

/** Makes `live` in the page: a job that is live beside the page's own, whose posts and streams wait for what the test does. */
const prepare = (page) =>
  page.evaluate(async () => {
    const { LiveJob } = await import("/web/live_job.js");
    const state = { draft: { name: "0" }, answer: null, current: false, passes: [], running: null, problem: null, target: 0.01 };
    const [posts, streams, deleted] = [[], [], []];
    const set = (values) => Object.assign(state, values);
    const told = (id, relative_error) => ({
      ...{ id, status: "succeeded", accuracy: { relative_error }, grid_results: { workplane: { of: id } } },
      document: { grids: [{ name: "workplane" }] },
      progress: { passes: 1, seconds: 0.1, relative_error },
    });
    const ends = (signal, make) =>
      new Promise((resolve, reject) => {
        signal?.addEventListener("abort", () => reject(signal.reason));
        make(resolve, reject);
      });
    const service = {
      postJob: ({ name, stop }, { key, signal } = {}) =>
        ends(signal, (resolve, fails) => {
          const answers = (error) => resolve(told(`${name} to ${stop.relative_error}`, error));
          const runsOut = () => resolve({ id: `${name} runs out`, status: "failed", stopped_by: "max_seconds", progress: { passes: 0, seconds: 0.2 } });
          posts.push({ name, key, answers, fails, runsOut });
        }),
      follow: (id, heard, signal) => ends(signal, (ends, fails) => streams.push({ id, heard, ends, fails })),
      job: async (id) => told(id, 0.005),
      firstGrid: async ({ id }) => ({ of: id }),
      convergence: async () => ({ grids: { times: [] } }),
      deleteJob: async (id) => void deleted.push(id),
    };
    const job = new LiveJob(service, { state, set });
    const soon = () => new Promise((resolve) => setTimeout(resolve));
    globalThis.live = {
      ...{ job, state, posts, streams, deleted },
      /** Phase and answer once all that is told has been heard. */
      seen: async () => (await soon(), [job.phase, state.answer?.job.id ?? null, state.current]),
      edit(name) {
        set({ draft: { name }, current: false, problem: null });
        job.changed();
      },
      /** Waits for a phase, and tells how long that took. */
      async until(phase) {
        const start = performance.now();
        while (job.phase !== phase && performance.now() - start < 5000) await soon();
        return job.phase === phase ? performance.now() - start : `still ${job.phase}`;
      },
    };
  });

/** The first answer is shown, and sharpened once the hand rests, but not while it holds something. */
export async function sharpensAtRest({ page }) {
  await prepare(page);
  const [seen, rested, end, deleted] = await page.evaluate(async () => {
    const { job, state, posts, streams, deleted, edit, seen, until } = live;
    const told = [await seen()];
    job.hold(true);
    edit("a");
    told.push(await seen());
    posts[0].answers(0.04);
    await new Promise((resolve) => setTimeout(resolve, 500));
    told.push(await seen());
    job.hold(false);
    const rested = await until("posting");
    posts[1].answers(null);
    told.push(await seen());
    streams[0].heard("pass", { passes: 2, seconds: 1, relative_error: 0.005 });
    streams[0].ends("succeeded");
    told.push(await seen());
    return [told, rested, { ...state, draft: null, answer: null }, deleted];
  });
  const first = "a to 0.05";
  assert.deepEqual(seen, [
    ["idle", null, false],
    ["answering", null, false],
    ["resting", first, true],
    ["running", first, true],
    ["idle", "a to 0.01", true],
  ]);
  assert(rested > 300 && rested < 1500, `sharpened after ${rested} ms`);
  assert.deepEqual([end.running, end.passes.length, end.history], [null, 1, { times: [] }]);
  assert.deepEqual(deleted, [first]);
}

/** A room whose first pass takes longer than a first answer may is sharpened at once; an edit meanwhile is answered. */
export async function sharpensHeavyRooms({ page }) {
  await prepare(page);
  const { told, problem, deleted, edited } = await page.evaluate(async () => {
    const { state, posts, streams, deleted, edit, seen } = live;
    edit("a");
    posts[0].runsOut();
    const told = [await seen()];
    posts[1].answers(null);
    told.push(await seen());
    streams[0].ends("succeeded");
    told.push(await seen());
    edit("b");
    edit("c");
    posts[2].runsOut();
    const edited = await seen();
    return { told, problem: state.problem, deleted: [...deleted], edited: [...edited, posts.at(-1).name] };
  });
  assert.deepEqual(told, [
    ["posting", null, false],
    ["running", null, false],
    ["idle", "a to 0.01", true],
  ]);
  assert.deepEqual([problem, deleted], [null, ["a runs out", "b runs out"]]);
  assert.deepEqual(edited, ["answering", "a to 0.01", false, "c"]);
}

/** An edit is computed after the answer that is on its way, whose draft is no longer the page's; a late answer is given up. */
export async function answersTheLastEdit({ page }) {
  await prepare(page);
  const { seen, late, names, keys, deleted } = await page.evaluate(async () => {
    const { posts, deleted, edit, seen, until } = live;
    for (const name of ["a", "b", "c"]) edit(name);
    const told = [await seen()];
    posts[0].answers(0.04);
    told.push(await seen());
    edit("d");
    const late = await until("answering");
    told.push(await seen());
    // the same post once more names the job that is given up
    posts.find(({ name, key }, at) => at > 1 && name === "c" && key === posts[1].key).answers(0.04);
    posts.findLast(({ name }) => name === "d").answers(0.04);
    told.push(await seen());
    return { seen: told, late, names: posts.map(({ name }) => name).sort(), keys: new Set(posts.map(({ key }) => key)).size, deleted };
  });
  assert.deepEqual(seen, [
    ["stale", null, false],
    ["answering", "a to 0.05", false],
    ["answering", "a to 0.05", false],
    ["resting", "d to 0.05", true],
  ]);
  assert(late > 1000 && late < 3000, `given up after ${late} ms`);
  assert.deepEqual([names, keys], [["a", "c", "c", "d"], 3]);
  assert.deepEqual(deleted.sort(), ["a to 0.05", "c to 0.05"]);
}

/** An edit ends the job that sharpens; what that job still answers is not shown, and it is deleted. */
export async function leavesOlderJobs({ page }) {
  await prepare(page);
  const { seen, running, deleted } = await page.evaluate(async () => {
    const { job, state, posts, streams, deleted, edit, seen } = live;
    const told = [];
    void job.sharpen(20);
    edit("a");
    told.push(await seen());
    posts[0].answers(null);
    told.push(await seen());
    posts[1].answers(0.04);
    told.push(await seen());
    void job.sharpen(20);
    posts[2].answers(null);
    told.push(await seen());
    edit("b");
    const { running } = state;
    streams[0].ends("succeeded");
    told.push(await seen());
    posts[3].answers(0.04);
    told.push(await seen());
    return { seen: told, running, deleted };
  });
  assert.deepEqual(seen, [
    ["answering", null, false],
    ["answering", null, false],
    ["resting", "a to 0.05", true],
    ["running", "a to 0.05", true],
    ["answering", "a to 0.05", false],
    ["resting", "b to 0.05", true],
  ]);
  assert.equal(running, null);
  assert.deepEqual(deleted, ["0 to 0.01", "a to 0.01", "a to 0.05"]);
}

/** What is away or busy is asked for the same again; what is refused waits for an edit; errors of older drafts are nobody's. */
export async function standsErrors({ page }) {
  await prepare(page);
  const { seen, problems, pauses } = await page.evaluate(async () => {
    const { Refused } = await import("/web/api.js");
    const { job, state, posts, streams, edit, seen, until } = live;
    const [told, problems, pauses] = [[], [], []];
    const fails = async (error, what = posts.at(-1)) => {
      what.fails(error);
      told.push((await seen())[0]);
      problems.push(state.problem?.detail ?? null);
    };
    const refusal = (status) => new Refused({ detail: String(status) }, new Response(null, { status }));
    edit("a");
    await fails(new TypeError("no network"));
    pauses.push(await until("answering"));
    await fails(refusal(422));
    edit("b");
    edit("c");
    await fails(refusal(422));
    posts.at(-1).answers(0.04);
    await seen();
    void job.sharpen();
    await fails(refusal(503));
    pauses.push(await until("posting"));
    posts.at(-1).answers(null);
    await seen();
    await fails(refusal(404), streams[0]);
    return { seen: told, problems, pauses };
  });
  assert.deepEqual(seen, ["waiting", "failed", "answering", "waiting", "failed"]);
  assert.deepEqual(problems, ["the service does not answer", "422", null, "503", "404"]);
  for (const pause of pauses) assert(pause > 900 && pause < 3000, `asked again after ${pause} ms`);
}

/** A stream that breaks while a job runs is heard again from the event on that was heard last: no pass is lost or counted twice. */
export async function hearsOn({ page }) {
  const { asked, passes, told, phases, shown } = await page.evaluate(async () => {
    const [{ LiveJob }, api, { state: seen }] = [
      await import("/web/live_job.js"),
      await import("/web/api.js"),
      await import("/web/state.js"),
    ];
    const [real, asked, phases] = [EventSource, [], []];
    globalThis.EventSource = class extends real {
      constructor(url) {
        super(url);
        asked.push(Number(new URL(url, location.href).searchParams.get("after")));
        phases.push(job.phase);
        if (asked.length > 1) return;
        this.addEventListener("pass", () =>
          setTimeout(() => {
            this.close();
            this.dispatchEvent(new Event("error"));
          }),
        );
      }
    };
    const state = { draft: seen.draft, answer: null, current: true, passes: [], running: null, problem: null, target: 2e-3 };
    const job = new LiveJob(api, { state, set: (values) => Object.assign(state, values) });
    await job.sharpen(300);
    globalThis.EventSource = real;
    phases.push(job.phase);
    const { id } = state.answer.job;
    const told = (await api.convergence(id)).passes;
    const counts = (of) => of.map(({ passes }) => passes);
    job.leave();
    return { asked, passes: counts(state.passes), told: counts(told), phases, shown: state.answer.grid.name };
  });
  assert.deepEqual(phases, ["running", "running", "idle"]);
  assert(asked.length === 2 && asked[0] === 0 && asked[1] > 0, `asked for events after ${asked}`);
  assert.deepEqual([passes, shown], [told, "workplane"]);
}

/** A stream of events that is refused is asked for again, from the event that was heard last on, until the job has ended. */
export async function followsAgain({ page }) {
  const { heard, asked, ended } = await page.evaluate(async () => {
    const { follow, postJob, deleteJob } = await import("/web/api.js");
    const { state } = await import("/web/state.js");
    const { id } = await postJob({ ...state.draft, views: [], stop: { max_passes: 8 } }, { wait: 10 });
    const [real, ask, asked, heard] = [EventSource, fetch, [], []];
    let looks = 0;
    // the job has ended before anybody asks: what the page sees is told as of one that goes on
    globalThis.fetch = (path, init) =>
      path === `/v1/jobs/${id}` && !init?.method
        ? Promise.resolve(
            looks++ ? new Response(JSON.stringify({ status: "running" })) : new Response("{}", { status: 503, headers: { "Retry-After": "1" } }),
          )
        : ask(path, init);
    globalThis.EventSource = class extends EventTarget {
      static CLOSED = 2;
      readyState = 0;
      constructor(url) {
        super();
        asked.push(url.split("?")[1]);
        if (asked.length === 3) return new real(url);
        setTimeout(() => {
          if (asked.length === 2) this.dispatchEvent(new MessageEvent("planned", { data: "{}", lastEventId: "2" }));
          this.readyState = 2;
          this.dispatchEvent(new Event("error"));
        });
      }
      close() {}
    };
    const ended = await follow(id, (name) => heard.push(name), new AbortController().signal);
    Object.assign(globalThis, { EventSource: real, fetch: ask });
    await deleteJob(id);
    return { heard, asked, ended };
  });
  assert.deepEqual(asked, ["after=0", "after=0", "after=2"]);
  assert.equal(ended, "succeeded");
  assert.deepEqual([heard.filter((name) => name === "planned").length, heard.at(-1)], [1, "succeeded"]);
}

/** A job that is refused because the service is busy is posted again after the time that the answer says. */
export async function postsAgain(visitor) {
  const refused = await visitor.page.evaluate(async () => {
    const [{ edit }, { state }] = [await import("/web/live.js"), await import("/web/state.js")];
    const real = fetch;
    const problem = { type: "about:blank", title: "busy", status: 429, detail: "too many at once", instance: "" };
    const headers = { "Content-Type": "application/problem+json", "Retry-After": "1" };
    globalThis.fetch = (path, init) => {
      if (init?.method !== "POST") return real(path, init);
      globalThis.fetch = real;
      return Promise.resolve(new Response(JSON.stringify(problem), { status: 429, headers }));
    };
    edit((draft) => (draft.room.size_m[2] += 0.1));
    await new Promise((resolve) => setTimeout(resolve, 100));
    return state.problem?.detail;
  });
  assert.equal(refused, "too many at once");
  await visitor.rests();
  assert.equal((await visitor.state()).problem, null);
  await visitor.page.getByRole("button", { name: "Undo" }).click();
  await visitor.rests();
}
