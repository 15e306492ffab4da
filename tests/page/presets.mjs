// Writes web/presets: rooms with their results, which the page opens with. Usage: presets.mjs URL of a service
import { writeFileSync } from "node:fs";
import { changed, complete } from "../../web/draft.js";

const [, , url] = process.argv;

const tube = (x, y, diameter, length, more = {}) => ({
  centre_m: [x, y],
  diameter_m: diameter,
  reflectance: 0.98,
  segments: [{ length_m: length }],
  collector: { kind: "dome", transmittance: 0.92 },
  diffuser: { kind: "lambertian", transmittance: 0.6 },
  ...more,
});
const room = (name, size, reflectances, tubes, more) => ({
  name,
  location: { latitude_deg: 55.68, longitude_deg: 12.57 },
  time: "2026-03-21T12:00:00+01:00",
  sky: { cie_type: 12 },
  room: {
    size_m: size,
    surfaces: Object.fromEntries(["floor", "walls", "ceiling"].map((it, i) => [it, { reflectance: reflectances[i] }])),
  },
  tubes,
  grids: [{ name: "workplane", height_m: 0.85, cells: [8, 8] }],
  stop: { relative_error: 0.01 },
  ...more,
});

const rooms = {
  bathroom: room("Bathroom", [4, 6, 2.7], [0.3, 0.6, 0.8], [tube(2, 1.5, 0.35, 1.2), tube(2, 4.5, 0.35, 1.2)]),
  corridor: room(
    "Corridor",
    [1.8, 9, 2.5],
    [0.2, 0.6, 0.8],
    [1.1, 3.4, 5.6, 7.9].map((y) => tube(0.9, y, 0.25, 0.8)),
    { sky: { cie_type: 1 } },
  ),
  office: room(
    "Office",
    [7.5, 5, 2.8],
    [0.3, 0.5, 0.8],
    [1.25, 3.75, 6.25].flatMap((x) => [1.4, 3.6].map((y) => tube(x, y, 0.53, 1.0))),
    { location: { latitude_deg: 48.15, longitude_deg: 17.11 }, time: "2026-06-21T10:00:00+02:00", sky: { cie_type: 7 } },
  ),
  attic: room(
    "Room under a steep roof",
    [3.5, 4.5, 2.4],
    [0.2, 0.5, 0.7],
    [tube(1.75, 2.25, 0.35, 0, { segments: [{ length_m: 0.5 }, { length_m: 1.1, tilt_deg: 35, azimuth_deg: 180 }] })],
  ),
  thesis: room("Test room", [2.032, 2.032, 2.032], [0.2, 0.5, 0.7], [tube(1.016, 1.016, 0.254, 1.0)], {
    location: { latitude_deg: 55.77, longitude_deg: 12.5 },
    time: "2011-09-15T15:00:00+02:00",
  }),
};

/** Fields of a finished job that the page shows. */
const KEPT = [
  "id",
  "name",
  "status",
  "stopped_by",
  "document",
  "plan",
  "progress",
  "accuracy",
  "provenance",
  "tubes",
  "warnings",
  "render_warnings",
  "links",
];

/** Six digits are more than a result knows. */
const short = (_, value) => (typeof value === "number" && !Number.isInteger(value) ? Number(value.toPrecision(6)) : value);

for (const [name, document] of Object.entries(rooms)) {
  // cells of the size that the page gives them
  const draft = complete(
    changed({ ...document, room: { ...document.room, size_m: [0, 0, 0] } }, (next) => (next.room.size_m = document.room.size_m)),
  );
  const body = JSON.stringify({ ...draft, stop: { relative_error: 0.003, max_seconds: 50 } });
  const answer = await fetch(`${url}/v1/jobs`, {
    method: "POST",
    headers: { "Content-Type": "application/json", Prefer: "wait=58" },
    body,
  });
  const { grid_results, ...job } = await answer.json();
  if (!grid_results) throw new Error(`${name}: ${JSON.stringify(job)}`);
  const kept = Object.fromEntries(KEPT.map((field) => [field, job[field]]));
  writeFileSync(
    new URL(`../../web/presets/${name}.json`, import.meta.url),
    `${JSON.stringify({ draft, job: kept, grid: grid_results.workplane }, short)}\n`,
  );
  console.log(name, grid_results.workplane.statistics.mean_lux.toFixed(1), "lx", job.progress.relative_error);
}
