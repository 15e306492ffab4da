// The space of the drawings in the middle of the page: given to the panels, and measured when they have it.
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

/**
 * Gives plan, section and numbers, or the charts of a year, the space that there is; a hand that holds a wall moves nothing but the wall.
 * @param {HTMLElement} app
 * @param {boolean} narrow whether each panel takes the whole width
 */
export function fit(app, narrow) {
  const held = /** @type {HTMLElement} */ (app.querySelector(".stage"));
  if (drag.moved) return;
  const { width, depth } = extent(state.draft.room);
  const year = yearShown();
  const high = (held.parentElement?.clientHeight ?? 0) - (year ? STRIP : 0);
  const space = { width: held.clientWidth, height: narrow ? 0.85 * innerHeight : high };
  const { template, height, most } = stage({ width, height: depth }, year ? null : sectionExtent(), space, narrow);
  held.style.gridTemplate = template;
  held.style.height = height ? `${height}px` : "";
  held.style.setProperty("--most", most ? `${most}px` : "none");
  const numbers = /** @type {HTMLElement | null} */ (app.querySelector(".all-numbers"));
  // numbers that would scroll stand closer: their rows, then also the areas by level
  for (const tight of numbers ? ["0", "1", "2"] : []) {
    Object.assign(/** @type {HTMLElement} */ (numbers).dataset, { tight });
    if (Number(numbers?.scrollHeight) <= Number(numbers?.clientHeight) + 1) break;
  }
  for (const part of app.querySelectorAll(`.middle, ${DRAWINGS.map((name) => `.middle svg.${name}`)}`)) {
    if (!followed.has(part)) sizes.observe(part);
    followed.add(part);
  }
}
