// Moving tubes, walls, corners and partitions on the plan, by pointer and by keys.
import { addTube, moveEdge, moveTube, removeTube } from "./draft.js";
import { addPartition, isStub, movePartition, movePartitionEnd, removePartition } from "./draft_partition.js";
import { addCorner, moveCorner, moveWall, removeCorner } from "./draft_plan.js";
import { moveSensor, removeSensor } from "./draft_sensors.js";
import { edit, hold } from "./live.js";
import { extent, outline } from "./room.js";
import { sensorsOf } from "./sensor.js";
import { set, state } from "./state.js";

/** Steps of the arrow keys in metres, without and with Shift. */
const STEP_M = 0.05;
const SMALL_STEP_M = 0.01;
/** How near a corner snaps, in units of the drawing. */
const REACH = 8;

/** @typedef {import("./map.js").Layout} Layout */
/** @typedef {import("./draft.js").Edge} Edge */

/**
 * Metres per CSS pixel, and the place of a pointer in the drawing's units.
 * @param {SVGSVGElement} drawing
 * @param {MouseEvent} event
 */
function place(drawing, event) {
  const matrix = drawing.getScreenCTM();
  return matrix ? new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse()) : new DOMPoint();
}

/** What the hand holds. */
export const drag = {
  /** The layout stays while a wall is moved, so that it stays under the hand. @type {Layout | null} */
  layout: null,
  /** @type {((x: number, y: number) => void) | null} */
  moved: null,

  /** Takes a tube. @param {PointerEvent} event @param {number} index @param {Layout} at */
  tube(event, index, at) {
    const drawing = taken(event);
    const tube = state.draft.tubes?.[index];
    if (!drawing || !tube) return;
    const start = place(drawing, event);
    const [x, y] = tube.centre_m;
    drag.moved = (nowX, nowY) =>
      edit((draft) => moveTube(draft, index, x + (nowX - start.x) / at.k, y - (nowY - start.y) / at.k));
  },

  /** @param {PointerEvent} event */
  move: (event) => {
    if (!drag.moved) return;
    const { x, y } = place(/** @type {SVGSVGElement} */ (event.currentTarget), event);
    drag.moved(x, y);
  },

  end: () => {
    if (!drag.moved) return;
    drag.moved = null;
    drag.layout = null;
    hold(false);
    set();
  },
};

/** The drawing, which hears of the pointer from now on. @param {PointerEvent} event */
function taken(event) {
  const held = /** @type {SVGElement} */ (event.currentTarget);
  const drawing = held.ownerSVGElement;
  if (event.button !== 0 || !drawing) return null;
  event.preventDefault();
  held.focus({ preventScroll: true });
  drawing.setPointerCapture(event.pointerId);
  hold(true);
  return drawing;
}

/**
 * The page does not scroll under a finger that moves something: `touch-action` of parts of a drawing does nothing.
 * @param {Event} event
 */
export const still = (event) => event.preventDefault();

/** Takes a wall; the one opposite stays where it is. @param {PointerEvent} event @param {Edge} edge @param {Layout} at */
export function edgeDrag(event, edge, at) {
  const drawing = taken(event);
  if (!drawing) return;
  const start = place(drawing, event);
  const before = state.draft;
  drag.layout = { ...at };
  drag.moved = (x, y) => {
    const out = { east: x - start.x, west: start.x - x, south: y - start.y, north: start.y - y }[edge] / at.k;
    edit((draft) => {
      Object.assign(draft, structuredClone(before));
      moveEdge(draft, edge, out);
    });
    const [now, then] = [extent(state.draft.room), extent(before.room)];
    const [wider, deeper] = [at.k * (now.width - then.width), at.k * (now.depth - then.depth)];
    drag.layout = { ...at, left: at.left - (edge === "west" ? wider : 0), top: at.top - (edge === "north" ? deeper : 0) };
  };
}

/** Takes a corner. @param {PointerEvent} event @param {number} corner @param {Layout} at */
export function cornerDrag(event, corner, at) {
  const drawing = taken(event);
  if (!drawing) return;
  set({ corner });
  const start = place(drawing, event);
  const [x, y] = outline(state.draft.room)[corner] ?? [0, 0];
  drag.layout = { ...at };
  drag.moved = (nowX, nowY) =>
    edit((draft) => moveCorner(draft, corner, [x + (nowX - start.x) / at.k, y - (nowY - start.y) / at.k], REACH / at.k));
}

/** The wall that was pressed last, and when, in milliseconds. */
const pressed = { edge: -1, at: 0 };
/** Two presses within this time add a corner: a drawing that holds the pointer hears of no double click on its parts. */
const DOUBLE_MS = 400;

/** Takes a wall of a plan; a second press adds a corner. @param {PointerEvent} event @param {number} edge @param {Layout} at */
export function wallDrag(event, edge, at) {
  const isSecond = pressed.edge === edge && event.timeStamp - pressed.at < DOUBLE_MS;
  Object.assign(pressed, { edge: isSecond ? -1 : edge, at: event.timeStamp });
  if (isSecond && event.button === 0) return addAt(event, edge, at);
  const drawing = taken(event);
  if (!drawing) return;
  const [start, before] = [place(drawing, event), outline(state.draft.room)];
  drag.layout = { ...at };
  drag.moved = (x, y) => edit((draft) => moveWall(draft, edge, [(x - start.x) / at.k, (start.y - y) / at.k], before));
}

/**
 * Takes an end of a partition, or the whole of it.
 * @param {PointerEvent} event @param {number} index @param {import("./draft_partition.js").End | null} end @param {Layout} at
 */
export function partitionDrag(event, index, end, at) {
  const before = state.draft.room.partitions?.[index];
  const drawing = before && taken(event);
  if (!drawing) return;
  set({ partition: index });
  const start = place(drawing, event);
  const [x, y] = end ? before[end] : [0, 0];
  drag.moved = (nowX, nowY) => {
    const [dx, dy] = [(nowX - start.x) / at.k, (start.y - nowY) / at.k];
    edit((draft) => (end ? movePartitionEnd(draft, index, end, [x + dx, y + dy], REACH / at.k) : movePartition(draft, index, before, [dx, dy])));
  };
}

/** Takes a sensor. @param {PointerEvent} event @param {number} index @param {Layout} at */
export function sensorDrag(event, index, at) {
  const sensor = sensorsOf(state.draft).points[index];
  const drawing = sensor && taken(event);
  if (!drawing) return;
  const start = place(drawing, event);
  const [x, y] = sensor;
  drag.moved = (nowX, nowY) => edit((draft) => moveSensor(draft, index, x + (nowX - start.x) / at.k, y - (nowY - start.y) / at.k));
}

/** Draws a partition from where the pointer is. @param {PointerEvent} event @param {Layout} at */
export function draw(event, at) {
  const drawing = taken(event);
  if (!drawing) return;
  const metres = (/** @type {number} */ x, /** @type {number} */ y) => /** @type {[number, number]} */ ([(x - at.left) / at.k, at.north - (y - at.top) / at.k]);
  const start = place(drawing, event);
  const from = metres(start.x, start.y);
  const before = state.draft;
  set({ draws: false, partition: null });
  drag.moved = (x, y) =>
    edit((draft) => {
      draft.room = structuredClone(before.room);
      const index = addPartition(draft, from, metres(x, y));
      movePartitionEnd(draft, index, "to_m", metres(x, y), REACH / at.k);
      const drawn = draft.room.partitions?.[index];
      if (drawn && isStub(drawn)) removePartition(draft, index);
      else set({ partition: index });
    });
}

/** Adds a corner to an edge, where the pointer is. @param {MouseEvent} event @param {number} edge @param {Layout} at */
export function addAt(event, edge, at) {
  const drawing = /** @type {SVGElement} */ (event.currentTarget).ownerSVGElement;
  if (!drawing) return;
  const { x, y } = place(drawing, event);
  edit((draft) => addCorner(draft, edge, [(x - at.left) / at.k, at.north - (y - at.top) / at.k]));
  set({ corner: edge + 1 });
}

/**
 * Moves what has the focus by the arrow keys.
 * @param {KeyboardEvent} event
 * @param {{ tube: number } | { edge: Edge } | { corner: number } | { wall: number } | { sensor: number } | { partition: number, end: import("./draft_partition.js").End }} what
 */
export function keys(event, what) {
  const step = event.shiftKey ? SMALL_STEP_M : STEP_M;
  const moves = /** @type {Record<string, [number, number]>} */ ({
    ArrowLeft: [-step, 0],
    ArrowRight: [step, 0],
    ArrowUp: [0, step],
    ArrowDown: [0, -step],
  });
  const move = moves[event.key];
  const remove = event.key === "Delete" || event.key === "Backspace";
  if (!move && !remove) return;
  event.preventDefault();
  if ("tube" in what) {
    const { tube: index } = what;
    if (remove) {
      const plan = /** @type {SVGElement} */ (event.currentTarget).ownerSVGElement;
      edit((draft) => removeTube(draft, index));
      // the focus goes to the next tube, or it would go to the page's beginning
      requestAnimationFrame(() =>
        requestAnimationFrame(() => {
          const others = [...(plan?.querySelectorAll(".tube") ?? [])];
          const next = others[Math.min(index, others.length - 1)] ?? plan?.querySelector(".wall, .corner");
          /** @type {SVGElement | null | undefined} */ (next)?.focus();
        }),
      );
    } else if (move)
      edit((draft) => {
        const [x, y] = draft.tubes?.[index]?.centre_m ?? [0, 0];
        moveTube(draft, index, x + move[0], y + move[1]);
      });
  } else if ("corner" in what) {
    const { corner } = what;
    edit((draft) => {
      if (!move) return removeCorner(draft, corner);
      const [x, y] = outline(draft.room)[corner] ?? [0, 0];
      moveCorner(draft, corner, [x + move[0], y + move[1]], 0);
    });
  } else if ("wall" in what) {
    if (move) edit((draft) => moveWall(draft, what.wall, move));
  } else if ("sensor" in what) {
    const { sensor } = what;
    edit((draft) => {
      if (!move) return removeSensor(draft, sensor);
      const [x, y] = sensorsOf(draft).points[sensor] ?? [0, 0];
      moveSensor(draft, sensor, x + move[0], y + move[1]);
    });
    if (!move) set({ sensor: null });
  } else if ("partition" in what) {
    const { partition, end } = what;
    edit((draft) => {
      if (!move) return removePartition(draft, partition);
      const [x, y] = draft.room.partitions?.[partition]?.[end] ?? [0, 0];
      movePartitionEnd(draft, partition, end, [x + move[0], y + move[1]], 0);
    });
    if (!move) set({ partition: null });
  } else if (move) {
    const { edge } = what;
    const out = { east: move[0], west: -move[0], north: move[1], south: -move[1] }[edge];
    if (out) edit((draft) => moveEdge(draft, edge, out));
  }
}

/** Column and row of the cell under the pointer. @param {MouseEvent} event @param {Grid} grid @param {Layout} at @returns {[number, number] | null} */
export function cellAt(event, grid, at) {
  const drawing = /** @type {SVGElement} */ (event.currentTarget).ownerSVGElement;
  if (!drawing) return null;
  const { x, y } = place(drawing, event);
  const nearest = (/** @type {number[]} */ centres, /** @type {number} */ value) =>
    centres.reduce((best, centre, i) => (Math.abs(centre - value) < Math.abs((centres[best] ?? 0) - value) ? i : best), 0);
  return [nearest(grid.x_m, (x - at.left) / at.k), nearest(grid.y_m, at.north - (y - at.top) / at.k)];
}

/** @param {PointerEvent} event @param {Grid} grid @param {Layout} at */
export function moveCursor(event, grid, at) {
  if (!drag.moved) set({ cursor: cellAt(event, grid, at) });
}

/** Adds a tube, which the form shows. */
export function add() {
  edit(addTube);
  set({ tube: (state.draft.tubes?.length ?? 1) - 1 });
}
