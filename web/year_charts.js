// The light of the tubes by month, and the light of a day by the hour.
import { scale, thousands } from "./scale.js";
import { state } from "./state.js";
import { nothing, svg } from "./vendor/lit-html.js";
import { dayOf, largestOf, monthly, months } from "./year.js";
import { dayOfYear, pinned, sensorOf } from "./year_plan.js";
import { MONTHS } from "./year_strip.js";

const AROUND = { left: 44, right: 8, top: 14, bottom: 22 };
/** Height of a step of an axis. */
const STEP = 36;

/** Axis of values from 0, with its lines. @param {[number, number]} size @param {number} most @param {string} unit */
function axis([width, height], most, unit) {
  const { left, right, top, bottom } = AROUND;
  const high = height - top - bottom;
  const { end, ticks } = scale(most, Math.max(2, Math.floor(high / STEP)));
  const y = (/** @type {number} */ value) => top + high * (1 - value / end);
  const lines = ticks.map(
    (tick, i) => svg`<line class="rule" x1=${left} x2=${width - right} y1=${y(tick)} y2=${y(tick)}></line><text class="end"
      x=${left - 5} y=${y(tick) + 4}>${tick}</text>${i === ticks.length - 1 ? svg`<text x=${left + 3} y=${y(tick) - 3}>${unit}</text>` : nothing}`,
  );
  return { y, end, lines };
}

/** Month of the day that is shown, from 0. @param {import("./year_job.js").YearAnswer} answer */
const monthShown = ({ hours }) => months(hours).find(({ from, to }) => from <= state.year.day && state.year.day < to)?.month ?? 0;

/** The light of the month that is shown, in words. @param {import("./year_job.js").YearAnswer} answer */
export function ofMonth(answer) {
  const month = monthShown(answer);
  return `${MONTHS[month]}: ${thousands(monthly(answer.summary)[month] ?? 0)}`;
}

/** Bars of the months, that of the day that is shown in another colour. */
export function monthBars() {
  const { answer } = state.year;
  if (!answer) return nothing;
  const [width, height] = state.sizes.months;
  const values = monthly(answer.summary);
  const { y, lines } = axis([width, height], Math.max(...values), "klm\u202fh");
  const now = monthShown(answer);
  const wide = (width - AROUND.left - AROUND.right) / 12;
  const told = values.map((value, month) => `${MONTHS[month]} ${value.toFixed(0)}`).join(", ");
  return svg`<svg class="months" viewBox=${`0 0 ${width} ${height}`} role="img" aria-label=${`Light of all tubes in klm h: ${told}`}>
    ${lines}
    ${values.map(
      (value, month) => svg`<rect class=${month === now ? "month now" : "month"} x=${AROUND.left + wide * (month + 0.12)} width=${0.76 * wide}
        y=${y(value)} height=${y(0) - y(value)}></rect>
      <text class="middle" x=${AROUND.left + wide * (month + 0.5)} y=${height - 7}>${MONTHS[month]?.slice(0, wide < 28 ? 1 : 3)}</text>`,
    )}</svg>`;
}

/** Curves of the day that is shown, at the point and in the mean, on one scale for all days. */
export function dayCurve() {
  const { answer, day, hour } = state.year;
  if (!answer) return nothing;
  const { hours, wanted } = answer;
  const [width, height] = state.sizes.day;
  const sensor = sensorOf(answer, pinned(answer));
  const { y, end, lines } = axis([width, height], Math.max(largestOf(hours, sensor), ...dayOf(hours, null, day)), "lx");
  const x = (/** @type {number} */ of) => AROUND.left + ((width - AROUND.left - AROUND.right) * of) / 24;
  const middle = (/** @type {number} */ record) => (record + 0.5) / hours.perHour;
  const curve = (/** @type {number[]} */ values) =>
    values.flatMap((value, i) => (Number.isNaN(value) ? [] : [`${x(middle(i)).toFixed(1)},${y(value).toFixed(1)}`])).join(" ");
  const atPoint = dayOf(hours, sensor, day);
  const now = Math.floor(hour * hours.perHour + 1e-6);
  const most = atPoint.reduce((best, value, i) => (value > (atPoint[best] ?? 0) ? i : best), 0);
  return svg`<svg class="day" viewBox=${`0 0 ${width} ${height}`} role="img"
    aria-label=${`Illuminance at the point on ${dayOfYear(answer)}: ${Number.isNaN(atPoint[most]) ? "no value" : `at most ${(atPoint[most] ?? 0).toFixed(0)} lx, at ${middle(most)} h`}`}>
    ${lines}
    ${[0, 3, 6, 9, 12, 15, 18, 21, 24].map((of) => svg`<line class="rule" x1=${x(of)} x2=${x(of)} y1=${y(0)} y2=${y(0) + 4}></line><text
      class=${of === 24 ? "end" : "middle"} x=${of === 24 ? width : x(of)} y=${height - 5}>${of}</text>`)}
    ${wanted.lux <= end ? svg`<line class="target" x1=${x(0)} x2=${x(24)} y1=${y(wanted.lux)} y2=${y(wanted.lux)}></line>` : nothing}
    <polyline class="curve of-mean" points=${curve(dayOf(hours, null, day))}></polyline>
    <polyline class="curve" points=${curve(atPoint)}></polyline>
    ${atPoint[now] === undefined || Number.isNaN(atPoint[now]) ? nothing : svg`<circle class="now" cx=${x(middle(now))} cy=${y(atPoint[now])} r="4"></circle>`}</svg>`;
}
