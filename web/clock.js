// Days and hours of a place, as people set clocks there, and the RFC 3339 times of documents.

const DAY_MS = 86_400_000;

/**
 * Minutes by which clocks of a zone are ahead of UTC at a moment.
 * @param {string} zone IANA name
 * @param {number} at milliseconds of UTC
 */
function ahead(zone, at) {
  const parts = new Intl.DateTimeFormat("en-US", { timeZone: zone, timeZoneName: "longOffset" }).formatToParts(at);
  const [, sign = "+", hours = "0", minutes = "0"] =
    /GMT([+-])(\d+):(\d+)/.exec(parts.find(({ type }) => type === "timeZoneName")?.value ?? "") ?? [];
  return (sign === "-" ? -1 : 1) * (60 * Number(hours) + Number(minutes));
}

/** @param {number} number */
const two = (number) => String(Math.trunc(number)).padStart(2, "0");

/**
 * The time of a document. A place that is no city has the clock of its longitude.
 * @param {number} year @param {number} day of the year, from 1 @param {number} hour 0..24 @param {string | undefined} zone @param {number} longitude
 */
export function time(year, day, hour, zone, longitude) {
  const wall = Date.UTC(year, 0, day) + Math.round(hour * 60) * 60_000;
  let offset = 60 * Math.round(longitude / 15);
  if (zone) {
    offset = ahead(zone, wall);
    // the clock may change between here and UTC's same wall time
    offset = ahead(zone, wall - offset * 60_000);
  }
  const date = new Date(wall).toISOString().slice(0, 19);
  return `${date}${offset < 0 ? "-" : "+"}${two(Math.abs(offset) / 60)}:${two(Math.abs(offset) % 60)}`;
}

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
