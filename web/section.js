// A section through room, roof and tubes.
import { centimetres, setDrop } from "./draft.js";
import { edit, hold } from "./live.js";
import { meshes } from "./job_files.js";
import { objects as models, reach, tube as model } from "./models.js";
import { still } from "./plan_hand.js";
import { isInFace, isInWall, opening as openingOf, rim } from "./opening.js";
import { joints, skyward, throughPipe } from "./ray.js";
import { contents, extent, faces } from "./room.js";
import { AROUND } from "./stage.js";
import { set, state } from "./state.js";
import { diameter, isMesh, square } from "./tube.js";
import { html, nothing, svg } from "./vendor/lit-html.js";

const RADIANS = Math.PI / 180;
/** How much of a tube stands out of the roof. */
const ABOVE_ROOF_M = 0.15;

/** Share of the height that the drawing leaves which is put below it: above it there is more space already. */
const BELOW = 0.65;

/** Sides of a rim, and length in metres of a model that is not known yet. */
const SIDES = 48;
const MODEL_M = 1;

/** How a tube is seen: the points of its axis and of its rim, along the section and up from the opening. @typedef {{ points: [number, number][], rim: [number, number][] }} Course */

/**
 * @param {JobDocument} draft
 * @param {number} index
 * @param {0 | 1} axis
 * @returns {Course}
 */
function course(draft, index, axis) {
  const tube = /** @type {Tube} */ (draft.tubes?.[index]);
  const { centre, outward } = openingOf(draft.room, tube);
  const segments = isMesh(tube) ? [{ length_m: reach(meshes(draft), index, centre, outward) ?? MODEL_M }] : tube.segments;
  const points = joints(segments, outward).map((joint) => /** @type {[number, number]} */ ([centre[axis] + joint[axis], joint[2]]));
  // a piece that runs along the line of sight is not seen
  const seen = points.filter(([x, y], i) => !i || Math.hypot(x - Number(points[i - 1]?.[0]), y - Number(points[i - 1]?.[1])) > 1e-3);
  return { points: seen, rim: rim(draft.room, tube, SIDES).map((corner) => [corner[axis], corner[2] - centre[2]]) };
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
      // the first piece starts square at the opening
      const [nx, ny] = [before[0] + after[0], before[1] + after[1]];
      const share = (2 / (nx * nx + ny * ny || 1)) * side * radius;
      return /** @type {[number, number]} */ ([x + nx * share, y + ny * share]);
    }),
  );
}

/** Free space in metres above the tubes, with the sun's ray and without it. */
const ABOVE_TUBES_M = { sun: 0.5, none: 0.15 };

/** The sun of the answer, where it shines. */
function sunUp() {
  const sun = state.answer?.job.provenance?.sun;
  return sun?.on && Number(sun.altitude_deg) > 0 ? sun : null;
}

/** What a section shows: the draft, or the one before while it is refused; its tubes and their openings, and how far room and drawing reach in metres. */
function shown() {
  const { problem, look, draft: own, answered } = state;
  const draft = problem?.errors?.length ? answered : own;
  const { room } = draft;
  const { west, south, width, depth, height } = extent(room);
  const axis = look === "north" ? /** @type {const} */ (0) : /** @type {const} */ (1);
  const [from, across] = axis === 0 ? [west, width] : [south, depth];
  const tubes = draft.tubes ?? [];
  const courses = tubes.map((_, index) => course(draft, index, axis));
  const openings = tubes.map((tube) => openingOf(room, tube).centre[2]);
  const above = openings.map((opening) => opening - height);
  // tubes below a slope may end below its ridge
  const highest = Math.max(...courses.flatMap(({ points }, i) => points.map(([, up]) => up + (above[i] ?? 0))));
  const top = Math.max(0.4, highest);
  const outside = courses.flatMap(({ points }, i) => {
    const tube = tubes[i];
    return tube && !isInWall(room, tube) ? [(points.at(-1)?.[1] ?? top) - (tube.drop_m ?? 0)] : [];
  });
  const roof = Math.max(0.1, Math.min(...outside, top) - ABOVE_ROOF_M);
  const beside = courses.flatMap(({ points }, i) => points.flatMap(([x]) => [-1, 1].map((side) => x + (side * diameter(/** @type {Tube} */ (tubes[i]))) / 2)));
  const [left, right] = [Math.min(from, ...beside), Math.max(from + across, ...beside)];
  return { draft, axis, from, across, left, right, courses, openings, roof, top: height + Math.max(roof + ABOVE_ROOF_M, highest + ABOVE_TUBES_M[sunUp() ? "sun" : "none"]) };
}

/** Width and height of the section in metres. @returns {import("./stage.js").Size} */
export function sectionExtent() {
  const { left, right, top } = shown();
  return { width: right - left, height: top };
}

/** The section with its two directions. */
export function section() {
  const { look, sizes } = state;
  const { draft, axis, from, across, left: west, right: east, courses, openings, roof, top } = shown();
  const { room } = draft;
  const { lowest, height } = extent(room);
  const [boxWidth, boxHeight] = sizes.section;
  const around = AROUND.section;
  const free = [boxWidth - around.left - around.right, boxHeight - around.top - around.bottom];
  const k = Math.max(1, Math.min((free[0] ?? 0) / (east - west), (free[1] ?? 0) / top));
  const [left, bottom] = [around.left + ((free[0] ?? 0) - k * (east - west)) / 2, boxHeight - around.bottom - BELOW * ((free[1] ?? 0) - k * top)];
  const x = (/** @type {number} */ metres) => left + k * (metres - west);
  const y = (/** @type {number} */ metres) => bottom - k * metres;
  const end = from + across;
  const tubes = draft.tubes ?? [];
  const beside = x(east) + 8;
  const workplane = draft.grids?.find(({ points_m }) => !points_m)?.height_m;
  const toggle = (/** @type {"north" | "west"} */ to) =>
    html`<button type="button" aria-label=${`looking ${to}`} aria-pressed=${look === to} @click=${() => set({ look: to })}>${to}</button>`;
  return html`<div class="head"><h2>Section looking</h2><div class="group">${toggle("north")}${toggle("west")}</div></div>
    ${svg`<svg class="section" viewBox=${`0 0 ${boxWidth} ${boxHeight}`} role="img"
      aria-label=${`Section through the room, looking ${look}: ${height} m high, ${tubes.length} tubes`}>
      ${room.plan ? sloped(room, axis, roof, x, y) : level({ from, end, height, roof }, x, y)}
      ${(room.objects ?? []).map((object) => (object.kind === "box" ? furniture(object, axis, x, y) : nothing))}
      ${models(meshes(draft), [axis, 2], { x: x(0), y: y(0), k })}
      ${(room.partitions ?? []).map((sheet) => partition(sheet, axis, x, y))}
      ${courses.map((course, i) => guide(i, /** @type {Tube} */ (tubes[i]), course, openings[i] ?? height, { x, y, k }, model(meshes(draft), i, [axis, 2], { x: x(0), y: y(0), k })))}
      ${room.plan ? nothing : svg`<path class="shell" d=${`M${x(from)} ${y(height)}V${y(0)}H${x(end)}V${y(height)}`}></path>`}
      ${typeof workplane === "number"
        ? svg`<line class="workplane" x1=${x(from)} x2=${x(end)} y1=${y(workplane)} y2=${y(workplane)}></line>
          <text x=${beside} y=${y(workplane) + 4}>${workplane} m</text>`
        : nothing}
      <text x=${beside} y=${y(height) + 14}>${centimetres(height)} m</text>
      ${lowest < height ? svg`<text x=${beside} y=${y(lowest) + 4}>${centimetres(lowest)} m</text>` : nothing}
      <text class="measure" x=${x(from + across / 2)} y=${y(0) + 22}>${centimetres(across)} m</text>
      ${beams(draft, axis, openings, x, y)}
    </svg>`}${facts(draft)}`;
}

/** What the room holds and what its openings are to it, the most useful first: as many are seen as there is space for. @param {JobDocument} draft */
function facts({ room, tubes = [] }) {
  const { area, volume } = contents(room);
  const { lowest, height } = extent(room);
  const openings = tubes.reduce((sum, tube) => sum + (square(tube)?.side_m ?? (Math.sqrt(Math.PI) * diameter(tube)) / 2) ** 2, 0);
  const short = (/** @type {number} */ value) => Number(value.toPrecision(3));
  const rows = [
    ["floor", `${short(area)}\u202fm²`],
    ["openings", `${Number(((100 * openings) / area).toPrecision(2))}\u202f% of the floor`],
    ["volume", `${short(volume)}\u202fm³`],
    ["height", `${lowest < height ? `${centimetres(lowest)} to ` : ""}${centimetres(height)}\u202fm`],
    ["tubes", String(tubes.length)],
  ];
  return html`<dl class="numbers facts">${rows.map(([name, value]) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>`;
}

/** A box in the room, as wide as it is seen. @param {Extract<Schemas["ObjectDocument"], { kind: "box" }>} object @param {0 | 1} axis @param {Scale} x @param {Scale} y */
function furniture({ position_m, size_m, rotation_deg = 0 }, axis, x, y) {
  const [cos, sin] = [Math.abs(Math.cos(rotation_deg * RADIANS)), Math.abs(Math.sin(rotation_deg * RADIANS))];
  const [wide, deep, high] = size_m;
  const half = (axis === 0 ? wide * cos + deep * sin : wide * sin + deep * cos) / 2;
  const [middle, base] = [position_m[axis], position_m[2]];
  return svg`<rect class="object" x=${x(middle - half)} width=${x(middle + half) - x(middle - half)} y=${y(base + high)} height=${y(base) - y(base + high)}></rect>`;
}

/** @param {Schemas["PartitionDocument"]} sheet @param {0 | 1} axis @param {Scale} x @param {Scale} y */
function partition({ from_m, to_m, height_m }, axis, x, y) {
  const [from, to] = [from_m[axis], to_m[axis]].sort((a, b) => a - b);
  const [left, right] = [x(from ?? 0), x(to ?? 0)];
  return svg`<rect class="object" x=${left} width=${Math.max(1.5, right - left)} y=${y(height_m)} height=${y(0) - y(height_m)}></rect>`;
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
 * @param {Course} course
 * @param {number} opening
 * @param {{ x: Scale, y: Scale, k: number }} at
 * @param {unknown} model its triangles, where it is a mesh and they are there
 */
function guide(index, tube, { points, rim }, opening, { x, y, k }, model) {
  const radius = diameter(tube) / 2;
  const [one = [], other = []] = sides(points, radius);
  const of = (/** @type {[number, number]} */ [along, up]) => `${x(along).toFixed(1)} ${y(opening + up).toFixed(1)}`;
  const outline = [...one, ...other.toReversed()].map(of).join("L");
  const [a, b] = [one.at(-1), other.at(-1)];
  const dome = !isMesh(tube) && (tube.collector.kind === "dome" || tube.collector.kind === "dielectric_dome");
  const cover = a && b && points.length > 1 ? (dome ? `M${of(a)}A${k * radius} ${k * radius} 0 0 0 ${of(b)}` : `M${of(a)}L${of(b)}`) : "";
  const { side_m = diameter(tube), rotation_deg = 0 } = square(tube) ?? {};
  const turn = rotation_deg * RADIANS;
  const half = (side_m / 2) * (Math.abs(Math.cos(turn)) + Math.abs(Math.sin(turn)));
  const [from, to] = [x((points[0]?.[0] ?? 0) - half), x((points[0]?.[0] ?? 0) + half)];
  const pipe = model ?? svg`<path class="guide" d=${`M${outline}Z`}></path><path class="cover" d=${cover}></path>`;
  if (isInFace(tube)) return svg`${pipe}<path class="diffuser" d=${`M${rim.map(of).join("L")}Z`}></path>`;
  return svg`${pipe}<g
    class="opening" @touchstart=${still} @pointerdown=${(/** @type {PointerEvent} */ event) => hang(event, index, k)}><line
    class="hold" x1=${from} x2=${to} y1=${y(opening)} y2=${y(opening)}></line><line
    class="diffuser" x1=${from} x2=${to} y1=${y(opening)} y2=${y(opening)}></line></g>`;
}

/** Length of the sun's ray before it meets a tube, and radius of its sun, in CSS pixels. */
const RAY = 46;
const SUN = 5;

/** The sun's ray through each tube: to its diffuser, or to the floor or a side of the room's extent where the tube ends clear or open. @param {JobDocument} draft @param {0 | 1} axis @param {number[]} openings @param {Scale} x @param {Scale} y */
function beams(draft, axis, openings, x, y) {
  const sun = sunUp();
  if (!sun) return nothing;
  const toSun = skyward(Number(sun.azimuth_deg) - (draft.room.rotation_deg ?? 0), Number(sun.altitude_deg));
  const { west, east, south, north } = extent(draft.room);
  const seen = (draft.tubes ?? []).map((tube, i) => {
    const ray = isMesh(tube) ? null : throughPipe(joints(tube.segments, openingOf(draft.room, tube).outward), tube.diameter_m / 2, toSun);
    if (isMesh(tube) || !ray) return nothing;
    const opening = openings[i] ?? 0;
    const place = (/** @type {import("./ray.js").Vector} */ point) => /** @type {[number, number]} */ ([x(tube.centre_m[axis] + point[axis]), y(opening + point[2])]);
    const points = ray.points.map(place);
    const [startX, startY] = points[0] ?? [0, 0];
    // the sun stays on the drawing
    const times = Math.min(RAY / Math.hypot(toSun[axis], toSun[2]), (startY - SUN) / toSun[2]);
    const from = /** @type {[number, number]} */ ([startX + times * toSun[axis], startY - times * toSun[2]]);
    const out = /** @type {import("./ray.js").Vector} */ (ray.points.at(-1));
    const goesOn = ray.end === "room" && (tube.diffuser.kind === "clear" || tube.diffuser.kind === "open");
    const until = (/** @type {0 | 1} */ k, /** @type {number} */ low, /** @type {number} */ high) => {
      const by = ray.direction[k];
      return by ? ((by > 0 ? high : low) - tube.centre_m[k] - out[k]) / by : Infinity;
    };
    const metres = Math.min(opening / -ray.direction[2], until(0, west, east), until(1, south, north));
    const end = /** @type {import("./ray.js").Vector} */ (out.map((from, k) => from + metres * (ray.direction[k] ?? 0)));
    const floor = goesOn ? [place(end)] : [];
    const line = [from, ...points, ...floor].map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");
    return svg`<g><polyline points=${line}></polyline><circle cx=${from[0]} cy=${from[1]} r=${SUN}></circle></g>`;
  });
  return svg`<g class="sun">${seen}</g>`;
}
