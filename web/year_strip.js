// The year by day and hour: the mean illuminance in colours, and the hour that is shown.
import { bar, largest } from "./map.js";
import { picture, rising, scale } from "./scale.js";
import { setYear, state } from "./state.js";
import { nothing, svg } from "./vendor/lit-html.js";
import { byHour, months } from "./year.js";
import { dayOfYear, span } from "./year_plan.js";

const AROUND = { left: 40, right: 70, top: 6, bottom: 24 };
/** Width of a month in which its name has room. */
const NAMED = 34;
export const MONTHS = ["January", "February", "March", "April", "May", "June", "July", "August", "September", "October", "November", "December"];

/** Pictures of years, each made once. @type {WeakMap<import("./year.js").YearHours, { href: string, end: number, ticks: number[] }>} */
const pictures = new WeakMap();

/** @param {import("./year.js").YearHours} hours */
function drawn(hours) {
  const rows = byHour(hours);
  const { end, ticks } = scale(largest(rows), 4);
  const of = { href: picture(rows.map((row) => row.map((value) => (Number.isNaN(value) ? [0, 0, 0, 0] : rising(value / end))))), end, ticks };
  pictures.set(hours, of);
  return of;
}

/** Chooses the hour under the pointer. @param {PointerEvent} event @param {import("./year.js").YearHours} hours */
function choose(event, { days, perHour }) {
  const { left, bottom, width, height } = /** @type {SVGElement} */ (event.currentTarget).getBoundingClientRect();
  const [across, up] = [(event.clientX - left) / width, (bottom - event.clientY) / height].map((share) => Math.max(0, Math.min(share, 1 - 1e-9)));
  setYear({ day: 1 + Math.floor((across ?? 0) * days), hour: Math.floor((up ?? 0) * 24 * perHour) / perHour });
}

/** The strip. */
export function strip() {
  const { answer, day, hour } = state.year;
  if (!answer) return nothing;
  const { hours } = answer;
  const { href, end, ticks } = pictures.get(hours) ?? drawn(hours);
  const [width, height] = state.sizes.strip;
  const { left, top } = AROUND;
  const [wide, high] = [width - left - AROUND.right, height - top - AROUND.bottom];
  const letters = (wide * 365) / 12 / hours.days < NAMED ? 1 : 3;
  const x = (/** @type {number} */ of) => left + (wide * (of - 1)) / hours.days;
  const y = (/** @type {number} */ of) => top + high * (1 - of / 24);
  const pressed = (/** @type {PointerEvent} */ event) => event.buttons === 1 && choose(event, hours);
  const [atX, atY] = [x(day + 0.5), y(hour + 0.5 / hours.perHour)];
  return svg`<svg class="strip" viewBox=${`0 0 ${width} ${height}`} role="img"
    aria-label=${`Mean illuminance by day and hour in colours up to ${end} lx; shown is ${dayOfYear(answer)}, ${span(answer, hour)}`}>
    <image class="cells" href=${href} x=${left} y=${top} width=${wide} height=${high} preserveAspectRatio="none"></image>
    ${months(hours).map(
      ({ month, from, to }) => svg`<line class="tick" x1=${x(from)} x2=${x(from)} y1=${top + high} y2=${top + high + 5}></line>
        <text class="middle" x=${x((from + to) / 2)} y=${height - 7}>${MONTHS[month]?.slice(0, letters)}</text>`,
    )}
    ${[0, 6, 12, 18, 24].map((of) => svg`<text class="end" x=${left - 6} y=${y(of) + 4}>${of}\u202fh</text>`)}
    <path class="cross" d=${`M${atX} ${top}V${top + high}M${left} ${atY}H${left + wide}`}></path>
    <circle class="spot" cx=${atX} cy=${atY} r="5"></circle>
    <rect class="sheet" x=${left} y=${top} width=${wide} height=${high} @pointerdown=${pressed} @pointermove=${pressed}></rect>
    ${bar(end, ticks, "lx", left + wide + 12, top, high)}</svg>`;
}
