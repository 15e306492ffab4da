// The view in three dimensions on a canvas: its colours, and the pointers, wheel and keys that turn it. It is loaded when the view is opened.
import { byKey, projection, STARTS, turned, zoomed } from "./view3d_camera.js";
import { painter } from "./view3d_paint.js";
import { models, patches } from "./view3d_files.js";
import { shapes, trapezoids } from "./view3d_shapes.js";
import { coloured, edges, reaching } from "./map.js";
import { dot, normal, unit } from "./ray.js";
import { extent, rings } from "./room.js";
import { rising } from "./scale.js";

/** @typedef {import("./view3d_shapes.js").Part} Part */
/** @typedef {import("./ray.js").Vector} Vector */
/** What is drawn: a document, the sun where it is out, the map of the plan, and what files of a job have of faces and meshes. @typedef {{ draft: JobDocument, sun: { azimuth_deg: number, altitude_deg: number } | null, map: ReturnType<typeof import("./plan.js").shown>, faces: Schemas["SurfacesResult"] | null, meshes: Schemas["MeshesResult"] | null }} Model */

/** Colour of a part as a variable of the style sheet, how much of it is mixed into the panel's, how much more where light comes from, opacity. @type {Record<Part, [name: string, share: number, more: number, opacity: number]>} */
const PAINTS = {
  floor: ["--wall", 0.24, 0, 1],
  wall: ["--wall", 0.1, 0.1, 1],
  ceiling: ["--wall", 0.14, 0, 1],
  patch: ["--wall", 0, 0, 1],
  object: ["--wall", 0.3, 0.22, 1],
  outdoors: ["--wall", 0.4, 0.2, 0.16],
  front: ["--wall", 0, 0.4, 1],
  sheet: ["--wall", 0, 0.4, 1],
  partition: ["--wall", 0.34, 0.1, 1],
  luminaire: ["--light", 0.8, 0, 1],
  closure: ["--light", 1, 0, 1],
  north: ["--wall", 0.8, 0, 1],
  sun: ["--light", 1, 0, 1],
  pipe: ["--light", 0.35, 0.25, 0.6],
  cover: ["--accent", 0.5, 0.3, 0.5],
};
const CULLED = new Set(["floor", "wall", "ceiling", "patch", "object", "front"]);
const CLEAR = new Set(["pipe", "cover", "outdoors"]);
const LINE_OPACITY = 0.75;
/** Direction from which sides are darkest, so that corners are seen. */
const SHADE = unit([0.8, 0.5, -0.35]);
/** Degrees by which a drag of one pixel turns the camera, and powers of e by which one of the wheel zooms. */
const PIXEL_DEG = 0.4;
const WHEEL = 0.0015;
const MOST_PIXELS = 2;
/** Height of the work plane above its sensors, as a share of the room's width or depth. */
const HAIR = 1e-3;

/** Colours of the style sheet, 0..1. @param {Element} element */
function palette(element) {
  const style = getComputedStyle(element);
  const of = (/** @type {string} */ name) => {
    const hex = style.getPropertyValue(name).trim().slice(1);
    const full = hex.length === 3 ? hex.replace(/./g, "$&$&") : hex;
    return /** @type {Vector} */ ([0, 2, 4].map((at) => parseInt(full.slice(at, at + 2), 16) / 255));
  };
  return /** @type {Record<string, Vector>} */ (Object.fromEntries(["--panel", "--wall", "--light", "--accent"].map((name) => [name, of(name)])));
}

/** Triangles of a convex polygon. @param {Vector[]} ring */
const fan = (ring) => ring.slice(2).flatMap((corner, k) => [ring[0], ring[k + 1], corner].map((it) => /** @type {Vector} */ (it)));

/** Corners of all that is drawn, in layers. @param {ReturnType<typeof shapes>} of @param {Record<string, Vector>} colours */
function layers({ polygons, lines }, colours) {
  const panel = colours["--panel"] ?? [1, 1, 1];
  /** @type {[number[], number[], number[]]} */
  const [culled, sheets, clear] = [[], [], []];
  for (const { part, ring, colour } of polygons) {
    const [name, share, more, opacity] = PAINTS[part];
    const across = normal(ring);
    const toShade = more && Math.hypot(...across) > 0 ? dot(unit(across), SHADE) : 0;
    // the fronts of a model may lie inside
    const paint = colour
      ? colour.map((channel) => channel * (1 - more * Math.abs(toShade)))
      : panel.map((channel, k) => channel + (share + more * Math.max(0, toShade)) * ((colours[name]?.[k] ?? 0) - channel));
    const into = CLEAR.has(part) ? clear : CULLED.has(part) ? culled : sheets;
    for (const corner of fan(ring)) into.push(...corner, ...paint, opacity);
  }
  const line = [...(colours["--wall"] ?? []), LINE_OPACITY];
  const pairs = lines.flatMap((points) => points.slice(1).flatMap((point, k) => [...(points[k] ?? []), ...line, ...point, ...line]));
  return [{ cull: true, corners: culled }, { corners: sheets }, { lines: true, corners: pairs }, { corners: clear }];
}

/** The work plane in the colours of the plan. @param {Model["map"]} map */
function workplane(map) {
  if (!map?.grid.x_m.length || map.grid.points_m) return null;
  const { grid, rows, end, room, current } = map;
  const { width, depth } = extent(room);
  // one on the floor lies before it
  const height = grid.height_m + HAIR * Math.max(width, depth);
  const floor = rings(room).map((ring) => ring.map(([x, y]) => /** @type {Vector} */ ([x, y, height])));
  const corners = trapezoids(floor).flatMap(fan).flatMap((corner) => [...corner, 1, 1, 1, current ? 1 : 0.7]);
  return { corners, cells: coloured(grid, reaching(grid, rows, room), (value) => rising(value / end)), edges: edges(grid) };
}

/**
 * Lets pointers, wheel and keys on a canvas turn the camera.
 * @param {HTMLCanvasElement} canvas
 * @param {(change: (orbit: import("./view3d_camera.js").Orbit) => import("./view3d_camera.js").Orbit) => void} move
 */
function steer(canvas, move) {
  /** @type {Map<number, [number, number]>} */
  const down = new Map();
  const apart = () => {
    const [[x1, y1] = [0, 0], [x2, y2] = [0, 0]] = [...down.values()];
    return Math.hypot(x2 - x1, y2 - y1);
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = down.get(event.pointerId);
    if (!before) return;
    // a button that was let go elsewhere, as over a context menu, is not told of
    if (event.pointerType === "mouse" && !(event.buttons & 1)) return void down.delete(event.pointerId);
    const width = apart();
    down.set(event.pointerId, [event.clientX, event.clientY]);
    if (down.size > 1) return move((orbit) => zoomed(orbit, apart() / Math.max(1, width)));
    move((orbit) => turned(orbit, PIXEL_DEG * (event.clientX - before[0]), PIXEL_DEG * (event.clientY - before[1])));
  });
  for (const end of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) canvas.addEventListener(end, ({ pointerId }) => down.delete(pointerId));
  // the wheel scrolls the page until the view is chosen
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas) return;
    event.preventDefault();
    move((orbit) => zoomed(orbit, Math.exp(-WHEEL * event.deltaY)));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const next = event.ctrlKey || event.metaKey || event.altKey ? null : (orbit = STARTS.corner) => byKey(orbit, event.key);
    if (!next?.()) return;
    event.preventDefault();
    move((orbit) => next(orbit) ?? orbit);
  });
}

/**
 * Opens the view on a canvas; null where the browser cannot draw it.
 * @param {HTMLCanvasElement} canvas
 */
export function view(canvas) {
  const paints = painter(canvas);
  if (!paints) return null;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let [orbit, waiting, ended] = [STARTS.corner, false, false];
  /** @type {{ model: Model, key: unknown[], bounds: import("./view3d_shapes.js").Bounds } | null} */
  let shown = null;
  const draw = () => {
    waiting = false;
    if (ended || !shown) return;
    const scale = Math.min(MOST_PIXELS, devicePixelRatio);
    const [width, height] = [Math.round(canvas.clientWidth * scale), Math.round(canvas.clientHeight * scale)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    if (width && height) paints.draw(projection(orbit, shown.bounds, width / height));
  };
  const soon = () => {
    if (!waiting) requestAnimationFrame(draw);
    waiting = true;
  };
  const move = (/** @type {(from: import("./view3d_camera.js").Orbit) => import("./view3d_camera.js").Orbit} */ change) => {
    orbit = change(orbit);
    soon();
  };
  /** @param {Model} model */
  const show = (model) => {
    const { draft, sun, map, faces, meshes } = model;
    const key = [draft, faces, meshes, map?.rows, map?.end, map?.current, map?.room, sun?.azimuth_deg, sun?.altitude_deg, dark.matches];
    if (shown && key.every((value, k) => value === shown?.key[k])) return;
    const of = shapes(draft, sun, { faces: faces && map ? patches(faces, map.end) : [], models: meshes ? models(meshes) : [] });
    paints.take(layers(of, palette(canvas)), workplane(map));
    shown = { model, key, bounds: of.bounds };
    soon();
  };
  const again = () => shown && show(shown.model);
  dark.addEventListener("change", again);
  const sizes = new ResizeObserver(soon);
  sizes.observe(canvas);
  steer(canvas, move);
  return {
    show,
    move,
    dispose() {
      ended = true;
      dark.removeEventListener("change", again);
      sizes.disconnect();
      paints.dispose();
    },
  };
}
