// Numbers people would write, colours of values, and intervals of means.

/**
 * Steps of an axis that people would write: 1, 2 or 5 times a power of ten, at most so many up to the end.
 * @param {number} end
 * @param {number} most
 */
export function step(end, most) {
  const power = 10 ** Math.floor(Math.log10(Math.max(end, 1e-12) / most));
  return power * ([1, 2, 5, 10].find((times) => end / (power * times) <= most + 1e-9) ?? 10);
}

/** The end of a scale from 0 that holds a value, and its ticks. @param {number} value @param {number} [most] */
export function scale(value, most = 7) {
  const by = step(Math.max(value, 1e-9), most);
  const count = Math.max(1, Math.ceil(value / by - 1e-9));
  return { end: count * by, ticks: Array.from({ length: count + 1 }, (_, i) => tidy(i * by)) };
}

/** Without the dust of binary fractions. @param {number} value */
export const tidy = (value) => Number(value.toPrecision(10));

// viridis at nine equal steps (van der Walt and Smith, 2015, CC0), and a diverging map from blue over grey to red
const RISING = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"].map(channels);
const DIVERGING = ["2166ac", "67a9cf", "d1e5f0", "f7f7f7", "fddbc7", "ef8a62", "b2182b"].map(channels);

/** @param {string} hex @returns {[number, number, number]} */
function channels(hex) {
  const at = (/** @type {number} */ i) => parseInt(hex.slice(i, i + 2), 16);
  return [at(0), at(2), at(4)];
}

/** @param {[number, number, number][]} ramp @param {number} share 0..1 @returns {[number, number, number]} */
function mixed(ramp, share) {
  const place = Math.max(0, Math.min(1, share)) * (ramp.length - 1);
  const index = Math.min(Math.floor(place), ramp.length - 2);
  const black = /** @type {[number, number, number]} */ ([0, 0, 0]);
  const [low, high] = /** @type {const} */ ([ramp[index] ?? black, ramp[index + 1] ?? black]);
  const at = (/** @type {0 | 1 | 2} */ k) => Math.round(low[k] + (high[k] - low[k]) * (place - index));
  return [at(0), at(1), at(2)];
}

/** Colour of a share 0..1 of a scale. @param {number} share */
export const rising = (share) => mixed(RISING, share);
/** Colour of a difference -1..1. @param {number} share */
export const diverging = (share) => mixed(DIVERGING, (share + 1) / 2);

/** A picture of rows of colours, the last row on top, as a data address. @param {number[][][]} rows red, green, blue and opacity, 255 where it is left out */
export function picture(rows) {
  const canvas = document.createElement("canvas");
  canvas.width = rows[0]?.length ?? 1;
  canvas.height = Math.max(rows.length, 1);
  const context = canvas.getContext("2d");
  if (!context) return "";
  const pixels = context.createImageData(canvas.width, canvas.height);
  rows
    .toReversed()
    .flat()
    .forEach(([r = 0, g = 0, b = 0, opacity = 255], i) => pixels.data.set([r, g, b, opacity], 4 * i));
  context.putImageData(pixels, 0, 0);
  return canvas.toDataURL();
}

/**
 * Places behind the point that half an interval leaves: two digits of it from 1.0 to 1.9, one above.
 * @param {number} half
 */
const places = (half) => (half > 0 ? Math.max(0, Math.min(4, Math.ceil(Math.log10(1.95 / half)))) : 1);

/** A value with the digits that half its interval leaves it. @param {number} value @param {number} half */
export const digits = (value, half) =>
  value === 0 ? "0" : Math.abs(value) >= 10_000 ? thousands(value) : value.toFixed(places(half));

/** @param {number} half */
export const halfWidth = (half) => (half >= 1.95 ? thousands(half) : half.toFixed(places(half)));

/** Whole, with narrow spaces between the thousands. @param {number} value */
export const thousands = (value) =>
  Math.round(value)
    .toString()
    .replace(/\B(?=(\d{3})+$)/g, "\u202f");

// two-sided quantiles of Student's distribution at 95 % for 1 to 30 degrees of freedom
const STUDENT = [
  12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.16, 2.145, 2.131, 2.12, 2.11, 2.101,
  2.093, 2.086, 2.08, 2.074, 2.069, 2.064, 2.06, 2.056, 2.052, 2.048, 2.045, 2.042,
];

/**
 * How many standard errors the interval of 95 % has on either side: as a result says, or, of one that was kept before results said
 * so, after so many passes.
 * @param {{ coverage_factor?: number | null } | undefined} of a grid, for its sensors, or its statistics
 * @param {number} passes
 */
export const coverage = (of, passes) => of?.coverage_factor ?? STUDENT[Math.max(passes, 2) - 2] ?? 1.96;
