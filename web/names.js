// The names of rooms: what a room to begin with, or a shape, gives it until somebody types another one.

/** Names that shapes give. @type {Record<import("./outline.js").Shape, string>} */
const OF_SHAPES = {
  rectangle: "Rectangular room",
  L: "L-shaped hall",
  U: "U-shaped hall",
  T: "T-shaped hall",
  free: "Room of free form",
};
/** Names of the rooms to begin with. */
const OF_PRESETS = ["Bathroom", "Corridor", "Office", "Room under a steep roof", "Test room"];
const given = new Set([...Object.values(OF_SHAPES), ...OF_PRESETS]);

/** Calls a room after its shape, unless somebody has given it a name. @param {JobDocument} draft @param {import("./outline.js").Shape} shape */
export function nameAfter(draft, shape) {
  if (!draft.name || given.has(draft.name)) draft.name = OF_SHAPES[shape];
}
