// Columns of a job's page: how wide they are, and which panel stands in which, so that all end at about the same height.

/** Space between panels, least width of columns that are equal, and most columns. */
const GAP = 12;
const LEAST = 460;
const MOST = 3;
/** Parts of the page of which widths are multiples; least and greatest width as shares of equal columns. */
const PARTS = 24;
const SHARES = { least: 0.74, most: 1.5 };
/** What it costs that columns end at different heights by more than a share, or above the end of the screen, that what comes first stands low, and that the map is narrow. */
const UNEVEN = { from: 0.01, cost: 10 };
const SHORT = { from: 0.05, cost: 4 };
const LOW = 0.3;
const NARROW = 0.6;
/** What it costs, once a panel is unfolded, that panels have other widths, and that it stands higher or lower. */
const RESIZED = 0.15;
const SHIFTED = 4;

/** Columns of certain widths, and the column of each panel. @typedef {{ widths: number[], of: number[] }} Columns */
/** Height of a panel in a column of a width. @typedef {(panel: number, width: number) => number} Height */
/** What columns should be: `map` is the panel that is the better the wider it is, -1 where there is none; `least` the height of the screen that they should fill; `tops` are those of panels that should stay where they are. @typedef {{ map: number, least: number, tops?: [number, number][] }} Wish */
/** Whether a panel may stand in a column. @typedef {(panel: number, column: number) => boolean} May */

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

/** @param {Columns} columns @param {Height} height @param {Wish} wish */
function cost(columns, height, { map, least, tops: kept = [] }) {
  const { ends, tops } = stacked(columns, height);
  const longest = Math.max(...ends);
  const uneven = 1 - Math.min(...ends) / longest;
  // the first half of the panels: what was asked for, and what came out
  const first = tops.slice(0, Math.ceil(tops.length / 2));
  const low = first.reduce((sum, top) => sum + top / longest, 0) / first.length;
  const width = columns.widths[columns.of[map] ?? -1];
  const narrow = width ? 1 - width / columns.widths.reduce((sum, one) => sum + one, 0) : 0;
  const shifted = kept.reduce((sum, [panel, top]) => sum + Math.abs((tops[panel] ?? 0) - top), 0) / longest;
  const short = least ? 1 - longest / least : 0;
  return UNEVEN.cost * Math.max(0, uneven - UNEVEN.from) + SHORT.cost * Math.max(0, short - SHORT.from) + SHIFTED * shifted + LOW * low + NARROW * narrow;
}

/** Columns that differ from others by one panel, or by two that change places. @param {Columns} columns @param {May} may @returns {Columns[]} */
function beside({ widths, of }, may) {
  const moved = of.flatMap((column, panel) => widths.flatMap((_, to) => (to !== column && may(panel, to) ? [of.with(panel, to)] : [])));
  const changed = of.flatMap((a, one) => of.flatMap((b, other) => (other > one && a !== b && may(one, b) && may(other, a) ? [of.with(one, b).with(other, a)] : [])));
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

/** Columns after as many steps as make them better. @param {Columns} from @param {Height} height @param {Wish} wish @param {May} may */
function bettered(from, height, wish, may) {
  let [best, least] = [from, cost(from, height, wish)];
  for (;;) {
    const next = beside(best, may).map((one) => ({ one, of: cost(one, height, wish) })).reduce((a, b) => (b.of < a.of ? b : a), { one: best, of: least });
    if (next.of >= least) return { best, least };
    [best, least] = [next.one, next.of];
  }
}

/**
 * The columns for so many panels on a page of a width: of all widths, each panel after the other, or the highest first, in the shortest
 * column, and from there as long as a step makes them better; the first panel stays.
 * @param {number} panels
 * @param {number} width
 * @param {Height} height
 * @param {Wish} [wish]
 * @returns {Columns}
 */
export function columns(panels, width, height, wish = { map: -1, least: 0 }) {
  const inOrder = Array.from({ length: panels }, (_, panel) => panel);
  const ways = allWidths(width).flatMap((widths) => {
    const [first = 0, ...others] = inOrder;
    const byHeight = [first, ...others.toSorted((a, b) => height(b, widths[0] ?? 0) - height(a, widths[0] ?? 0))];
    return [inOrder, byHeight].map((order) => bettered(filled(order, widths, height), height, wish, (panel) => panel > 0));
  });
  return ways.reduce((a, b) => (b.least < a.least ? b : a)).best;
}

/** The columns once some panels are unfolded: these stay in theirs, others move until all end together, and widths change where that is not enough. @param {Columns} columns @param {Height} height @param {Wish} wish @param {number[]} unfolded @param {number[][]} ways widths that are tried */
function around({ widths: folded, of }, height, wish, unfolded, ways) {
  const { tops } = stacked({ widths: folded, of }, height);
  const staying = { ...wish, tops: unfolded.map((panel) => /** @type {[number, number]} */ ([panel, tops[panel] ?? 0])) };
  const found = ways.map((widths) => {
    const { best, least } = bettered({ widths, of }, height, staying, (panel) => panel > 0 && !unfolded.includes(panel));
    return { best, least: least + (widths.join() === folded.join() ? 0 : RESIZED) };
  });
  return found.reduce((a, b) => (b.least < a.least ? b : a)).best;
}

/** What the columns were found for, and what was found: with all panels folded, and with some unfolded. @type {{ key: string, found: Columns | null, unfolded: number[], shown: Columns | null }} */
let last = { key: "", found: null, unfolded: [], shown: null };
/** Panels whose sizes are followed. @type {WeakSet<Element>} */
const followed = new WeakSet();
// a picture that is loaded makes its panel higher
const sizes = new ResizeObserver((entries) => {
  const host = entries[0]?.target.closest(".columns");
  if (host) place(/** @type {HTMLElement} */ (host));
});

/** Stands the panels of a page in columns. @param {HTMLElement} host */
export function place(host) {
  const panels = /** @type {HTMLElement[]} */ ([...host.children].filter((one) => one.matches(".panel")));
  if (!panels.length) return;
  const { key } = last;
  const details = [...host.querySelectorAll("details")];
  const turned = details.find(({ open }, at) => open !== last.unfolded.includes(at));
  const before = turned?.getBoundingClientRect().top ?? 0;
  const columns = chosen(host, panels, details);
  if (columns) stand(host, panels, columns);
  // what a hand turned stays below it
  if (columns && turned && last.key === key) scrollBy(0, turned.getBoundingClientRect().top - before);
  for (const one of [host, ...panels]) {
    if (!followed.has(one)) sizes.observe(one);
    followed.add(one);
  }
}

/** The columns for the page as it is; looked for when it has changed. @param {HTMLElement} host @param {HTMLElement[]} panels @param {HTMLDetailsElement[]} details */
function chosen(host, panels, details) {
  const pictures = [...host.querySelectorAll("img")].filter(({ complete }) => complete).length;
  const key = `${host.clientWidth} ${innerHeight} ${pictures} ${panels.map((panel) => panel.getAttribute("aria-label")).join()}`;
  if (last.key !== key) {
    const folded = found(panels, host.clientWidth);
    last = { key, found: folded, unfolded: [], shown: folded };
  }
  const unfolded = details.flatMap(({ open }, at) => (open ? [at] : []));
  if (last.found && last.unfolded.join() !== unfolded.join()) {
    const of = unfolded.map((at) => panels.findIndex((panel) => panel.contains(details[at] ?? null)));
    const ways = allWidths(host.clientWidth);
    last.shown = of.length ? around(last.found, heights(panels, ways.flat()), wishOf(panels), of, ways) : last.found;
    last.unfolded = unfolded;
  }
  return last.shown;
}

/** @param {HTMLElement} host @param {HTMLElement[]} panels @param {Columns} columns */
function stand(host, panels, columns) {
  panels.forEach((panel, index) => (panel.style.width = `${columns.widths[columns.of[index] ?? 0]}px`));
  const { ends, tops } = stacked(columns, (panel) => panels[panel]?.offsetHeight ?? 0);
  const lefts = columns.widths.map((_, at) => columns.widths.slice(0, at).reduce((sum, one) => sum + one + GAP, 0));
  panels.forEach((panel, index) => Object.assign(panel.style, { left: `${lefts[columns.of[index] ?? 0]}px`, top: `${tops[index]}px` }));
  host.style.height = `${Math.max(...ends) - GAP}px`;
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
  const of = heights(panels, widths.flat());
  host.classList.remove("folded");
  return columns(panels.length, width, of, wishOf(panels));
}

/** The heights that panels have now in columns of certain widths. @param {HTMLElement[]} panels @param {number[]} widths @returns {Height} */
function heights(panels, widths) {
  const all = new Map([...new Set(widths)].map((width) => {
    panels.forEach((panel) => (panel.style.width = `${width}px`));
    return [width, panels.map(({ offsetHeight }) => offsetHeight)];
  }));
  return (panel, width) => all.get(width)?.[panel] ?? 0;
}

/** What the columns of these panels should be; of a year its autonomy comes before the map of an overcast sky. @param {HTMLElement[]} panels @returns {Wish} */
function wishOf(panels) {
  const top = (panels[0]?.parentElement?.getBoundingClientRect().top ?? 0) + scrollY;
  return { map: panels.findIndex((one) => one.matches(".map, [aria-label='Daylight autonomy']")), least: innerHeight - top };
}
