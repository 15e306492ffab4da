// The space of the drawings in the middle of the page: given to the panels, and measured when they have it.
import { live } from "./live.js";
import { yearShown } from "./plan.js";
import { drag } from "./plan_hand.js";
import { extent } from "./room.js";
import { sectionExtent } from "./section.js";
import { stage } from "./stage.js";
import { set, state } from "./state.js";

const DRAWINGS = /** @type {const} */ (["plan", "section", "months", "day", "strip"]);
/** Least height of the strip of a year below the stage, with the space between them. */
const STRIP = 262;
/** Drawings, and the column around them, whose sizes are followed. @type {WeakSet<Element>} */
const followed = new WeakSet();

const sizes = new ResizeObserver((entries) => {
  const next = { ...state.sizes };
  for (const { target, contentRect } of entries) {
    const { width, height } = contentRect;
    const drawing = DRAWINGS.find((name) => target.matches(`svg.${name}`));
    if (drawing && width > 0 && height > 0) next[drawing] = [width, height];
  }
  set({ sizes: next });
});

/** Least widths of the panel of numbers with so many columns, in CSS pixels: with the padding and border of the panel. */
const COLUMNS = [0, 530, 790, 1050, 1310];
/** Greatest width of a column. */
const WIDEST = 560;

/** @typedef {import("./stage.js").Numbers} Numbers */

/** What was measured last, and of which text. @type {{ text: string, all: Numbers[] }} */
let known = { text: "", all: [] };

/** What the numbers need in each number of columns, with rows as close as they may be; each is measured at the width from which on there are so many columns. @param {HTMLElement} panel */
function measures(panel) {
  const text = `${panel.querySelectorAll("details[open]").length} ${panel.textContent}`;
  if (known.text !== text) known = { text, all: COLUMNS.flatMap((from, index) => [0, 1, 2].map((tight) => measured(panel, Math.max(282, from), index + 1, tight))) };
  return known.all;
}

/** The stage that was found last, and what for. @type {{ of: string, found: import("./stage.js").Stage }} */
let last = { of: "", found: { template: "" } };

/**
 * The way to divide the stage; it is looked for when something has changed.
 * @param {import("./stage.js").Size} plan @param {import("./stage.js").Size | null} section @param {import("./stage.js").Size} space
 * @param {boolean} narrow @param {Numbers[] | null} numbers
 */
function divided(plan, section, space, narrow, numbers) {
  const of = JSON.stringify([plan, section, space, narrow, numbers]);
  const fitting = (/** @type {number} */ width) => (numbers ?? []).filter(({ columns }) => width >= Number(COLUMNS[columns - 1]) && width / columns <= WIDEST);
  if (last.of !== of) last = { of, found: stage(plan, section, space, narrow, numbers && fitting) };
  return last.found;
}

/** @param {HTMLElement} panel @param {number} width @param {number} columns @param {number} tight @returns {Numbers} */
function measured(panel, width, columns, tight) {
  inColumns(panel, columns, tight);
  Object.assign(panel.style, { position: "absolute", visibility: "hidden", width: `${width}px`, height: "auto", maxHeight: "none" });
  const blocks = panel.querySelector(".blocks");
  const filled = [...(blocks?.children ?? [])].reduce((sum, block) => sum + block.clientHeight, 0) / (columns * (blocks?.clientHeight || 1));
  const height = panel.offsetHeight + 1;
  Object.assign(panel.style, { position: "", visibility: "", width: "", height: "", maxHeight: "" });
  return { columns, tight, height, filled: Math.min(1, filled || 1) };
}

/** @param {HTMLElement} panel @param {number} columns @param {number} tight */
function inColumns(panel, columns, tight) {
  Object.assign(panel.dataset, { columns, tight });
  panel.style.setProperty("--columns", String(columns));
  // rows of one column share what is left of its height, but for those that are folded
  for (const block of /** @type {HTMLElement[]} */ ([...(panel.querySelector(".blocks")?.children ?? [])])) {
    const rows = block.matches("details:not([open])") ? 0 : block.querySelectorAll("div, tbody tr, .above:not(.origins) th").length;
    block.style.flexGrow = String(rows);
  }
}

/**
 * Gives plan, section and numbers, or the charts of a year, the space that there is; what a hand holds moves nothing else.
 * @param {HTMLElement} app
 * @param {boolean} narrow whether each panel takes the whole width
 */
export function fit(app, narrow) {
  const held = /** @type {HTMLElement} */ (app.querySelector(".stage"));
  if (drag.moved || live.held) return;
  const { width, depth } = extent(state.draft.room);
  const year = yearShown();
  const high = (held.parentElement?.clientHeight ?? 0) - (year ? STRIP : 0);
  const space = { width: held.clientWidth, height: narrow ? 0.85 * innerHeight : high };
  const panel = /** @type {HTMLElement | null} */ (app.querySelector(".all-numbers"));
  const ofNumbers = panel && !year && !narrow ? measures(panel) : null;
  const found = divided({ width, height: depth }, year ? null : sectionExtent(), space, narrow, ofNumbers);
  const { template, height, most, tight = 0, facts = { count: 0, height: 0 }, columns = COLUMNS.findLastIndex((from) => space.width >= from) + 1 } = found;
  if (panel) inColumns(panel, columns, tight);
  held.style.gridTemplate = template;
  const told = /** @type {HTMLElement | null} */ (held.querySelector(".facts"));
  if (told) {
    told.dataset.count = String(facts.count);
    told.style.height = `${facts.height}px`;
  }
  held.style.height = height ? `${height}px` : "";
  held.style.setProperty("--most", most ? `${most}px` : "none");
  for (const part of app.querySelectorAll(`.middle, ${DRAWINGS.map((name) => `.middle svg.${name}`)}`)) {
    if (!followed.has(part)) sizes.observe(part);
    followed.add(part);
  }
}
