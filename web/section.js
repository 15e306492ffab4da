// A section through room, roof and tubes.
import { diameter, isMesh } from "./draft.js";
import { set, state } from "./state.js";
import { html, nothing, svg } from "./vendor/lit-html.js";

const RADIANS = Math.PI / 180;
/** How much of a tube stands out of the roof. */
const ABOVE_ROOF_M = 0.15;

/**
 * Points of a tube's axis, along the section and up from the ceiling.
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
  const [width, depth, height] = draft.room.size_m;
  const axis = look === "north" ? 0 : 1;
  const extent = axis === 0 ? width : depth;
  const tubes = draft.tubes ?? [];
  const courses = tubes.map((tube) => course(tube, axis));
  const top = Math.max(0.4, ...courses.flat().map(([, up]) => up));
  const lowest = Math.min(...courses.map((points) => points.at(-1)?.[1] ?? top), top);
  const roof = Math.max(0.1, lowest - ABOVE_ROOF_M);
  const k = Math.min(300 / extent, 330 / (height + top + 0.4));
  const [left, bottom] = [40, 30 + k * (height + top + 0.35)];
  const x = (/** @type {number} */ metres) => left + k * metres;
  const y = (/** @type {number} */ metres) => bottom - k * metres;
  const workplane = draft.grids?.[0]?.height_m ?? 0;
  const box = `0 0 ${left + k * extent + 62} ${bottom + 30}`;
  const toggle = (/** @type {"north" | "west"} */ to) =>
    html`<button type="button" aria-pressed=${look === to} @click=${() => set({ look: to })}>looking ${to}</button>`;
  return html`<div class="head"><h2>Section</h2><div class="group">${toggle("north")}${toggle("west")}</div></div>
    ${svg`<svg class="section" viewBox=${box} role="img"
      aria-label=${`Section through the room, looking ${look}: ${height} m high, ${tubes.length} tubes`}>
      <rect class="roof" x=${x(0) - 14} y=${y(height + roof)} width=${k * extent + 28} height=${k * roof}></rect>
      <rect class="air" x=${x(0)} y=${y(height)} width=${k * extent} height=${k * height}></rect>
      ${courses.map((points, i) => guide(/** @type {Tube} */ (tubes[i]), points, height, x, y, k))}
      <path class="shell" d=${`M${x(0)} ${y(height)}V${y(0)}H${x(extent)}V${y(height)}`}></path>
      <line class="workplane" x1=${x(0)} x2=${x(extent)} y1=${y(workplane)} y2=${y(workplane)}></line>
      <text x=${x(extent) + 6} y=${y(workplane) + 4}>${workplane} m</text>
      <text x=${x(extent) + 6} y=${y(height) + 14}>${height} m</text>
      <text class="measure" x=${x(extent / 2)} y=${bottom + 22}>${extent} m</text>
      ${beam(axis, x(0) + 12, y(height + roof) - 8)}
    </svg>`}`;
}

/**
 * @param {Tube} tube
 * @param {[number, number][]} points
 * @param {number} ceiling
 * @param {(metres: number) => number} x
 * @param {(metres: number) => number} y
 * @param {number} k
 */
function guide(tube, points, ceiling, x, y, k) {
  const radius = diameter(tube) / 2;
  const [one = [], other = []] = sides(points, radius);
  const of = (/** @type {[number, number]} */ [along, up]) => `${x(along).toFixed(1)} ${y(ceiling + up).toFixed(1)}`;
  const outline = [...one, ...other.toReversed()].map(of).join("L");
  const [a, b] = [one.at(-1), other.at(-1)];
  const dome = !isMesh(tube) && (tube.collector.kind === "dome" || tube.collector.kind === "dielectric_dome");
  const cover = a && b ? (dome ? `M${of(a)}A${k * radius} ${k * radius} 0 0 0 ${of(b)}` : `M${of(a)}L${of(b)}`) : "";
  const [from, to] = [x((points[0]?.[0] ?? 0) - radius), x((points[0]?.[0] ?? 0) + radius)];
  return svg`<path class="guide" d=${`M${outline}Z`}></path><path class="cover" d=${cover}></path><line
    class="diffuser" x1=${from} x2=${to} y1=${y(ceiling)} y2=${y(ceiling)}></line>`;
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
