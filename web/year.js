// Hours of a year, as the page holds them: what they are at a moment, over a day and over the year. Nothing is asked of the service.

/**
 * Illuminances of a grid in all records of a year.
 * @typedef {object} YearHours
 * @property {import("./npy.js").Rows} lux a row for each sensor, a column for each record
 * @property {number} across sensors in a row of the grid
 * @property {number[]} areas weight of each sensor; 0 where it has no value
 * @property {Float32Array} mean over the area, of each record
 * @property {number} largest of all values
 * @property {number} perHour records in an hour
 * @property {number} days
 * @property {{ year: number, day: number }} first day of the first record
 */

/** Occupied hours to choose from: those of EN 17037, of IES LM-83, or of working days. @typedef {"daylight_hours" | "lm83" | "weekdays"} Schedule */

/** Hours of the day from and up to which a room is occupied, but for daylight hours. */
const OCCUPIED = { from: 8, to: 18 };

/**
 * Takes the array of a grid over.
 * @param {import("./npy.js").Rows} lux
 * @param {Pick<Grid, "x_m" | "area_m2">} grid
 * @param {number} perHour records in an hour
 * @param {{ year: number, day: number }} first day of the first record
 * @returns {YearHours}
 */
export function hoursOf(lux, grid, perHour, first) {
  const { rows, columns, values } = lux;
  const cells = grid.area_m2?.flat();
  const areas = Array.from({ length: rows }, (_, sensor) => (Number.isNaN(values[sensor * columns]) ? 0 : (cells?.[sensor] ?? 1)));
  const all = areas.reduce((sum, area) => sum + area, 0);
  const mean = new Float32Array(columns);
  let largest = 0;
  for (let sensor = 0; sensor < rows; sensor++) {
    const share = (areas[sensor] ?? 0) / all;
    if (!(share > 0)) continue;
    for (let record = 0; record < columns; record++) {
      const value = values[sensor * columns + record] ?? 0;
      mean[record] = (mean[record] ?? 0) + share * value;
      if (value > largest) largest = value;
    }
  }
  return { lux, across: grid.x_m.length || rows, areas, mean, largest, perHour, days: Math.ceil(columns / (24 * perHour)), first };
}

/** Number of the record of an hour of a day; days count from 1. @param {YearHours} hours @param {number} day @param {number} hour */
export const recordAt = ({ perHour, lux }, day, hour) => Math.min(lux.columns - 1, Math.floor(((day - 1) * 24 + hour) * perHour + 1e-6));

/** Illuminance of a sensor in a record. @param {YearHours} hours @param {number} sensor @param {number} record */
export const luxAt = ({ lux }, sensor, record) => lux.values[sensor * lux.columns + record] ?? NaN;

/** Rows of the grid in a record, the southern one first. @param {YearHours} hours @param {number} record */
export const rowsAt = (hours, record) => inRows(hours, (sensor) => luxAt(hours, sensor, record));

/** Values of sensors as rows of the grid. @param {YearHours} hours @param {(sensor: number) => number} value */
export const inRows = ({ lux, across }, value) =>
  Array.from({ length: Math.ceil(lux.rows / across) }, (_, j) => Array.from({ length: across }, (_, i) => value(j * across + i)));

/** Illuminances of the records of a day: of a sensor, or the mean. @param {YearHours} hours @param {number | null} sensor @param {number} day */
export function dayOf(hours, sensor, day) {
  const { lux, mean, perHour } = hours;
  const [of, offset] = sensor === null ? [mean, 0] : [lux.values, sensor * lux.columns];
  const from = recordAt(hours, day, 0);
  return [...of.subarray(offset + from, offset + Math.min(lux.columns, from + 24 * perHour))];
}

/** Largest illuminance of a sensor over the year. @param {YearHours} hours @param {number} sensor */
export const largestOf = ({ lux }, sensor) =>
  lux.values.subarray(sensor * lux.columns, (sensor + 1) * lux.columns).reduce((most, value) => (value > most ? value : most), 0);

/** Means by hour of the day, from midnight on, and by day; not-a-number where the year has no record. @param {YearHours} hours */
export const byHour = ({ mean, perHour, days }) =>
  Array.from({ length: 24 }, (_, hour) =>
    Array.from({ length: days }, (_, day) => {
      const from = (day * 24 + hour) * perHour;
      const of = mean.subarray(from, from + perHour);
      return of.length ? of.reduce((sum, value) => sum + value, 0) / of.length : NaN;
    }),
  );

/** Months of the year, with the days of the file, from 1, on which they begin and end. @param {YearHours} hours */
export function months({ first, days }) {
  const dayOf = (/** @type {number} */ month) => Math.round((Date.UTC(first.year, month) - Date.UTC(first.year, 0)) / 86_400_000) - first.day + 2;
  const from = new Date(Date.UTC(first.year, 0, first.day)).getUTCMonth();
  return Array.from({ length: 13 }, (_, i) => from + i)
    .map((month) => ({ month: month % 12, from: Math.max(1, dayOf(month)), to: Math.min(days + 1, dayOf(month + 1)) }))
    .filter(({ from, to }) => from < to);
}

/** Light of all tubes in each month in klm h. @param {Schemas["AnnualResult"]} summary */
export const monthly = ({ tubes }) =>
  Array.from({ length: 12 }, (_, month) => tubes.reduce((sum, tube) => sum + (tube.monthly_klm_h[month] ?? 0), 0));

/** Records that count for a schedule, about: working days have the weather of all days, daylight hours are those with most light inside. @param {YearHours} hours @param {Schedule} schedule */
function counted({ mean, perHour }, schedule) {
  const records = Array.from(mean, (_, record) => record);
  const most = () => records.toSorted((a, b) => (mean[b] ?? 0) - (mean[a] ?? 0)).slice(0, Math.ceil(records.length / 2));
  if (schedule === "daylight_hours") return most();
  const hour = (/** @type {number} */ record) => (record / perHour) % 24;
  return records.filter((record) => hour(record) >= OCCUPIED.from && hour(record) < OCCUPIED.to);
}

/**
 * Estimates how many times the light a part of the area needs to have an illuminance in half of the hours that count.
 * @param {YearHours} hours
 * @param {Schedule} schedule
 * @param {number} lux
 * @param {number} part of the area in percent
 */
export function lightNeeded(hours, schedule, lux, part) {
  const records = counted(hours, schedule);
  const sorted = new Float32Array(records.length);
  const needed = hours.areas.flatMap((area, sensor) => {
    if (!(area > 0)) return [];
    records.forEach((record, i) => (sorted[i] = luxAt(hours, sensor, record)));
    return [{ area, times: lux / (sorted.sort()[Math.floor(records.length / 2)] ?? 0) }];
  });
  const least = (part / 100) * needed.reduce((sum, { area }) => sum + area, 0);
  let sum = 0;
  return needed.toSorted((a, b) => a.times - b.times).find(({ area }) => (sum += area) >= least - 1e-9)?.times ?? Infinity;
}
