// Rooms to begin with, each with its stored result.
import { get } from "./api.js";
import { complete } from "./draft.js";

/** @type {[file: string, words: string][]} */
export const presets = [
  ["bathroom", "Bathroom, two tubes"],
  ["corridor", "Corridor, four tubes"],
  ["office", "Office, six tubes"],
  ["attic", "Room under a steep roof, bent tube"],
  ["thesis", "Test room of 2 m, one tube"],
];

/** @param {string} name @returns {Promise<{ draft: JobDocument, answer: Answer }>} */
export async function preset(name) {
  const { draft, job, grid } = await get(`/web/presets/${name}.json`);
  return { draft: complete(draft), answer: { job, grid } };
}
