// Meshes as plan and section show them: objects as the convex outlines of their pieces, tubes as their triangles seen from the side.
import { svg } from "./vendor/lit-html.js";

/** @typedef {[number, number]} Point */
/** From where a drawing looks: by the axes of the room that run across and up in it. @typedef {[0 | 1, 1 | 2]} Look */

/** Largest number of outlines; of more the largest are drawn. */
const MOST = 400;

/** Corners of the pieces of a part: triangles that share corners. @param {Schemas["MeshPartResult"]} part @returns {number[][][]} */
function pieces({ corners_m, triangles }) {
  const parents = corners_m.map((_, corner) => corner);
  const root = (/** @type {number} */ corner) => {
    let at = corner;
    while (parents[at] !== at) at = parents[at] = /** @type {number} */ (parents[/** @type {number} */ (parents[at])]);
    return at;
  };
  for (const [a = 0, b = 0, c = 0] of triangles) {
    parents[root(b)] = root(a);
    parents[root(c)] = root(a);
  }
  /** @type {Map<number, number[][]>} */
  const found = new Map();
  for (const corner of new Set(triangles.flat())) {
    const of = root(corner);
    found.set(of, [...(found.get(of) ?? []), corners_m[corner] ?? []]);
  }
  return [...found.values()];
}

/** Convex hull of points, counter-clockwise (Andrew 1979). @param {Point[]} points @returns {Point[]} */
export function hull(points) {
  const ordered = points.toSorted(([ax, ay], [bx, by]) => ax - bx || ay - by);
  const half = (/** @type {Point[]} */ all) => {
    /** @type {Point[]} */
    const chain = [];
    for (const point of all) {
      for (;;) {
        const [a, b] = [chain.at(-2), chain.at(-1)];
        if (!a || !b || (b[0] - a[0]) * (point[1] - b[1]) - (b[1] - a[1]) * (point[0] - b[0]) > 0) break;
        chain.pop();
      }
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(ordered), ...half(ordered.toReversed())];
}

/** Polygons as a path in metres. @param {Point[][]} rings */
const path = (rings) => rings.map((ring) => `M${ring.map(([x, y]) => `${x.toFixed(4)} ${y.toFixed(4)}`).join("L")}Z`).join("");

/** What was made of a file once. @type {WeakMap<Schemas["MeshesResult"], Map<string, string | string[]>>} */
const made = new WeakMap();

/** @template {string | string[]} T @param {Schemas["MeshesResult"]} of @param {string} key @param {() => T} make @returns {T} */
function once(of, key, make) {
  const known = made.get(of) ?? new Map();
  made.set(of, known);
  const value = /** @type {T | undefined} */ (known.get(key)) ?? make();
  known.set(key, value);
  return value;
}

/** Outlines of the objects that are meshes, as paths in metres. @param {Schemas["MeshesResult"]} of @param {Look} look */
function outlines(of, [across, up]) {
  return once(of, `objects ${across} ${up}`, () => {
    const parts = of.meshes.flatMap(({ parts }) => parts).filter(({ role }) => role === "object");
    const hulls = parts.flatMap(pieces).map((corners) => hull(corners.map((corner) => /** @type {Point} */ ([corner[across] ?? 0, corner[up] ?? 0]))));
    const extent = (/** @type {Point[]} */ ring) =>
      Math.hypot(...[0, 1].map((k) => Math.max(...ring.map((corner) => corner[k] ?? 0)) - Math.min(...ring.map((corner) => corner[k] ?? 0))));
    const largest = hulls.length > MOST ? hulls.toSorted((a, b) => extent(b) - extent(a)).slice(0, MOST) : hulls;
    return largest.map((ring) => path([ring]));
  });
}

/** Place of the origin in a drawing, and units of it for a metre. @typedef {{ x: number, y: number, k: number }} Frame */

/** @param {Frame} frame */
const turned = ({ x, y, k }) => `matrix(${k} 0 0 ${-k} ${x} ${y})`;

/** Draws the objects that are meshes. @param {Schemas["MeshesResult"] | null} of @param {Look} look @param {Frame} frame */
export const objects = (of, look, frame) =>
  of ? svg`<g class="models" transform=${turned(frame)}>${outlines(of, look).map((d) => svg`<path class="object" d=${d}></path>`)}</g>` : null;

/** The mesh of a tube. @param {Schemas["MeshesResult"] | null} of @param {number} index */
const tubeOf = (of, index) => of?.meshes.find(({ pointer }) => pointer === `/tubes/${index}`);

/** Length of a tube that is a mesh along a direction, from its opening; null where it is not known. @param {Schemas["MeshesResult"] | null} of @param {number} index @param {number[]} centre @param {number[]} outward */
export function reach(of, index, centre, outward) {
  const mesh = tubeOf(of, index);
  const along = (/** @type {number[]} */ corner) => corner.reduce((sum, value, k) => sum + (value - (centre[k] ?? 0)) * (outward[k] ?? 0), 0);
  return mesh ? Math.max(...mesh.parts.flatMap(({ corners_m }) => corners_m).map(along)) : null;
}

/** Draws a tube that is a mesh; null where its triangles are not there. @param {Schemas["MeshesResult"] | null} of @param {number} index @param {Look} look @param {Frame} frame */
export function tube(of, index, [across, up], frame) {
  const mesh = tubeOf(of, index);
  if (!of || !mesh) return null;
  const seen = (/** @type {string} */ wanted) =>
    once(of, `tube ${index} ${wanted} ${across} ${up}`, () => {
      const parts = mesh.parts.filter(({ role }) => role === wanted);
      return path(
        parts.flatMap(({ corners_m, triangles }) =>
          triangles.map((triangle) => {
            const [a = [0, 0], b = [0, 0], c = [0, 0]] = triangle.map((k) => /** @type {Point} */ ([corners_m[k]?.[across] ?? 0, corners_m[k]?.[up] ?? 0]));
            // all turn alike, so that what lies over another triangle is no hole
            return (b[0] - a[0]) * (c[1] - a[1]) < (b[1] - a[1]) * (c[0] - a[0]) ? [a, c, b] : [a, b, c];
          }),
        ),
      );
    });
  // the edges of the whole are seen around what covers those of the triangles
  return svg`<g class="models" transform=${turned(frame)}>${["pipe", "collector"].map(
    (role) => svg`<path class=${`${role} edge`} d=${seen(role)}></path><path class=${role} d=${seen(role)}></path>`,
  )}</g>`;
}
