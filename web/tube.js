// Tubes of a document: their kinds, and sizes that all of them have.

/** @param {Tube} tube @returns {tube is MeshTube} */
export const isMesh = (tube) => "mesh" in tube;
/** A closure that is a square, not the circle of its pipe. @param {Tube} tube */
export const square = (tube) => (isMesh(tube) ? undefined : (tube.closure_shape ?? undefined));
/** @param {Tube} tube */
export const diameter = (tube) => (isMesh(tube) ? tube.opening_diameter_m : tube.diameter_m);

/**
 * A usual tube of a kind: rigid, under a dome, over an opal diffuser.
 * @param {"straight" | "bent"} kind
 * @param {[number, number]} centre_m
 * @returns {ParametricTube}
 */
export function usualTube(kind, centre_m) {
  return {
    centre_m,
    diameter_m: 0.35,
    reflectance: 0.98,
    segments: kind === "straight" ? [{ length_m: 1.2 }] : [{ length_m: 0.6 }, { length_m: 0.9, tilt_deg: 30, azimuth_deg: 180 }],
    collector: { kind: "dome", transmittance: 0.92 },
    diffuser: { kind: "lambertian", transmittance: 0.6 },
  };
}
