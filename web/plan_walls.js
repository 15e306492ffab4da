// The walls on the plan: the sides of a box, or the corners of an outline.
import { across, down } from "./map.js";
import { edges, isInside } from "./outline.js";
import { cornerDrag, edgeDrag, keys, still, wallDrag } from "./plan_hand.js";
import { extent, outline, rings } from "./room.js";
import { set, state } from "./state.js";
import { nothing, svg } from "./vendor/lit-html.js";

/** @param {JobDocument["room"]} room @param {import("./map.js").Layout} at */
export const walls = (room, at) => (room.plan ? [lines(room, at), corners(room, at)] : sides(room, at));

/** The walls of a box, which are moved as a whole. @param {JobDocument["room"]} room @param {import("./map.js").Layout} at */
function sides(room, at) {
  const { width, depth } = extent(room);
  const [west, east, north, south] = [across(at, 0), across(at, width), down(at, depth), down(at, 0)];
  const all = /** @type {const} */ ([
    ["west", west, north, west, south, width],
    ["east", east, north, east, south, width],
    ["north", west, north, east, north, depth],
    ["south", west, south, east, south, depth],
  ]);
  return all.map(
    ([edge, x1, y1, x2, y2, metres]) => svg`<g class=${`wall ${edge}`} tabindex="0" role="slider"
      aria-label=${`${edge} wall: ${edge === "west" || edge === "east" ? "width" : "depth"} of the room in metres`}
      aria-orientation=${edge === "west" || edge === "east" ? "horizontal" : "vertical"} aria-valuemin="0.8" aria-valuemax="50"
        aria-valuenow=${metres} aria-valuetext=${`${metres} m`}
      @touchstart=${still} @pointerdown=${(/** @type {PointerEvent} */ event) => edgeDrag(event, edge, at)}
        @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { edge })}>
      <line class="hold" x1=${x1} y1=${y1} x2=${x2} y2=${y2}></line><line
        class="seen" x1=${x1} y1=${y1} x2=${x2} y2=${y2}></line></g>`,
  );
}

/** The walls of a plan; those of its outline are moved, and take corners. @param {JobDocument["room"]} room @param {import("./map.js").Layout} at */
function lines(room, at) {
  const own = outline(room).length;
  const sides = extent(room);
  /** @type {Length[]} */
  const told = [];
  return rings(room)
    .flatMap(edges)
    .map((wall, edge) => {
      const [[ax, ay], [bx, by]] = wall;
      const [x1, y1, x2, y2] = [across(at, ax), down(at, ay), across(at, bx), down(at, by)];
      const of = isInner(sides, wall) ? length(room, at, wall, edge < own ? LEAST : LEAST_IN_HOLES, told) : null;
      if (of) told.push(of);
      const both = svg`<line class="hold" x1=${x1} y1=${y1} x2=${x2} y2=${y2}></line><line class="seen" x1=${x1} y1=${y1} x2=${x2} y2=${y2}></line>`;
      const moves = Math.min(Math.abs(bx - ax), Math.abs(by - ay)) > 1e-6 ? "any-way" : ax === bx ? "east-west" : "north-south";
      const metres = Number(Math.hypot(bx - ax, by - ay).toFixed(2));
      const drawn = edge < own
        ? svg`<g class=${`edge held ${moves}`} tabindex="0" role="button" aria-label=${`Wall ${edge + 1}, ${metres} m: arrow keys move it`} @touchstart=${still}
            @pointerdown=${(/** @type {PointerEvent} */ event) => wallDrag(event, edge, at)} @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { wall: edge })}>${both}</g>`
        : svg`<g class="edge">${both}</g>`;
      return svg`${of ? svg`<text class="measure length" x=${of.x} y=${of.y}>${of.text}</text>` : nothing}${drawn}`;
    });
}

/** Distance of a wall's length from the wall, and least walls of which it is told: those of a hole share the space in it; in units of the drawing. */
const APART = 13;
const LEAST = 3 * APART;
const LEAST_IN_HOLES = 9 * APART;
/** Width of a character of a length, and height of its line. */
const LETTER = { width: 6.5, height: 13 };

/** A wall's length where it stands. @typedef {{ text: string, x: number, y: number }} Length */

/** True of a wall beside which there is space for its length: on no side of the room's extent, or on a part of its northern one. @param {ReturnType<typeof extent>} sides @param {import("./outline.js").Segment} wall */
function isInner({ west, east, south, north, width }, [[ax, ay], [bx, by]]) {
  if (ay === by && ay === north) return Math.abs(bx - ax) < width - 1e-9;
  return !(ax === bx && (ax === west || ax === east)) && !(ay === by && ay === south);
}

/** True of lengths that lie over each other. @param {Length} one @param {Length} other */
const meet = (one, other) =>
  Math.abs(one.x - other.x) < (LETTER.width * (one.text.length + other.text.length)) / 2 && Math.abs(one.y - other.y) < LETTER.height;

/** Length of a wall, outside the room beside it, or a line away from others; null where there is no space. @param {JobDocument["room"]} room @param {import("./map.js").Layout} at @param {import("./outline.js").Segment} wall @param {number} least @param {Length[]} others @returns {Length | null} */
function length(room, at, [[ax, ay], [bx, by]], least, others) {
  const metres = Math.hypot(bx - ax, by - ay);
  if (metres * at.k < least) return null;
  const [x, y, east, north] = [(ax + bx) / 2, (ay + by) / 2, (by - ay) / metres, (ax - bx) / metres];
  const side = isInside(rings(room), [x + 0.01 * east, y + 0.01 * north]) ? -APART : APART;
  const own = { text: `${Number(metres.toFixed(2))} m`, x: across(at, x) + 1.8 * side * east, y: down(at, y) - side * north + 4 };
  const places = [0, 1, -1].map((lines) => ({ ...own, y: own.y + 1.2 * LETTER.height * lines }));
  return places.find((place) => !others.some((other) => meet(place, other))) ?? null;
}

/** @param {JobDocument["room"]} room @param {import("./map.js").Layout} at */
const corners = (room, at) =>
  outline(room).map(
    ([x, y], corner) => svg`<g class="corner" tabindex="0" role="button" aria-pressed=${state.corner === corner ? "true" : "false"}
      aria-label=${`Corner ${corner + 1} at ${x} m, ${y} m`} @touchstart=${still} @focus=${() => set({ corner })}
      @pointerdown=${(/** @type {PointerEvent} */ event) => cornerDrag(event, corner, at)}
        @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { corner })}>
      <circle class="hold" cx=${across(at, x)} cy=${down(at, y)} r="14"></circle><rect class="seen" x=${across(at, x) - 5}
        y=${down(at, y) - 5} width="10" height="10"></rect></g>`,
  );
