// How plan, section and numbers share the middle of the page: the plan is as large as it can be, the others stand beside or below it.

/** What a panel needs beside its drawing, and a drawing beside the room, in CSS pixels: across and down. */
const PANEL = { plan: [26, 126], section: [26, 62] };
export const AROUND = { plan: { left: 40, right: 82, top: 34, bottom: 34 }, section: { left: 24, right: 62, top: 20, bottom: 30 } };
const GAP = 12;
/** Least width of what stands beside the plan, least height of what stands below it, and of any panel with a drawing. */
const BESIDE = 282;
const BELOW = 250;
const LEAST = 240;
/** Width of numbers in two columns, and the largest share of the height that they take from a plan above them. */
const NUMBERS = 486;
const SHARE = 0.42;
/** Height of a panel's head, and how much higher than its drawing a plan may be, so that the page has no empty end. */
const HEAD = 58;
const SLACK = 1.1;

/** @typedef {{ width: number, height: number }} Size */

/** Proportions of a chart that takes the whole width. @type {Size} */
const CHART = { width: 2, height: 1 };

/** What a panel needs beside the room that it draws. @param {"plan" | "section"} of @returns {Size} */
function around(of) {
  const { left, right, top, bottom } = AROUND[of];
  const [across = 0, down = 0] = PANEL[of];
  return { width: across + left + right, height: down + top + bottom };
}

/** Height of a panel of a width, whose drawing fills it as far as a greatest height allows. @param {"plan" | "section"} of @param {Size} metres @param {number} width @param {number} most */
function heightOf(of, metres, width, most) {
  const free = around(of);
  return Math.max(LEAST, Math.min(most, free.height + (metres.height * (width - free.width)) / metres.width));
}

/** The grid of the three panels as the style property `grid-template` has it, its height, and that beyond which the numbers scroll, in CSS pixels. @typedef {{ template: string, height?: number, most?: number }} Stage */

/**
 * The grid of the three panels. Numbers are as high as they need to be, as far as the drawings keep their least height.
 * @param {Size} plan extent of the room in metres
 * @param {Size | null} section extent of the section in metres; null where two charts stand beside the plan, which have no proportions
 * @param {Size} space in CSS pixels
 * @param {boolean} narrow whether each panel takes the whole width
 * @returns {Stage}
 */
export function stage(plan, section, { width, height }, narrow) {
  const px = (/** @type {number} */ value) => `${Math.round(value)}px`;
  if (narrow) {
    const rows = [heightOf("plan", plan, width, height), heightOf("section", section ?? CHART, width, 0.6 * height)].map(px);
    return { template: `"plan" ${rows[0]} "section" ${rows[1]} "numbers" auto / minmax(0, 1fr)` };
  }
  const free = around("plan");
  const beside = Math.min((height - free.height) / plan.height, (width - GAP - BESIDE - free.width) / plan.width);
  const below = Math.min((width - free.width) / plan.width, (height - GAP - BELOW - free.height) / plan.height);
  // beside, less of the page is empty
  if (beside >= 0.85 * below) {
    const natural = Math.max(LEAST + GAP + LEAST, free.height + beside * plan.height);
    // the picture's head stands below it
    const ofPlan = Math.max(natural, Math.min(SLACK * natural, height - GAP - HEAD));
    const right = width - GAP - Math.max(LEAST + 80, free.width + beside * plan.width);
    const ofSection = section ? heightOf("section", section, right, ofPlan - GAP) : (ofPlan - GAP) / 2;
    const rows = [`minmax(${px(Math.min(LEAST, ofSection))}, ${px(ofSection)})`, "minmax(min-content, 1fr)"];
    const template = `"plan section" ${rows[0]} "plan numbers" ${rows[1]} / minmax(0, 1fr) ${px(right)}`;
    return { template, height: Math.round(ofPlan), most: Math.round(ofPlan - GAP - Math.min(LEAST, ofSection)) };
  }
  const ofPlan = Math.max(LEAST, free.height + below * plan.height);
  const rest = Math.max(BELOW, height - GAP - ofPlan);
  const rows = [`minmax(${px(LEAST)}, ${px(ofPlan)})`, "minmax(min-content, 1fr)"];
  const numbers = section && width - GAP - NUMBERS >= BESIDE ? px(NUMBERS) : "minmax(0, 1fr)";
  const template = `"plan plan" ${rows[0]} "section numbers" ${rows[1]} / minmax(0, 1fr) ${numbers}`;
  return { template, height: Math.round(ofPlan + GAP + rest), most: Math.round(Math.max(rest, SHARE * height)) };
}
