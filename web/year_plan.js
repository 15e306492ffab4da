// What the plan shows of a year: autonomies or an hour's light, and the point that is followed.
import { dayName, hourName } from "./clock.js";
import { across, down, largest } from "./map.js";
import { digits, halfWidth, scale } from "./scale.js";
import { setYear, state } from "./state.js";
import { html, nothing, svg } from "./vendor/lit-html.js";
import { luxAt, recordAt, rowsAt } from "./year.js";

/** @typedef {import("./year_job.js").YearAnswer} YearAnswer */

/** Standard errors of half an interval of 95 %. */
const COVERAGE = 1.96;
/** Least half of an interval of an autonomy in percent that is told: some hours of a year. */
const LEAST_HALF = 0.2;

/** Least end of the scale of autonomies in percent. */
const LEAST_END = 10;

/** Rows of the hour that was drawn last, so that its picture is made once. @type {WeakMap<YearAnswer, { record: number, rows: number[][] }>} */
const drawn = new WeakMap();

/** The record that day and hour choose. @param {YearAnswer} answer */
export const chosen = ({ hours }) => recordAt(hours, state.year.day, state.year.hour);

/** The map of a year, on one scale for all hours. @param {YearAnswer} answer */
export function mapOf(answer) {
  const { grid, job, hours, autonomy } = answer;
  const of = { grid, room: job.document.room, current: state.year.current };
  if (state.year.layer === "autonomy") return { ...of, rows: autonomy, unit: "%", ...scale(Math.max(LEAST_END, largest(autonomy)), 5) };
  const record = chosen(answer);
  const known = drawn.get(answer);
  const rows = known?.record === record ? known.rows : rowsAt(hours, record);
  drawn.set(answer, { record, rows });
  return { ...of, rows, unit: "lx", ...scale(hours.largest) };
}

/** Column and row of the point that is followed; at first the one with a value that is nearest to the middle. @param {YearAnswer} answer @returns {[number, number]} */
export function pinned({ grid, hours: { areas, across } }) {
  const [columns, rows] = [grid.x_m.length, grid.y_m.length];
  const [column, row] = state.year.pin ?? nearestWithValue(areas, across, [Math.floor(columns / 2), Math.floor(rows / 2)]);
  return [Math.max(0, Math.min(column, columns - 1)), Math.max(0, Math.min(row, rows - 1))];
}

/** Column and row of the sensor with a value that is nearest to a place. @param {number[]} areas of the sensors, 0 without a value @param {number} across @param {[number, number]} place @returns {[number, number]} */
function nearestWithValue(areas, across, [column, row]) {
  const away = (/** @type {number} */ sensor) => Math.hypot((sensor % across) - column, Math.floor(sensor / across) - row);
  const nearest = areas.reduce((best, area, sensor) => (area > 0 && (best < 0 || away(sensor) < away(best)) ? sensor : best), -1);
  return nearest < 0 ? [column, row] : [nearest % across, Math.floor(nearest / across)];
}

/** Place of the point that is followed in metres; none on a grid of single sensors. @param {YearAnswer} answer @returns {[number, number][]} */
export function pinnedAt(answer) {
  const [column, row] = pinned(answer);
  const [x, y] = [answer.grid.x_m[column], answer.grid.y_m[row]];
  return x === undefined || y === undefined ? [] : [[x, y]];
}

/** Number of the sensor of a point. @param {YearAnswer} answer @param {[number, number]} point */
export const sensorOf = ({ hours }, [column, row]) => row * hours.across + column;

/** Hours from the beginning of a record to its end, as "12:00 to 13:00". @param {YearAnswer} answer @param {number} hour */
export const span = ({ hours }, hour) => `${hourName(hour)} to ${hourName(hour + 1 / hours.perHour)}`;

/** The day that is shown, as "21 June". @param {YearAnswer} answer */
export const dayOfYear = ({ hours: { first } }) => dayName(first.year, first.day + state.year.day - 1);

/** Moves the point by the arrow keys, by a cell each. @param {KeyboardEvent} event @param {YearAnswer} answer */
function keys(event, answer) {
  const moves = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] });
  const move = moves[event.key];
  if (!move) return;
  event.preventDefault();
  const [column, row] = pinned(answer);
  const [columns, rows] = [answer.grid.x_m.length, answer.grid.y_m.length];
  setYear({ pin: [Math.max(0, Math.min(columns - 1, column + move[0])), Math.max(0, Math.min(rows - 1, row + move[1]))] });
}

/** The point that is followed, on the plan. @param {YearAnswer} answer @param {import("./map.js").Layout} at */
export function pin(answer, at) {
  const point = pinned(answer);
  const [[x, y] = [0, 0]] = pinnedAt(answer);
  const told = `Point ${place(answer, point)}: ${lux(answer, point)}; moved by the arrow keys`;
  return svg`<g class="pin" tabindex="0" role="button" aria-label=${told} transform=${`translate(${across(at, x)} ${down(at, y)})`}
    @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, answer)}><circle class="seen" r="6"></circle><path d="M-11 0H-3M3 0H11M0 -11V-3M0 3V11"></path></g>`;
}

/** @param {YearAnswer} answer @param {[number, number]} point */
function place({ grid }, [column, row]) {
  const [x, y] = [grid.x_m[column], grid.y_m[row]];
  return x === undefined || y === undefined ? "the first sensor" : `${x.toFixed(2)} m from west, ${y.toFixed(2)} m from south`;
}

/** @param {YearAnswer} answer @param {[number, number]} point */
function lux(answer, point) {
  const value = luxAt(answer.hours, sensorOf(answer, point), chosen(answer));
  return Number.isNaN(value) ? "no value" : `${digits(value, value < 10 ? 0.05 : 0.5)}\u202flx`;
}

/** Values at the pointer, or else at the point that is followed, in words. @param {YearAnswer} answer */
export function yearReadOut(answer) {
  const point = state.cursor ?? pinned(answer);
  const [column, row] = point;
  const [share, error] = [answer.autonomy[row]?.[column], answer.errors[row]?.[column]];
  const half = Math.max(COVERAGE * (error ?? 0), LEAST_HALF);
  const autonomy =
    share === undefined || Number.isNaN(share) ? nothing : html`; ${answer.wanted.lux}\u202flx in ${digits(share, half)} ±\u202f${halfWidth(half)}\u202f% of the hours`;
  return html`<p class="readout"><strong id="at-point">${lux(answer, point)}</strong> on ${dayOfYear(answer)}, ${span(answer, state.year.hour)}${autonomy}
    <small>at ${place(answer, point)}</small></p>`;
}
