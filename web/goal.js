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

/** True of words for a target. @param {string} of @returns {of is Goal["of"]} */
export const isOf = (of) => WORDS.some(([name]) => name === of);
