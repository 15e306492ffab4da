// The horizon of the surroundings: as a document has it, as people write it, and as it is drawn.

/** Azimuth and altitude in degrees. @typedef {[azimuth_deg: number, altitude_deg: number]} Point */
/** Points of a horizon under the name by which a document has them: azimuths from north, or as PVGIS counts them, from south. @typedef {{ horizon: Point[] } | { horizon_pvgis: Point[] }} Horizon */

const NUMBER = /[-+]?\d+(?:\.\d+)?/g;

/**
 * Reads a horizon: lines of azimuth and altitude, pairs with colons, a table or JSON of PVGIS, or altitudes alone at equal steps from north.
 * Azimuths below zero are those of PVGIS. Null where the text has no such numbers.
 * @param {string} text
 * @returns {Horizon | null}
 */
export function parsed(text) {
  const json = [...text.matchAll(/"A"\s*:\s*([-+\d.]+)[^}]*?"H_hor"\s*:\s*([-+\d.]+)/g)];
  const colons = [...text.matchAll(/([-+]?\d+(?:\.\d+)?)\s*°?\s*:\s*([-+]?\d+(?:\.\d+)?)/g)];
  // a table has lines of words above and below
  const lines = text.split(/[\n;]/).filter((line) => /^\s*[-+]?\d/.test(line));
  const numbers = (/** @type {string[]} */ of) => of.map((line) => (line.match(NUMBER) ?? []).map(Number)).filter(({ length }) => length >= 2);
  const parts = numbers(lines.length === 1 ? (lines[0] ?? "").split(",") : []);
  const rows = parts.length ? parts : numbers(lines);
  const [alone = []] = rows;
  const list = rows.length === 1 && alone.length > 2 ? alone : null;
  const pairs = (json.length ? json : colons).map(([, azimuth, altitude]) => [Number(azimuth), Number(altitude)]);
  const read = pairs.length ? pairs : list ? list.map((altitude, k) => [(k * 360) / list.length, altitude]) : rows;
  const points = /** @type {Point[]} */ (read.map(([azimuth, altitude]) => [azimuth, altitude]));
  if (!points.length || points.flat().some(Number.isNaN)) return null;
  const ascending = points.toSorted(([a], [b]) => a - b).filter(([azimuth], k, all) => azimuth !== all[k + 1]?.[0]);
  return ascending.some(([azimuth]) => azimuth < 0) ? { horizon_pvgis: ascending } : { horizon: ascending };
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
