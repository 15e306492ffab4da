// Days and hours of a place, as people set clocks there, and the RFC 3339 times of documents.

const DAY_MS = 86_400_000;

/** @param {number} number */
const two = (number) => String(Math.trunc(number)).padStart(2, "0");

/**
 * The time of a document.
 * @param {number} year @param {number} day of the year, from 1 @param {number} hour 0..24 @param {string} offset from UTC, as +02:00
 */
export const time = (year, day, hour, offset) =>
  new Date(Date.UTC(year, 0, day) + Math.round(hour * 60) * 60_000).toISOString().slice(0, 19) + offset;

/** What the clock of a document shows; null where it shows nothing. @param {string | null | undefined} time */
export const local = (time) => /^\d{4}-\d{2}-\d{2}T\d{2}:\d{2}(:\d{2})?/.exec(time ?? "")?.[0] ?? null;

/** Offset from UTC of the clock of a document. @param {string | null | undefined} time */
export const offset = (time) => /[+-]\d{2}:\d{2}$/.exec(time ?? "")?.[0] ?? "+00:00";

/** Year, day of the year and hour that the clock of a document shows. @param {string | null | undefined} time */
export function read(time) {
  const [, date = "2026-03-21", hours = "12", minutes = "0"] = /^(\d{4}-\d{2}-\d{2})T(\d{2}):(\d{2})/.exec(time ?? "") ?? [];
  const at = Date.parse(`${date}T00:00:00Z`);
  const year = new Date(at).getUTCFullYear();
  return { year, day: Math.round((at - Date.UTC(year, 0, 1)) / DAY_MS) + 1, hour: Number(hours) + Number(minutes) / 60 };
}

/** As "21 March". @param {number} year @param {number} day */
export const dayName = (year, day) =>
  new Intl.DateTimeFormat("en-GB", { day: "numeric", month: "long", timeZone: "UTC" }).format(Date.UTC(year, 0, day));
/** As "12:30". @param {number} hour */
export const hourName = (hour) => `${two(hour)}:${two(Math.round((hour % 1) * 60))}`;
/** A day as fields of dates have it, as "2026-03-21". @param {number} year @param {number} day */
export const isoDay = (year, day) => new Date(Date.UTC(year, 0, day)).toISOString().slice(0, 10);
