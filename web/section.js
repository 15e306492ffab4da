// A section through room, roof and tubes.
import { centimetres, diameter, isMesh, setDrop } from "./draft.js";
import { edit, hold } from "./live.js";
import { still } from "./plan_hand.js";
import { ceilingAt, extent, faces } from "./room.js";
import { set, state } from "./state.js";
import { html, nothing, svg } from "./vendor/lit-html.js";

const RADIANS = Math.PI / 180;
/** How much of a tube stands out of the roof. */
const ABOVE_ROOF_M = 0.15;

/**
 * Points of a tube's axis, along the section and up from the opening.
 * @param {Tube} tube
 * @param {0 | 1} axis
 * @returns {[number, number][]}
 */
function course(tube, axis) {
  let [along, up] = [tube.centre_m[axis] ?? 0, 0];
  /** @type {[number, number][]} */
  const points = [[along, up]];
  for (const { length_m, tilt_deg = 0, azimuth_deg = 0 } of isMesh(tube) ? [{ length_m: 1 }] : tube.segments) {
    const lean = length_m * Math.sin(tilt_deg * RADIANS);
    along += lean * (axis === 0 ? Math.sin(azimuth_deg * RADIANS) : Math.cos(azimuth_deg * RADIANS));
    up += length_m * Math.cos(tilt_deg * RADIANS);
    points.push([along, up]);
  }
  return points;
}

/** Both sides of a tube, mitred where pieces meet. @param {[number, number][]} points @param {number} radius */
function sides(points, radius) {
  const normal = (/** @type {number} */ i) => {
    const [a = [0, 0], b = [0, 1]] = points.slice(i, i + 2);
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
    return /** @type {[number, number]} */ ([(b[1] - a[1]) / length, -(b[0] - a[0]) / length]);
  };
  const last = points.length - 2;
  return [1, -1].map((side) =>
    points.map(([x, y], i) => {
      const [before, after] = [normal(Math.max(0, i - 1)), normal(Math.min(i, last))];
      // the first piece starts at the level opening
      const [nx, ny] = [before[0] + after[0], before[1] + after[1]];
      const share = (2 / (nx * nx + ny * ny || 1)) * side * radius;
      return /** @type {[number, number]} */ ([x + nx * share, y + ny * share]);
    }),
  );
}

/** The section with its two directions. */
export function section() {
  const { problem, look } = state;
  // while a draft is refused, the section of the one before stands
  const draft = problem?.errors?.length ? state.answered : state.draft;
  const { room } = draft;
  const { west, south, width, depth, lowest, height } = extent(room);
  const axis = look === "north" ? 0 : 1;
  const [from, across] = axis === 0 ? [west, width] : [south, depth];
  const tubes = draft.tubes ?? [];
  const courses = tubes.map((tube) => course(tube, axis));
  // of the opening of each tube, above the floor and above the highest point of the ceiling
  const openings = tubes.map((tube) => ceilingAt(room, tube.centre_m) - (tube.drop_m ?? 0));
  const above = openings.map((opening) => opening - height);
  const top = Math.max(0.4, ...courses.flatMap((points, i) => points.map(([, up]) => up + (above[i] ?? 0))));
  const outside = courses.map((points, i) => (points.at(-1)?.[1] ?? top) - (tubes[i]?.drop_m ?? 0));
  const roof = Math.max(0.1, Math.min(...outside, top) - ABOVE_ROOF_M);
  const k = Math.min(300 / across, 330 / (height + top + 0.4));
  const [left, bottom] = [40, 30 + k * (height + top + 0.35)];
  const x = (/** @type {number} */ metres) => left + k * (metres - from);
  const y = (/** @type {number} */ metres) => bottom - k * metres;
  const end = from + across;
  const workplane = draft.grids?.[0]?.height_m ?? 0;
  const box = `0 0 ${left + k * across + 62} ${bottom + 30}`;
  const toggle = (/** @type {"north" | "west"} */ to) =>
    html`<button type="button" aria-pressed=${look === to} @click=${() => set({ look: to })}>looking ${to}</button>`;
  return html`<div class="head"><h2>Section</h2><div class="group">${toggle("north")}${toggle("west")}</div></div>
    ${svg`<svg class="section" viewBox=${box} role="img"
      aria-label=${`Section through the room, looking ${look}: ${height} m high, ${tubes.length} tubes`}>
      ${room.plan ? sloped(room, axis, roof, x, y) : level({ from, end, height, roof }, x, y)}
      ${courses.map((points, i) => guide(i, /** @type {Tube} */ (tubes[i]), points, openings[i] ?? height, { x, y, k }))}
      ${room.plan ? nothing : svg`<path class="shell" d=${`M${x(from)} ${y(height)}V${y(0)}H${x(end)}V${y(height)}`}></path>`}
      <line class="workplane" x1=${x(from)} x2=${x(end)} y1=${y(workplane)} y2=${y(workplane)}></line>
      <text x=${x(end) + 6} y=${y(workplane) + 4}>${workplane} m</text>
      <text x=${x(end) + 6} y=${y(height) + 14}>${room.plan ? centimetres(height) : height} m</text>
      ${lowest < height ? svg`<text x=${x(end) + 6} y=${y(lowest) + 4}>${centimetres(lowest)} m</text>` : nothing}
      <text class="measure" x=${x(from + across / 2)} y=${bottom + 22}>${across} m</text>
      ${beam(axis, x(from) + 12, y(height + roof) - 8)}
    </svg>`}`;
}

/** @typedef {(metres: number) => number} Scale */

/** Roof and air of a box. @param {{ from: number, end: number, height: number, roof: number }} of @param {Scale} x @param {Scale} y */
const level = ({ from, end, height, roof }, x, y) =>
  svg`<rect class="roof" x=${x(from) - 14} y=${y(height + roof)} width=${x(end) - x(from) + 28} height=${y(height) - y(height + roof)}></rect>
    <rect class="air" x=${x(from)} y=${y(height)} width=${x(end) - x(from)} height=${y(0) - y(height)}></rect>`;

/** Roof and faces of a room above a plan, seen from the side. @param {JobDocument["room"]} room @param {0 | 1} axis @param {number} roof @param {Scale} x @param {Scale} y */
function sloped(room, axis, roof, x, y) {
  const seen = (/** @type {number} */ more) =>
    faces(room).map((face) => `M${face.map((place) => `${x(place[axis])} ${y(place[2] > 0 ? place[2] + more : 0)}`).join("L")}Z`);
  return [
    seen(roof).map((face) => svg`<path class="roof" d=${face}></path>`),
    seen(0).map((face) => svg`<path class="air" d=${face}></path>`),
    seen(0).map((face) => svg`<path class="face" d=${face}></path>`),
  ];
}

/** Hangs a tube lower or higher while a hand holds its opening. @param {PointerEvent} event @param {number} index @param {number} k */
function hang(event, index, k) {
  const held = /** @type {SVGElement} */ (event.currentTarget);
  const scale = held.ownerSVGElement?.getScreenCTM()?.d;
  if (event.button !== 0 || !scale) return;
  event.preventDefault();
  held.setPointerCapture(event.pointerId);
  hold(true);
  const [start, drop] = [event.clientY, state.draft.tubes?.[index]?.drop_m ?? 0];
  held.onpointermove = ({ clientY }) => edit((draft) => setDrop(draft.tubes?.[index], drop + (clientY - start) / scale / k));
  held.onpointerup = held.onpointercancel = () => {
    held.onpointermove = held.onpointerup = held.onpointercancel = null;
    hold(false);
  };
}

/**
 * @param {number} index
 * @param {Tube} tube
 * @param {[number, number][]} points
 * @param {number} opening
 * @param {{ x: Scale, y: Scale, k: number }} at
 */
function guide(index, tube, points, opening, { x, y, k }) {
  const radius = diameter(tube) / 2;
  const [one = [], other = []] = sides(points, radius);
  const of = (/** @type {[number, number]} */ [along, up]) => `${x(along).toFixed(1)} ${y(opening + up).toFixed(1)}`;
  const outline = [...one, ...other.toReversed()].map(of).join("L");
  const [a, b] = [one.at(-1), other.at(-1)];
  const dome = !isMesh(tube) && (tube.collector.kind === "dome" || tube.collector.kind === "dielectric_dome");
  const cover = a && b ? (dome ? `M${of(a)}A${k * radius} ${k * radius} 0 0 0 ${of(b)}` : `M${of(a)}L${of(b)}`) : "";
  const [from, to] = [x((points[0]?.[0] ?? 0) - radius), x((points[0]?.[0] ?? 0) + radius)];
  return svg`<path class="guide" d=${`M${outline}Z`}></path><path class="cover" d=${cover}></path><g
    class="opening" @touchstart=${still} @pointerdown=${(/** @type {PointerEvent} */ event) => hang(event, index, k)}><line
    class="hold" x1=${from} x2=${to} y1=${y(opening)} y2=${y(opening)}></line><line
    class="diffuser" x1=${from} x2=${to} y1=${y(opening)} y2=${y(opening)}></line></g>`;
}

/** The sun's beam in the plane of the section. @param {0 | 1} axis @param {number} x @param {number} y */
function beam(axis, x, y) {
  const sun = state.answer?.job.provenance?.sun;
  if (!sun?.on || !(Number(sun.altitude_deg) > 0)) return nothing;
  const azimuth = (Number(sun.azimuth_deg) - (state.draft.room.rotation_deg ?? 0)) * RADIANS;
  const altitude = Number(sun.altitude_deg) * RADIANS;
  const along = Math.cos(altitude) * (axis === 0 ? Math.sin(azimuth) : Math.cos(azimuth));
  const up = Math.sin(altitude);
  const length = Math.hypot(along, up) || 1;
  const [dx, dy] = [(along / length) * 44, (-up / length) * 44];
  return svg`<g class="sun"><line x1=${x + dx} y1=${y + dy} x2=${x} y2=${y}></line><circle cx=${x + dx} cy=${y + dy}
    r="6"></circle></g>`;
}
