// The horizon of the surroundings: as a document has it, as people write it, and as it is drawn.

/** Azimuth and altitude in degrees. @typedef {[azimuth_deg: number, altitude_deg: number]} Point */
/** Points of a horizon under the name by which a document has them: azimuths from north, or as PVGIS counts them, from south. @typedef {{ horizon: Point[] } | { horizon_pvgis: Point[] }} Horizon */

/** What a text has: points, altitudes at equal steps from north, or neither. @typedef {{ points: Point[] } | { steps: number[] } | null} Read */

const NUMBER = String.raw`[-+]?(?:\d+(?:\.\d+)?|\.\d+)(?:[eE][-+]?\d+)?`;
const ONE = new RegExp(`^${NUMBER}$`);
/** Two numbers, by what is between them. @param {string} between */
const two = (between) => new RegExp(`^(${NUMBER})${between}(${NUMBER})$`);
const PAIR = two("(?::|\\s*[,;]\\s*|\\s+)");
/** Points side by side, by what separates them. A comma between two numbers could then be a decimal one, so that it makes no pair. @type {[separator: RegExp, pair: RegExp][]} */
const SIDE_BY_SIDE = [[/\s*;\s*/, two("(?::|\\s+)")], [/\s*,\s*/, two("(?::|\\s+)")], [/\s+/, two(":")]];
const ENTRY = new RegExp(`"A"\\s*:\\s*(${NUMBER})\\s*,\\s*"H_hor"\\s*:\\s*(${NUMBER})\\s*[,}]`, "g");

/** @param {string[]} parts @param {RegExp} pair @returns {Point[] | null} */
function pairs(parts, pair) {
  const found = parts.map((part) => pair.exec(part));
  return found.every(Boolean) ? found.map((of) => [Number(of?.[1]), Number(of?.[2])]) : null;
}

/** @param {string[]} parts */
const singles = (parts) => (parts.length > 1 && parts.every((part) => ONE.test(part)) ? parts.map(Number) : null);

/** Reads lines of text; nothing may be left over. @param {string} text @returns {Read} */
function readLines(text) {
  const all = text.split("\n").map((line) => line.replaceAll("°", " ").replaceAll(/\s*:\s*/g, ":").replace(/[\s,;]+$/, "").trim());
  const lines = all.filter(Boolean);
  // headings
  while (lines[0] && !/\d/.test(lines[0])) lines.shift();
  if (!lines.length) return null;
  const points = pairs(lines, PAIR);
  if (points) return { points };
  const steps = singles(lines);
  if (steps) return { steps };
  const many = lines.map((line) => SIDE_BY_SIDE.reduce((/** @type {Point[] | null} */ found, [separator, pair]) => found ?? pairs(line.split(separator), pair), null));
  if (many.every((found) => found !== null)) return { points: many.flat() };
  const [line = ""] = lines.length === 1 ? lines : [];
  const list = SIDE_BY_SIDE.reduce((/** @type {number[] | null} */ found, [separator]) => found ?? singles(line.split(separator)), null);
  return list && { steps: list };
}

/** Reads arrays as documents have them: of pairs, or of altitudes. @param {unknown} of @returns {Read} */
function readArray(of) {
  if (!Array.isArray(of) || !of.length) return null;
  const isNumber = (/** @type {unknown} */ one) => typeof one === "number";
  if (of.length > 1 && of.every(isNumber)) return { steps: of };
  return of.every((one) => Array.isArray(one) && one.length === 2 && one.every(isNumber)) ? { points: of } : null;
}

/** The value of a text of JSON, also where its outermost brackets are missing; undefined where it is none. @param {string} text @returns {unknown} */
function json(text) {
  const bare = text.trim().replace(/,$/, "");
  if (!/^["[{]/.test(bare)) return undefined;
  for (const whole of [bare, `{${bare}}`, `[${bare}]`])
    try {
      return JSON.parse(whole);
    } catch {
      // as it is, or with other brackets
    }
  return undefined;
}

/** Points of what PVGIS prints, as JSON or as a table; null where the text is neither, or has more than it should. @param {string} text @returns {Point[] | null} */
function readPvgis(text) {
  const entries = [...text.matchAll(ENTRY)].map(([, azimuth, altitude]) => /** @type {Point} */ ([Number(azimuth), Number(altitude)]));
  // the description of the fields has their names, too
  if (entries.length) return entries.length === [...text.matchAll(/"H_hor"\s*:\s*[^\s{]/g)].length ? entries : null;
  const lines = text.split("\n").map((line) => line.trim().split(/[\s,;]+/));
  const head = lines.findIndex(([first, second]) => first === "A" && second === "H_hor");
  const rows = lines.slice(head + 1).filter(([first = ""]) => /^[-+.]?\d/.test(first));
  const isWhole = rows.every((row) => row.length === lines[head]?.length && row.every((part) => ONE.test(part)));
  return head >= 0 && rows.length && isWhole ? rows.map(([azimuth, altitude]) => [Number(azimuth), Number(altitude)]) : null;
}

/** Points that ascend; the last one of those at the same azimuth. @param {Point[]} points */
const ascending = (points) => points.toSorted(([a], [b]) => a - b).filter(([azimuth], k, all) => azimuth !== all[k + 1]?.[0]);

/**
 * Reads a horizon: lines of azimuth and altitude, several such pairs on a line, arrays as documents have them, a table or JSON of PVGIS, or
 * altitudes alone at equal steps from north. Null where the text is none of these, or has anything else.
 *
 * Azimuths are from south where PVGIS printed them, or where one is below zero. Those of a document that counts from south stay so unless one
 * is above 180.
 * @param {string} text
 * @param {boolean} [fromSouth] whether the document counts from south
 * @returns {Horizon | null}
 */
export function parsed(text, fromSouth = false) {
  if (text.includes("H_hor")) {
    const points = readPvgis(text);
    return points && { horizon_pvgis: ascending(points) };
  }
  const value = json(text);
  const { horizon, horizon_pvgis } = /** @type {Record<string, unknown>} */ (Object(value));
  const read = value === undefined ? readLines(text) : readArray(horizon_pvgis ?? horizon ?? value);
  if (!read) return null;
  if ("steps" in read) return { horizon: read.steps.map((altitude, k) => [(k * 360) / read.steps.length, altitude]) };
  const points = ascending(read.points);
  const isBelow = points.some(([azimuth]) => azimuth < 0);
  const stays = fromSouth && !horizon && points.every(([azimuth]) => azimuth <= 180);
  return horizon_pvgis || isBelow || stays ? { horizon_pvgis: points } : { horizon: points };
}

/** A horizon as it is typed, a line for each point. @param {Point[]} points */
export const written = (points) => points.map(([azimuth, altitude]) => `${azimuth}: ${altitude}`).join("\n");

/** Points of the surroundings, from north and ascending; none below an open sky. @param {JobDocument["surroundings"]} surroundings @returns {Point[]} */
export function pointsOf(surroundings) {
  const { horizon, horizon_pvgis } = surroundings ?? {};
  const north = horizon ?? horizon_pvgis?.map(([azimuth, altitude]) => [(azimuth + 180) % 360, altitude]) ?? [];
  return /** @type {Point[]} */ (north).toSorted(([a], [b]) => a - b);
}

/** Altitude at an azimuth 0..360, linear between the points, all round. @param {Point[]} points @param {number} azimuth_deg */
export function altitudeAt(points, azimuth_deg) {
  const [first, last] = [points[0], points.at(-1)];
  if (!first || !last) return 0;
  const round = [/** @type {Point} */ ([last[0] - 360, last[1]]), ...points, /** @type {Point} */ ([first[0] + 360, first[1]])];
  const after = Math.max(1, round.findIndex(([azimuth]) => azimuth >= azimuth_deg));
  const [[a, low], [b, high]] = [round[after - 1] ?? first, round[after] ?? last];
  return b > a ? low + ((high - low) * (azimuth_deg - a)) / (b - a) : high;
}

/** The one altitude of a horizon that is even all round; null where it is not. @param {Point[]} points */
export const evenAltitude = (points) => (points.length && points.every(([, altitude]) => altitude === points[0]?.[1]) ? (points[0]?.[1] ?? 0) : null);
