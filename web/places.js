// Places of a document in words: what a pointer of the service points at, with entries of lists numbered from 1, as the page numbers them.

/** What an entry of a list is called. @type {Record<string, string>} */
const ENTRIES = {
  tubes: "tube",
  segments: "segment",
  grids: "grid",
  views: "view",
  objects: "object",
  luminaires: "luminaire",
  partitions: "partition",
  outline_m: "corner",
  holes_m: "hole",
  points_m: "point",
  obstructions: "obstruction",
};
/** What fields are called whose names say little. @type {Record<string, string>} */
const FIELDS = { centre_m: "place", from_m: "start", to_m: "end", closure_shape: "diffuser's shape", cie_type: "CIE type", plan: "", room: "" };
/** Units that names end with. */
const UNITS = [["_cd_m2", "cd/m²"], ["_deg", "°"], ["_lux", "lx"], ["_m", "m"]];

/** @param {string} name */
function fieldInWords(name) {
  const told = FIELDS[name];
  if (told !== undefined) return told;
  const [end = "", unit = ""] = UNITS.find(([end = ""]) => name.endsWith(end)) ?? [];
  return `${name.slice(0, name.length - end.length).replaceAll("_", " ")}${unit ? ` in ${unit}` : ""}`;
}

/** @param {string} pointer as RFC 6901 has it */
export function placeInWords(pointer) {
  const names = pointer.split("/").slice(1);
  const words = names.map((name, k) => {
    if (!/^\d+$/.test(name)) return ENTRIES[name] && /^\d+$/.test(names[k + 1] ?? "") ? "" : fieldInWords(name);
    const [before = "", number] = [names[k - 1], Number(name)];
    const list = ENTRIES[before];
    if (list) return `${list} ${number + 1}`;
    return (before.endsWith("_m") && ["x", "y", "z"][number]) || String(number + 1);
  });
  return words.filter((word) => word).join(", ") || pointer.slice(1);
}

/** A sentence with its pointers in words. @param {string} text */
export const placesInWords = (text) => text.replace(/(?<=^|[\s(])\/(?:room|tubes|grids|views|sky|surroundings)\b[\w/]*/g, placeInWords);
