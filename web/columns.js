// Columns of a job's page: how wide they are, and which panel stands in which, so that all end at about the same height.

/** Space between panels, least width of columns that are equal, and most columns. */
const GAP = 12;
const LEAST = 460;
const MOST = 3;
/** Parts of the page of which widths are multiples; least and greatest width as shares of equal columns. */
const PARTS = 24;
const SHARES = { least: 0.74, most: 1.5 };
/** What it costs that columns end at different heights by more than a share, above the end of the screen, or below it though they are enlarged, that what comes first stands low, and that the map is narrow. */
const UNEVEN = { from: 0.03, cost: 10 };
const SHORT = { from: 0.05, cost: 4 };
const BEYOND = 100;
const LOW = 0.3;
const NARROW = 2;
/** By how much a page that ends above the end of the screen is enlarged, what it costs that it still does, and the least share of the screen that is enough. */
const LARGER = { steps: [1.02, 1.04, 1.07, 1.11, 1.15, 1.19, 1.23, 1.27], short: 10, enough: 0.97 };
/** Step of widths, in pixels, between which heights are taken from both sides while a size is looked for. */
const STEP = 16;
/** Most pixels of the screen by which a panel is higher than usual. */
const SPARE = 10;
/** What it costs, once a panel is unfolded, that panels have other widths, and that it stands higher or lower. */
const RESIZED = 0.15;
const SHIFTED = 4;

/** Columns of certain widths, and the column of each panel. @typedef {{ widths: number[], of: number[] }} Columns */
/** Height of a panel in a column of a width. @typedef {(panel: number, width: number) => number} Height */
/** What columns should be: `map` is the panel that is the better the wider it is, -1 where there is none; `least` the height of the screen that they should fill, and beyond which they should not reach if they are `enlarged`; `tops` are those of panels that should stay where they are. @typedef {{ map: number, least: number, enlarged?: boolean, tops?: [number, number][] }} Wish */
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
function cost(columns, height, { map, least, enlarged, tops: kept = [] }) {
  const { ends, tops } = stacked(columns, height);
  const longest = Math.max(...ends);
  const uneven = 1 - Math.min(...ends) / longest;
  // the first half of the panels: what was asked for, and what came out
  const first = tops.slice(0, Math.ceil(tops.length / 2));
  const low = first.reduce((sum, top) => sum + top / longest, 0) / first.length;
  const width = columns.widths[columns.of[map] ?? -1];
  // of the page, and of the widest column
  const narrow = width ? 2 - width / columns.widths.reduce((sum, one) => sum + one, 0) - width / Math.max(...columns.widths) : 0;
  const shifted = kept.reduce((sum, [panel, top]) => sum + Math.abs((tops[panel] ?? 0) - top), 0) / longest;
  const short = least ? 1 - longest / least : 0;
  const beyond = enlarged ? Math.max(0, (longest - GAP) / least - 1) : 0;
  return UNEVEN.cost * Math.max(0, uneven - UNEVEN.from) + SHORT.cost * Math.max(0, short - SHORT.from) + BEYOND * beyond + SHIFTED * shifted + LOW * low + NARROW * narrow;
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
 * column, or the map in the widest, and from there as long as a step makes them better; the first panel stays.
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
    const starts = [inOrder, byHeight].map((order) => filled(order, widths, height));
    if (wish.map > 0) starts.push({ widths, of: inOrder.map((panel) => (panel === wish.map ? widths.indexOf(Math.max(...widths)) : 0)) });
    return starts.map((start) => bettered(start, height, wish, (panel) => panel > 0));
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

/** Columns, and how many times larger than usual all that stands in them is. @typedef {Columns & { larger: number }} Enlarged */
/** What the columns were found for, and what was found: with all panels folded, and with some unfolded. @type {{ key: string, found: Enlarged | null, unfolded: number[], shown: Columns | null }} */
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
  const larger = last.found?.larger ?? 1;
  if (columns) stand(host, panels, columns, larger, spaceOf(host).height / larger);
  // what a hand turned stays below it
  if (columns && turned && last.key === key) scrollBy(0, turned.getBoundingClientRect().top - before);
  for (const one of [host, ...panels]) {
    if (!followed.has(one)) sizes.observe(one);
    followed.add(one);
  }
}

/** The columns for the page as it is; looked for when it has changed. @param {HTMLElement} host @param {HTMLElement[]} panels @param {HTMLDetailsElement[]} details */
function chosen(host, panels, details) {
  // one that has come may not be laid out yet: its words are lower
  const pictures = [...host.querySelectorAll("img")].filter(({ offsetWidth, offsetHeight }) => offsetHeight > offsetWidth / 10).length;
  const space = spaceOf(host);
  const key = `${space.width} ${innerHeight} ${pictures} ${panels.map((panel) => panel.getAttribute("aria-label")).join()}`;
  if (last.key !== key) {
    host.style.zoom = "";
    const folded = found(panels, space);
    host.style.zoom = folded && folded.larger > 1 ? String(folded.larger) : "";
    last = { key, found: folded, unfolded: [], shown: folded };
  }
  const unfolded = details.flatMap(({ open }, at) => (open ? [at] : []));
  if (last.found && last.unfolded.join() !== unfolded.join()) {
    const of = unfolded.map((at) => panels.findIndex((panel) => panel.contains(details[at] ?? null)));
    const { larger } = last.found;
    const ways = allWidths(space.width / larger);
    last.shown = of.length ? around(last.found, heights(panels, ways.flat()), wishOf(panels, space.height / larger), of, ways) : last.found;
    last.unfolded = unfolded;
  }
  return last.shown;
}

/** The space for all columns in pixels of the screen, as far down as the page needs no scrolling. @param {HTMLElement} host */
function spaceOf(host) {
  const page = /** @type {HTMLElement} */ (host.parentElement);
  const { paddingLeft, paddingRight, paddingBottom } = getComputedStyle(page);
  const top = host.getBoundingClientRect().top + scrollY;
  return { width: page.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight), height: innerHeight - top - parseFloat(paddingBottom) };
}

/** @param {HTMLElement} host @param {HTMLElement[]} panels @param {Columns} columns @param {number} larger @param {number} least height that they should fill */
function stand(host, panels, columns, larger, least) {
  panels.forEach((panel, index) => {
    panel.style.width = `${columns.widths[columns.of[index] ?? 0]}px`;
    panel.style.removeProperty("--spare");
  });
  const own = panels.map(({ offsetHeight }) => offsetHeight);
  const { ends } = stacked(columns, (panel) => own[panel] ?? 0);
  // what is left below the panels of a column is divided among them
  const end = Math.max(...ends, least + GAP);
  const more = ends.map((of, column) => Math.min(SPARE / larger, Math.floor((end - of) / columns.of.filter((one) => one === column).length)));
  const spread = stacked(columns, (panel) => (own[panel] ?? 0) + (more[columns.of[panel] ?? 0] ?? 0));
  const lefts = columns.widths.map((_, at) => columns.widths.slice(0, at).reduce((sum, one) => sum + one + GAP, 0));
  panels.forEach((panel, index) => {
    const column = columns.of[index] ?? 0;
    Object.assign(panel.style, { left: `${lefts[column]}px`, top: `${spread.tops[index]}px` });
    panel.style.setProperty("--spare", `${more[column]}px`);
  });
  host.style.height = `${Math.max(...spread.ends) - GAP}px`;
}

/** The columns for panels as high as they are when folded; null where each takes the whole width. @param {HTMLElement[]} panels @param {{ width: number, height: number }} space @returns {Enlarged | null} */
function found(panels, { width, height }) {
  const host = /** @type {HTMLElement} */ (panels[0]?.parentElement);
  const inColumns = (allWidths(width)[0]?.length ?? 1) > 1;
  host.classList.toggle("beside", inColumns);
  if (!inColumns) {
    for (const one of [host, ...panels]) Object.assign(one.style, { width: "", height: "", left: "", top: "" });
    return null;
  }
  // columns do not depend on what is unfolded at the moment
  host.classList.add("folded");
  const of = (/** @type {number} */ larger) => {
    const wish = { ...wishOf(panels, height / larger), enlarged: larger > 1 };
    return columns(panels.length, width / larger, heights(panels, allWidths(width / larger).flat()), wish);
  };
  const plain = of(1);
  const larger = endOf(plain, panels) < LARGER.enough * height ? largerBy(panels, { width, height }) : 1;
  const all = { ...(larger > 1 ? of(larger) : plain), larger };
  host.classList.remove("folded");
  return all;
}

/** Where the longest of some columns ends. @param {Columns} columns @param {HTMLElement[]} panels */
const endOf = (columns, panels) => Math.max(...stacked(columns, heights(panels, columns.widths)).ends) - GAP;

/** How many times larger panels become that end above the end of the screen: as many columns as before, none of which ends below it. @param {HTMLElement[]} panels @param {{ width: number, height: number }} space */
function largerBy(panels, { width, height }) {
  const ways = LARGER.steps.map((larger) => ({ larger, widths: allWidths(width / larger) })).filter(({ widths }) => widths[0]?.length === allWidths(width)[0]?.length);
  const all = ways.flatMap(({ widths }) => widths.flat());
  const [first, last] = [Math.floor(Math.min(...all) / STEP), Math.ceil(Math.max(...all) / STEP)];
  const measured = heights(panels, Array.from({ length: last - first + 1 }, (_, i) => (first + i) * STEP));
  /** @type {Height} */
  const of = (panel, wide) => Math.max(measured(panel, STEP * Math.floor(wide / STEP)), measured(panel, STEP * Math.ceil(wide / STEP)));
  const tried = ways.map(({ larger }) => {
    const wish = { ...wishOf(panels, height / larger), enlarged: true };
    const best = columns(panels.length, width / larger, of, wish);
    const filled = ((Math.max(...stacked(best, of).ends) - GAP) * larger) / height;
    return { larger, cost: filled <= 1 ? cost(best, of, wish) + LARGER.short * (1 - filled) : Infinity };
  });
  const best = tried.reduce((a, b) => (b.cost < a.cost ? b : a), { larger: 1, cost: Infinity });
  return best.cost < Infinity ? best.larger : 1;
}

/** The heights that panels have now in columns of certain widths. @param {HTMLElement[]} panels @param {number[]} widths @returns {Height} */
function heights(panels, widths) {
  const all = new Map([...new Set(widths)].map((width) => {
    panels.forEach((panel) => {
      panel.style.width = `${width}px`;
      panel.style.removeProperty("--spare");
    });
    return [width, panels.map(({ offsetHeight }) => offsetHeight)];
  }));
  return (panel, width) => all.get(width)?.[panel] ?? 0;
}

/** What the columns of these panels should be, down to a height; of a year its autonomy comes before the map of an overcast sky. @param {HTMLElement[]} panels @param {number} least @returns {Wish} */
const wishOf = (panels, least) => ({ map: panels.findIndex((one) => one.matches(".map, [aria-label='Daylight autonomy']")), least });
