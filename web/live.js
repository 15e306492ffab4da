// The draft in the hand: its changes, steps back, and the jobs that keep the result up with it.
import * as api from "./api.js";
import { changed } from "./draft.js";
import { LiveJob } from "./live_job.js";
import { set, state } from "./state.js";
import { YearJob } from "./year_job.js";

export const live = new LiveJob(api, { state, set });
export const year = new YearJob(api, { state, set });
addEventListener("pagehide", () => [live, year].forEach((job) => job.leave()));

/** How many steps back are kept. */
const STEPS = 200;
/** A movement of the hand is one step to go back. */
let begun = false;

/** Changes the draft, and computes it. @param {(draft: JobDocument) => void} change */
export function edit(change) {
  if (!begun) set({ past: [...state.past.slice(1 - STEPS), state.draft] });
  begun = live.held;
  use(changed(state.draft, change));
}

/** Goes back before the last change. */
export function undo() {
  const draft = state.past.at(-1);
  if (!draft || live.held) return;
  set({ past: state.past.slice(0, -1) });
  use(draft);
}

/** Takes a draft over, and computes it. @param {JobDocument} draft */
export function use(draft) {
  set({ draft, current: false, problem: null });
  live.changed();
}

/** Notes that a hand took something, or let it go. @param {boolean} now */
export function hold(now) {
  begun = false;
  live.hold(now);
}
