// The target of a room.

/**
 * Target: an illuminance, and what is to have it: the mean over the work plane, half of its area, or 95 % of it.
 * @typedef {{ lux: number, of: "mean" | "half" | "most" }} Goal
 */

/** Parts of the area in percent. */
export const PARTS = { half: 50, most: 95 };

/** @type {[Goal["of"], string][]} */
export const WORDS = [
  ["mean", "in the mean"],
  ["half", "on half of the area"],
  ["most", "on 95\u202f% of the area"],
];

/** The part of a room that is to have a target, in words. @param {Goal["of"]} of */
export const words = (of) => WORDS.find(([name]) => name === of)?.[1] ?? "";

/**
 * The target that an address asks for, as that of a report does; null where it asks for none.
 * @param {string} search @returns {Goal | null}
 */
export function asked(search) {
  const fields = new URLSearchParams(search);
  const [lux, of] = [Number(fields.get("target_lux")), fields.get("target_of") ?? "mean"];
  return lux > 0 && isOf(of) ? { lux, of } : null;
}

/** The part of an address that asks for a verdict on a target; empty without one. @param {Goal | null} [goal] */
export const judgedBy = (goal) => (goal ? `?target_lux=${goal.lux}&target_of=${goal.of}` : "");

/** True of words for a target. @param {string} of @returns {of is Goal["of"]} */
export const isOf = (of) => WORDS.some(([name]) => name === of);
