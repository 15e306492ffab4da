// Faces and meshes in space as the files of a job have them: light on patches of faces, and triangles of models.
import { rising } from "./scale.js";

/** @typedef {import("./ray.js").Vector} Vector */
/** @typedef {import("./view3d_shapes.js").Polygon} Polygon */

/** Colour of a patch below an object, which has no value. */
const NO_VALUE = /** @type {Vector} */ ([232 / 255, 232 / 255, 232 / 255]);
/** Parts of meshed tubes. @type {Record<string, import("./view3d_shapes.js").Part>} */
const OF_TUBES = { pipe: "pipe", collector: "cover", diffuser: "closure" };

/** Encodes linear light (IEC 61966-2-1). @param {number} linear 0..1 */
const srgb = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);

/** Patches of faces in the colours of a scale from 0. @param {Schemas["SurfacesResult"]} surfaces @param {number} end of the scale in lux @returns {Polygon[]} */
export const patches = ({ faces }, end) =>
  faces.flatMap(({ patches }) =>
    patches.flatMap(({ polygons_m, illuminance_lux: lux = null }) => {
      const colour = lux === null ? NO_VALUE : /** @type {Vector} */ (rising(lux / end).map((channel) => channel / 255));
      return polygons_m.map((ring) => ({ part: /** @type {const} */ ("patch"), ring: /** @type {Vector[]} */ (ring), colour }));
    }),
  );

/** Triangles of a part of a mesh. @param {Schemas["MeshPartResult"]} part @returns {Polygon[]} */
function triangles({ role, reflectance, back_reflectance: back, corners_m, triangles }) {
  const corners = /** @type {Vector[]} */ (corners_m);
  const sided = (/** @type {boolean} */ turned) => triangles.map(([a = 0, b = 0, c = 0]) => (turned ? [a, c, b] : [a, b, c]).map((k) => corners[k] ?? [0, 0, 0]));
  const of = (/** @type {import("./view3d_shapes.js").Part} */ part, /** @type {number[] | null | undefined} */ colour, turned = false) =>
    sided(turned).map((ring) => ({ part, ring: /** @type {Vector[]} */ (ring), ...(colour ? { colour: /** @type {Vector} */ (colour.map(srgb)) } : {}) }));
  if (role !== "object") return of(OF_TUBES[role] ?? "pipe", null);
  return back ? [...of("front", reflectance), ...of("front", back, true)] : of("sheet", reflectance);
}

/** @type {WeakMap<Schemas["MeshesResult"], Polygon[]>} */
const known = new WeakMap();

/** Triangles of all meshes, made once. @param {Schemas["MeshesResult"]} of */
export function models(of) {
  const all = known.get(of) ?? of.meshes.flatMap(({ parts }) => parts.flatMap(triangles));
  known.set(of, all);
  return all;
}
