// Columns of a job's page: how wide they are, and which panel stands in which, so that all end at about the same height.

/** Space between panels, least width of columns that are equal, and most columns. */
const GAP = 12;
const LEAST = 460;
const MOST = 3;
/** Parts of the page of which widths are multiples; least and greatest width as shares of equal columns. */
const PARTS = 24;
const SHARES = { least: 0.74, most: 1.4 };
/** What it costs that columns end at different heights by more than a share, that what comes first stands low, and that the map is narrow. */
const UNEVEN = { from: 0.01, cost: 10 };
const LOW = 0.3;
const NARROW = 0.6;

/** Columns of certain widths, and the column of each panel. @typedef {{ widths: number[], of: number[] }} Columns */
/** Height of a panel in a column of a width. @typedef {(panel: number, width: number) => number} Height */

/** All ways to divide parts of a page among columns. @param {number} columns @param {number} parts @param {number} least @param {number} most @returns {number[][]} */
function divided(columns, parts, least, most) {
  if (columns === 1) return parts >= least && parts <= most ? [[parts]] : [];
  const firsts = Array.from({ length: Math.floor(most) }, (_, i) => i + 1).filter((first) => first >= least);
  return firsts.flatMap((first) => divided(columns - 1, parts - first, least, most).map((rest) => [first, ...rest]));
}

/** Widths of columns that are tried on a page of a width; one column alone is as wide as the page. @param {number} width */
function allWidths(width) {
  const count = Math.max(1, Math.min(MOST, Math.floor((width + GAP) / (LEAST + GAP))));
  const part = (width - GAP * (count - 1)) / PARTS;
  const [least, most] = [SHARES.least, SHARES.most].map((share) => (share * PARTS) / count);
  return divided(count, PARTS, Number(least), Number(most)).map((ways) => ways.map((parts) => Math.floor(parts * part)));
}

/** Where panels stand in their columns, and where these end. @param {Columns} columns @param {Height} height */
function stacked({ widths, of }, height) {
  const ends = widths.map(() => 0);
  const tops = of.map((column, panel) => {
    const top = ends[column] ?? 0;
    ends[column] = top + height(panel, widths[column] ?? 0) + GAP;
    return top;
  });
  return { ends, tops };
}

/** @param {Columns} columns @param {Height} height @param {number} map panel that is the better the wider it is; -1 where there is none */
function cost(columns, height, map) {
  const { ends, tops } = stacked(columns, height);
  const longest = Math.max(...ends);
  const uneven = 1 - Math.min(...ends) / longest;
  // the first half of the panels: what was asked for, and what came out
  const first = tops.slice(0, Math.ceil(tops.length / 2));
  const low = first.reduce((sum, top) => sum + top / longest, 0) / first.length;
  const width = columns.widths[columns.of[map] ?? -1];
  const narrow = width ? 1 - width / columns.widths.reduce((sum, one) => sum + one, 0) : 0;
  return UNEVEN.cost * Math.max(0, uneven - UNEVEN.from) + LOW * low + NARROW * narrow;
}

/** Columns that differ from others by one panel, or by two that change places; the first panel stays. @param {Columns} columns @returns {Columns[]} */
function beside({ widths, of }) {
  const moved = of.flatMap((column, panel) => widths.flatMap((_, to) => (panel > 0 && to !== column ? [of.with(panel, to)] : [])));
  const changed = of.flatMap((a, one) => of.flatMap((b, other) => (one > 0 && other > one && a !== b ? [of.with(one, b).with(other, a)] : [])));
  return [...moved, ...changed].map((of) => ({ widths, of }));
}

/** Columns with each panel, in some order, in the shortest one. @param {number[]} order @param {number[]} widths @param {Height} height @returns {Columns} */
function filled(order, widths, height) {
  const ends = widths.map(() => 0);
  const of = order.map(() => 0);
  for (const panel of order) {
    const column = ends.indexOf(Math.min(...ends));
    ends[column] = (ends[column] ?? 0) + height(panel, widths[column] ?? 0) + GAP;
    of[panel] = column;
  }
  return { widths, of };
}

/** Columns after as many steps as make them better. @param {Columns} from @param {Height} height @param {number} map */
function bettered(from, height, map) {
  let [best, least] = [from, cost(from, height, map)];
  for (;;) {
    const next = beside(best).map((one) => ({ one, of: cost(one, height, map) })).reduce((a, b) => (b.of < a.of ? b : a), { one: best, of: least });
    if (next.of >= least) return { best, least };
    [best, least] = [next.one, next.of];
  }
}

/**
 * The columns for so many panels on a page of a width: of all widths, each panel after the other, or the highest first, in the shortest
 * column, and from there as long as a step makes them better.
 * @param {number} panels
 * @param {number} width
 * @param {Height} height
 * @param {number} [map]
 * @returns {Columns}
 */
export function columns(panels, width, height, map = -1) {
  const inOrder = Array.from({ length: panels }, (_, panel) => panel);
  const ways = allWidths(width).flatMap((widths) => {
    const [first = 0, ...others] = inOrder;
    const byHeight = [first, ...others.toSorted((a, b) => height(b, widths[0] ?? 0) - height(a, widths[0] ?? 0))];
    return [inOrder, byHeight].map((order) => bettered(filled(order, widths, height), height, map));
  });
  return ways.reduce((a, b) => (b.least < a.least ? b : a)).best;
}

/** What the columns were found for, and what was found. @type {{ key: string, found: Columns | null }} */
let last = { key: "", found: null };
/** Panels whose sizes are followed. @type {WeakSet<Element>} */
const followed = new WeakSet();
// a picture that is loaded makes its panel higher
const sizes = new ResizeObserver((entries) => {
  const host = entries[0]?.target.closest(".columns");
  if (host) place(/** @type {HTMLElement} */ (host));
});

/** Stands the panels of a page in columns; a panel that is unfolded moves those below it alone. @param {HTMLElement} host */
export function place(host) {
  const panels = /** @type {HTMLElement[]} */ ([...host.children].filter((one) => one.matches(".panel")));
  if (!panels.length) return;
  const width = host.clientWidth;
  const pictures = [...host.querySelectorAll("img")].filter(({ complete }) => complete).length;
  const key = `${width} ${pictures} ${panels.map((panel) => panel.getAttribute("aria-label")).join()}`;
  if (last.key !== key) last = { key, found: found(panels, width) };
  const { found: columns } = last;
  if (columns) {
    panels.forEach((panel, index) => (panel.style.width = `${columns.widths[columns.of[index] ?? 0]}px`));
    const { ends, tops } = stacked(columns, (panel) => panels[panel]?.offsetHeight ?? 0);
    const lefts = columns.widths.map((_, at) => columns.widths.slice(0, at).reduce((sum, one) => sum + one + GAP, 0));
    panels.forEach((panel, index) => Object.assign(panel.style, { left: `${lefts[columns.of[index] ?? 0]}px`, top: `${tops[index]}px` }));
    host.style.height = `${Math.max(...ends) - GAP}px`;
  }
  for (const one of [host, ...panels]) {
    if (!followed.has(one)) sizes.observe(one);
    followed.add(one);
  }
}

/** The columns for panels as high as they are when folded; null where each takes the whole width. @param {HTMLElement[]} panels @param {number} width */
function found(panels, width) {
  const host = /** @type {HTMLElement} */ (panels[0]?.parentElement);
  const widths = allWidths(width);
  const inColumns = (widths[0]?.length ?? 1) > 1;
  host.classList.toggle("beside", inColumns);
  if (!inColumns) {
    for (const one of [host, ...panels]) Object.assign(one.style, { width: "", height: "", left: "", top: "" });
    return null;
  }
  // columns do not depend on what is unfolded at the moment
  host.classList.add("folded");
  const heights = new Map([...new Set(widths.flat())].map((of) => {
    panels.forEach((panel) => (panel.style.width = `${of}px`));
    return [of, panels.map(({ offsetHeight }) => offsetHeight)];
  }));
  host.classList.remove("folded");
  // of a year its autonomy comes before the map of an overcast sky
  const map = panels.findIndex((one) => one.matches(".map, [aria-label='Daylight autonomy']"));
  return columns(panels.length, width, (panel, of) => heights.get(of)?.[panel] ?? 0, map);
}
