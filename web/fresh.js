// Pictures of a job that runs, as they are after its newest pass.
import { set } from "./state.js";

/** A picture: the passes after which it was asked for, its address as far as it is there, and whether it is on its way. @typedef {{ passes: number, address: string, waits: boolean }} Kept */
/** @type {Map<string, Kept>} */
const kept = new Map();

/**
 * The address of a picture of a job after so many passes; the one before stays until it is there, and it is empty before the first one. One
 * path has one picture after another, which a browser would not ask for again.
 * @param {string} path
 * @param {number} passes
 */
export function fresh(path, passes) {
  const of = kept.get(path) ?? { passes: -1, address: "", waits: false };
  kept.set(path, of);
  if (passes > 0 && of.passes !== passes && !of.waits) {
    Object.assign(of, { passes, waits: true });
    void taken(path, of);
  }
  return of.address;
}

/** @param {string} path @param {Kept} of */
async function taken(path, of) {
  try {
    const answer = await fetch(path);
    const before = of.address;
    if (answer.ok) of.address = URL.createObjectURL(await answer.blob());
    if (answer.ok && before) URL.revokeObjectURL(before);
  } catch {
    // the next pass asks again
  }
  of.waits = false;
  set();
}
