// The map of values over the room: cells, lines, scale. The plan, the comparison and the page of a job draw it.
import { centimetres } from "./draft.js";
import { carriedOut, labelled, lines } from "./isolux.js";
import { path } from "./outline.js";
import { refined } from "./refined.js";
import { extent, hasPlan, rings } from "./room.js";
import { picture, rising, scale, tidy } from "./scale.js";
import { nothing, svg } from "./vendor/lit-html.js";

/**
 * How metres become units of the drawing: `left` is where x is 0, `top` where y is `north`. The size of the drawing.
 * @typedef {{ k: number, left: number, top: number, north: number, box: [number, number] }} Layout
 */

/** @param {Layout} at @param {number} x */
export const across = (at, x) => at.left + at.k * x;
/** @param {Layout} at @param {number} y */
export const down = (at, y) => at.top + at.k * (at.north - y);

/** What the map shows: values, unit. @param {Grid} grid @param {"lux" | "daylight_factor"} layer */
export function values(grid, layer) {
  const factors = layer === "daylight_factor" ? grid.daylight_factor_percent : null;
  return factors
    ? { rows: numbers(factors), unit: "%" }
    : { rows: numbers(grid.illuminance_lux), unit: "lx" };
}

/** @type {WeakMap<(number | null)[][], number[][]>} */
const filled = new WeakMap();

/** The same rows with no number where there is no value: inside solids. @param {(number | null)[][]} rows */
function numbers(rows) {
  const known = filled.get(rows) ?? rows.map((row) => row.map((value) => value ?? NaN));
  filled.set(rows, known);
  return known;
}

/** Largest of the values. @param {number[][]} rows */
export const largest = (rows) => Math.max(0, ...rows.flat().filter((value) => !Number.isNaN(value)));

/** Edges of the map in metres: west, south, east, north. @param {Pick<Grid, "x_m" | "y_m">} grid @returns {[number, number, number, number]} */
export function edges(grid) {
  const half = (/** @type {number[]} */ centres) =>
    centres.length > 1 ? ((centres[1] ?? 0) - (centres[0] ?? 0)) / 2 : (centres[0] ?? 0);
  const [dx, dy] = [half(grid.x_m), half(grid.y_m)];
  return [(grid.x_m[0] ?? 0) - dx, (grid.y_m[0] ?? 0) - dy, (grid.x_m.at(-1) ?? 0) + dx, (grid.y_m.at(-1) ?? 0) + dy];
}

/** Colours of cells inside solids, and outside the room. @type {{ solid: [number, number, number], outside: [number, number, number, number] }} */
const NO_VALUE = { solid: [232, 232, 232], outside: [0, 0, 0, 0] };

/**
 * Red, green, blue and opacity of each cell, which is 255 where it is left out.
 * @param {Pick<Grid, "area_m2">} grid
 * @param {number[][]} rows
 * @param {(value: number) => [number, number, number]} colour
 */
export function coloured(grid, rows, colour) {
  const none = (/** @type {number} */ i, /** @type {number} */ j) => (grid.area_m2?.[j]?.[i] === 0 ? NO_VALUE.outside : NO_VALUE.solid);
  return rows.map((row, j) => row.map((value, i) => (Number.isNaN(value) ? none(i, j) : colour(value))));
}

/** @type {WeakMap<number[][], Map<string, string>>} */
const pictures = new WeakMap();

/**
 * The cells as a picture; made once for each grid and scale.
 * @param {Pick<Grid, "x_m" | "y_m" | "area_m2">} grid
 * @param {number[][]} rows
 * @param {Layout} at
 * @param {string} key
 * @param {(value: number) => [number, number, number]} colour
 * @param {string} [style]
 */
export function cells(grid, rows, at, key, colour, style = "cells") {
  const known = pictures.get(rows) ?? new Map();
  pictures.set(rows, known);
  const address = known.get(key) ?? picture(coloured(grid, rows, colour));
  known.set(key, address);
  const [west, south, east, north] = edges(grid);
  return svg`<image class=${style} href=${address} x=${across(at, west)} y=${down(at, north)} width=${at.k * (east - west)}
    height=${at.k * (north - south)} preserveAspectRatio="none"></image>`;
}

/** @type {WeakMap<number[][], number[][]>} */
const carried = new WeakMap();

/** Rows whose values reach the walls of a plan; made once for each answer. @param {Grid} grid @param {number[][]} rows @param {JobDocument["room"]} room */
export function reaching(grid, rows, room) {
  if (!hasPlan(room)) return rows;
  const known = carried.get(rows) ?? carriedOut(grid, rows, rings(room));
  carried.set(rows, known);
  return known;
}

/**
 * The values in colours from 0 to the end of a scale, smooth between the centres of cells.
 * @param {Grid} grid
 * @param {number[][]} rows
 * @param {Layout} at
 * @param {number} end
 */
export function lux(grid, rows, at, end) {
  const fine = refined(grid, rows);
  return cells(fine.grid, fine.rows, at, `lux ${end}`, (value) => rising(value / end), "cells smooth");
}

/** Outline of a room, and the holes in it, as a path. @param {JobDocument["room"]} room @param {Layout} at */
const drawn = (room, at) =>
  path(
    rings(room),
    (x) => across(at, x),
    (y) => down(at, y),
  );

/** The floor, or the frame of its map. @param {JobDocument["room"]} room @param {Layout} at @param {"floor" | "frame"} as */
export function outlined(room, at, as) {
  const { west, north, width, depth } = extent(room);
  return hasPlan(room)
    ? svg`<path class=${as} fill-rule="evenodd" d=${drawn(room, at)}></path>`
    : svg`<rect class=${as} x=${across(at, west)} y=${down(at, north)} width=${at.k * width} height=${at.k * depth}></rect>`;
}

/** Distance of dimension lines from the room, half of the strokes at their ends, and half of the gap for their lengths. */
const DIMENSION = { away: 18, end: 4, gap: 22 };

/** Width and depth of a room beside its drawing, each on a line from end to end. @param {JobDocument["room"]} room @param {Layout} at */
export function measures(room, at) {
  const { west, south, east, north, width, depth } = extent(room);
  const [x, y] = [across(at, west) - 14, down(at, (south + north) / 2)];
  const { away, end, gap } = DIMENSION;
  const [row, column] = [down(at, south) + away, across(at, west) - away];
  /** The two parts of a line along an axis, from one end to the gap and from the gap to the other. @param {"H" | "V"} along @param {number} from @param {number} to */
  const line = (along, from, to) => {
    const [middle, half] = [(from + to) / 2, Math.min(gap, Math.abs(to - from) / 2) * Math.sign(to - from)];
    const start = (/** @type {number} */ of) => (along === "H" ? `M${of} ${row}` : `M${column} ${of}`);
    const stroke = (/** @type {number} */ of) => (along === "H" ? `M${of} ${row - end}v${2 * end}` : `M${column - end} ${of}h${2 * end}`);
    return `${start(from)}${along}${middle - half}${start(to)}${along}${middle + half}${stroke(from)}${stroke(to)}`;
  };
  const lines = line("H", across(at, west), across(at, east)) + line("V", down(at, south), down(at, north));
  return svg`<path class="dimension" d=${lines}></path>
    <text class="measure" x=${across(at, (west + east) / 2)} y=${down(at, south) + 22}>${centimetres(width)} m</text>
    <text class="measure" x=${x} y=${y} transform=${`rotate(-90 ${x} ${y})`}>${centimetres(depth)} m</text>`;
}

/** What hides the parts of cells and lines outside a plan. @param {JobDocument["room"]} room @param {Grid} grid @param {Layout} at */
export function outside(room, grid, at) {
  if (!hasPlan(room)) return nothing;
  const [west, south, east, north] = edges(grid);
  const around = `M${across(at, west) - 1} ${down(at, north) - 1}H${across(at, east) + 1}V${down(at, south) + 1}H${across(at, west) - 1}Z`;
  return svg`<path class="outside" fill-rule="evenodd" d=${around + drawn(room, at)}></path>`;
}

/** @type {WeakMap<number[][], Map<number, [number, number][][]>>} */
const found = new WeakMap();

/** Lines at a level, found once for each answer. @param {number[][]} rows @param {number} level @param {() => [number, number][][]} find @returns {[number, number][][]} */
function once(rows, level, find) {
  const of = found.get(rows) ?? new Map();
  found.set(rows, of);
  const all = of.get(level) ?? find();
  of.set(level, all);
  return all;
}

/** Illuminances from which on a scale is in klx: longer numbers have no room beside it. */
const KLX = 10_000;

/** The unit in which a map is labelled, on its scale and its lines, and by what its values are divided. @param {string} unit of the values @param {number} end of the scale */
const labelUnit = (unit, end) => (unit === "lx" && end >= KLX ? { ends: "klx", by: 1000 } : { ends: unit, by: 1 });

/**
 * Lines at levels people would write, labelled in the unit of the scale.
 * @param {Grid} grid
 * @param {number[][]} rows
 * @param {Layout} at
 * @param {JobDocument["room"]} room
 * @param {[number, number][]} taken
 * @param {string} unit of the values
 * @param {number} end of the scale beside the map
 */
export function isolines(grid, rows, at, room, taken, unit, end) {
  const { ticks } = scale(largest(rows) * 0.98, 7);
  const { by } = labelUnit(unit, end);
  const [west, south, east, north] = edges(grid);
  const inTheWay = [...taken];
  const walls = [...rings(room), ...(room.partitions ?? []).map(({ from_m, to_m }) => [from_m, to_m])];
  const of = (/** @type {[number, number]} */ [x, y]) => `${across(at, x).toFixed(1)},${down(at, y).toFixed(1)}`;
  const fine = refined(grid, reaching(grid, rows, room));
  const levels = ticks.slice(1).map((level) => ({ level, found: once(fine.rows, level, () => lines(fine.grid, fine.rows, level)) }));
  const paths = levels.map(
    ({ found }) => svg`<path class="iso" d=${found.map((line) => `M${line.map(of).join("L")}`).join("")}></path>`,
  );
  const labels = levels.map(({ level, found }) => {
    const text = String(tidy(level / by));
    const gap = Math.max(26, 9 * text.length) / at.k;
    // half of a label beyond the map would stand on nothing
    const onMap = found.map((line) => line.filter(([x, y]) => Math.min(x - west, east - x, y - south, north - y) >= gap / 2));
    const place = labelled(onMap, inTheWay, walls, gap);
    if (!place) return null;
    inTheWay.push(place);
    return svg`<text class="level" x=${across(at, place[0])} y=${down(at, place[1]) + 4}>${text}</text>`;
  });
  return [paths, labels];
}

/** Height that a label of a scale takes. */
const LABEL = 13;

/**
 * The scale beside the map.
 * @param {number} end
 * @param {number[]} ticks
 * @param {string} unit
 * @param {number} x
 * @param {number} top
 * @param {number} height
 */
export function bar(end, ticks, unit, x, top, height) {
  const steps = 64;
  const { ends, by } = labelUnit(unit, end);
  const at = (/** @type {number} */ share) => top + height * (1 - share);
  // as many labels as have room, the highest among them
  const every = Math.ceil((LABEL * (ticks.length - 1)) / height) || 1;
  const rects = Array.from({ length: steps }, (_, i) => {
    const colour = `rgb(${rising((i + 0.5) / steps)})`;
    return svg`<rect x=${x} y=${at((i + 1) / steps)} width="12" height=${height / steps + 0.5} fill=${colour}></rect>`;
  });
  return svg`<g class="scale">${rects}
    ${ticks.map((tick, i) =>
      (ticks.length - 1 - i) % every
        ? nothing
        : svg`<text x=${x + 18} y=${at(tick / end) + 4}>${tidy(tick / by)}${i === ticks.length - 1 ? `\u202f${ends}` : ""}</text>`,
    )}</g>`;
}

/**
 * A scale that lies below maps, from one value over the middle to the other.
 * @param {number} from
 * @param {number} to
 * @param {string} unit
 * @param {(value: number) => [number, number, number]} colour
 * @param {number} width
 */
export function legend(from, to, unit, colour, width) {
  const steps = 64;
  const middle = (from + to) / 2;
  const label = (/** @type {number} */ value) => `${from < 0 && value > 0 ? "+" : ""}${tidy(value)}`.replace("-", "\u2212");
  return svg`<svg class="legend" viewBox=${`0 0 ${width} 30`} role="img" aria-label=${`Scale from ${from} to ${to} ${unit}`}>
    ${Array.from(
      { length: steps },
      (_, i) => svg`<rect x=${(width * i) / steps} y="0" width=${width / steps + 0.5} height="10"
      fill=${`rgb(${colour(from + ((to - from) * (i + 0.5)) / steps)})`}></rect>`,
    )}
    <text x="0" y="25">${label(from)}</text><text class="middle" x=${width / 2} y="25">${label(middle)}</text><text class="end"
      x=${width} y="25">${label(to)}\u202f${unit}</text></svg>`;
}
