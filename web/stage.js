// How plan, section and numbers share the middle of the page: of all ways to divide it, the one that leaves least of their panels empty.

/** What a panel needs beside its drawing, and a drawing beside the room, in CSS pixels: across and down. */
const PANEL = { plan: [26, 126], section: [26, 62] };
export const AROUND = { plan: { left: 40, right: 82, top: 34, bottom: 34 }, section: { left: 24, right: 62, top: 20, bottom: 30 } };
const GAP = 12;
/** Least width of a panel beside the plan, of the plan itself, and least height of a panel with a drawing. */
const BESIDE = 282;
const PLAN = 340;
const LEAST = 200;
/** Least height of a panel on a narrow page. */
const LEAST_NARROW = 180;
/** Widths of a plan's panel below which its buttons take a second line, and above which a value is read in one line, with their heights. */
const BUTTONS = { below: 475, height: 38 };
const READ = { above: 646, height: 21 };
/** Heights of the heads of the panels that stand below: the last one, and both; the column may be empty by less than a tenth. */
const BELOW = /** @type {const} */ ([70, 128]);
const FILLED = 0.91;
/** Step of widths that are tried. */
const STEP = 24;
/** Most facts about the room that stand below its section where that has space, least that are worth it, least and greatest height of one, and of the space around all. */
const FACTS = { most: 5, least: 2, line: 25, widest: 38, around: 8 };
/** By how much the numbers in one column may be spread. */
const SPREAD = 96;
/** Share of a panel that should be filled either way. */
const FULL = 0.92;
/** Height that may be left of a panel beside its drawing before it looks empty, and what looks so then in addition. */
const LEFT = { plan: 30, section: 24, seen: 24 };
/** What it costs that a panel is not full, that numbers would be spread too far beside that, that their rows are close or their columns uneven, that they scroll, and that the plan is smaller than it could be. */
const COST = { notFull: 2, spread: 1.6, tight: 0.02, uneven: 0.3, scrolls: 20, plan: 3 };

/** @typedef {{ width: number, height: number }} Size */
/** Numbers in so many columns, with rows as close as 0 to 2: the height that they need, and the share of their columns that they fill. @typedef {{ columns: number, tight: number, height: number, filled: number }} Numbers */
/** The numbers in all ways that a width has place for; null of charts, which fill any panel. @typedef {((width: number) => Numbers[]) | null} Needs */
/**
 * The grid of the three panels as the style property `grid-template` has it, its height and that beyond which the numbers scroll, in CSS
 * pixels, the columns of the numbers and how close their rows are, and the facts below the section.
 * @typedef {{ template: string, height?: number, most?: number, columns?: number, tight?: number, facts?: Facts }} Stage
 */

/** Proportions of a chart that takes the whole width. @type {Size} */
const CHART = { width: 2, height: 1 };

/** What a panel needs beside the room that it draws. @param {"plan" | "section"} of @returns {Size} */
function around(of) {
  const { left, right, top, bottom } = AROUND[of];
  const [across = 0, down = 0] = PANEL[of];
  return { width: across + left + right, height: down + top + bottom };
}

/** Height of a panel of a width, whose drawing fills it as far as a greatest height allows. @param {"plan" | "section"} of @param {Size} metres @param {number} width @param {number} most @param {number} [least] */
function heightOf(of, metres, width, most, least = LEAST) {
  const free = around(of);
  return Math.max(least, Math.min(most, free.height + (metres.height * (width - free.width)) / metres.width));
}

/** What a panel costs that is less full than it should be. @param {number} across share that is filled @param {number} down */
const empty = (across, down) => COST.notFull * (Math.max(0, FULL - across) + Math.max(0, FULL - down));

/** How many facts there is space for, and the height that they take. @param {number} free */
function factsIn(free) {
  const count = Math.min(FACTS.most, Math.floor((free - FACTS.around) / FACTS.line));
  return count < FACTS.least ? { count: 0, height: 0 } : { count, height: Math.min(count * FACTS.widest, free - FACTS.around) };
}

/** What a panel with a drawing costs, the area of the room in it, and the facts below it. @param {"plan" | "section"} of @param {Size} metres @param {Size} panel */
function drawn(of, metres, panel) {
  const free = around(of);
  const lines = (panel.width < BUTTONS.below ? BUTTONS.height : 0) - (panel.width > READ.above ? READ.height : 0);
  const high = free.height + (of === "plan" ? lines : 0);
  const scale = Math.max(1e-3, Math.min((panel.width - free.width) / metres.width, (panel.height - high) / metres.height));
  const share = (/** @type {number} */ used, /** @type {number} */ all) => Math.min(1, used / all);
  const needed = high + scale * metres.height;
  const facts = of === "section" ? factsIn(panel.height - needed) : factsIn(0);
  const down = needed + (facts.count ? FACTS.around + facts.height : 0);
  const left = panel.height - down;
  const filled = left > LEFT[of] ? share(down - LEFT.seen, panel.height) : 1;
  const cost = empty(share(free.width + scale * metres.width, panel.width), filled);
  return { cost, area: scale * scale * metres.width * metres.height, facts };
}

/** @param {number} value */
const px = (value) => `${Math.round(value)}px`;

/** Facts below a section: how many, and the height that they take. @typedef {{ count: number, height: number }} Facts */
/** A way to divide the stage. @typedef {{ panels: { plan: Size, section: Size, numbers: Size }, of: Numbers, template: string, height: number, lack: number, cost: number, area: number, facts: Facts }} Way */

/**
 * The grid of the three panels. On a narrow page each takes the whole width.
 * @param {Size} plan extent of the room in metres
 * @param {Size | null} section extent of the section in metres; null where two charts stand beside the plan, which have no proportions
 * @param {Size} space in CSS pixels
 * @param {boolean} narrow
 * @param {Needs} needs
 * @returns {Stage}
 */
export function stage(plan, section, { width, height }, narrow, needs) {
  if (narrow) {
    const rows = [heightOf("plan", plan, width, height), heightOf("section", section ?? CHART, width, 0.6 * height, LEAST_NARROW)].map(px);
    return { template: `"plan" ${rows[0]} "section" ${rows[1]} "numbers" auto / minmax(0, 1fr)` };
  }
  // the strip of a year stands below; of a moment, heads of panels as far as there is space
  const heights = section ? [...range(FILLED * height - BELOW[1], height - BELOW[0]), height - BELOW[0], height] : [height];
  const ways = heights.flatMap((high) => divided(plan, section, { width, height: high }, needs));
  for (const way of ways) {
    const { cost, area } = drawn("plan", plan, way.panels.plan);
    const ofSection = section ? drawn("section", section, way.panels.section) : { cost: 0, facts: factsIn(0) };
    Object.assign(way, { area, facts: ofSection.facts, cost: way.cost + cost + ofSection.cost });
  }
  const largest = Math.max(...ways.map(({ area }) => area));
  const costOf = (/** @type {Way} */ { cost, area, lack }) => cost + COST.plan * (1 - area / largest) + (COST.scrolls * lack) / height;
  const best = ways.reduce((least, one) => (costOf(one) < costOf(least) ? one : least));
  const { template, of: { columns, tight }, panels, facts } = best;
  return { template, height: Math.round(best.height), most: Math.round(panels.numbers.height), columns, tight, facts };
}

/** All ways to divide a space: section and numbers beside the plan; the section beside it and the numbers below; the numbers beside both; both below it. @param {Size} plan @param {Size | null} section @param {Size} space @param {Needs} needs @returns {Way[]} */
function divided(plan, section, { width, height }, needs) {
  /** @param {number} wide @returns {Numbers[]} */
  const numbers = (wide) => needs?.(wide) ?? [{ columns: 1, tight: 0, height: (height - GAP) / 2, filled: 1 }];
  /** @param {Way["panels"]} panels @param {Numbers} of @param {string} template @returns {Way} */
  const way = (panels, of, template) => {
    const lack = needs ? Math.max(0, of.height - panels.numbers.height) : 0;
    const reached = of.height + (of.columns === 1 ? SPREAD : 0);
    const cost = needs ? COST.spread * empty(1, Math.min(1, reached / panels.numbers.height)) + COST.uneven * (1 - of.filled) + COST.tight * of.tight : 0;
    return { panels, of, template, height, lack, cost, area: 0, facts: factsIn(0) };
  };
  const whole = numbers(width);
  const beside = range(BESIDE, width - GAP - PLAN).flatMap((right) => {
    const left = width - GAP - right;
    return [
      ...numbers(right).flatMap((of) => (of.columns === 1 && !of.tight ? [0, SPREAD / 3, (2 * SPREAD) / 3, SPREAD] : [0]).map((spread) => {
        const ofSection = Math.max(LEAST, height - GAP - of.height - spread);
        const panels = { plan: { width: left, height }, section: { width: right, height: ofSection }, numbers: { width: right, height: height - GAP - ofSection } };
        return way(panels, of, `"plan section" ${px(ofSection)} "plan numbers" minmax(0, 1fr) / minmax(0, 1fr) ${px(right)}`);
      })),
      ...whole.map((of) => {
        const ofPlan = Math.max(LEAST, height - GAP - of.height);
        const panels = { plan: { width: left, height: ofPlan }, section: { width: right, height: ofPlan }, numbers: { width, height: height - GAP - ofPlan } };
        return way(panels, of, `"plan section" ${px(ofPlan)} "numbers numbers" minmax(0, 1fr) / minmax(0, 1fr) ${px(right)}`);
      }),
      ...numbers(right).flatMap((of) =>
        [heightOf("plan", plan, left, height - GAP - LEAST), height - GAP - heightOf("section", section ?? CHART, left, height - GAP - LEAST)].map((ofPlan) => {
          const panels = { plan: { width: left, height: ofPlan }, section: { width: left, height: height - GAP - ofPlan }, numbers: { width: right, height } };
          return way(panels, of, `"plan numbers" ${px(ofPlan)} "section numbers" minmax(0, 1fr) / minmax(0, 1fr) ${px(right)}`);
        }),
      ),
    ];
  });
  const below = range(BESIDE, width - GAP - BESIDE).flatMap((right) =>
    numbers(right).map((of) => {
      const ofPlan = Math.max(LEAST, height - GAP - Math.max(LEAST, of.height));
      const rest = height - GAP - ofPlan;
      const panels = { plan: { width, height: ofPlan }, section: { width: width - GAP - right, height: rest }, numbers: { width: right, height: rest } };
      return way(panels, of, `"plan plan" ${px(ofPlan)} "section numbers" minmax(0, 1fr) / minmax(0, 1fr) ${px(right)}`);
    }),
  );
  return [...beside, ...below];
}

/** Widths that are tried for a panel. @param {number} from @param {number} to */
const range = (from, to) => Array.from({ length: Math.max(1, Math.floor((to - from) / STEP) + 1) }, (_, i) => from + i * STEP);
