// Files of the job that is shown, which the page needs beside its first grid: light on faces and at sensors, and triangles of meshes.
import * as api from "./api.js";
import { set, state } from "./state.js";

/** A file of a job: what it depends on, the room for which it was computed, and what it says. @template T @typedef {{ of: string, room: string, value: T | null }} Held */
/** @type {{ surfaces: Held<Schemas["SurfacesResult"]>, meshes: Held<Schemas["MeshesResult"]>, sensors: Held<Grid> }} */
const held = {
  surfaces: { of: "", room: "", value: null },
  meshes: { of: "", room: "", value: null },
  sensors: { of: "", room: "", value: null },
};

/** What the faces of a room depend on. @param {JobDocument["room"]} room */
const faces = ({ size_m, plan, ceiling }) => JSON.stringify([size_m, plan, ceiling]);

/** Objects and tubes that are meshes. @param {JobDocument} draft */
const meshed = ({ room, tubes = [] }) => [...(room.objects ?? []), ...tubes].filter((one) => "mesh" in one);

/** Takes a file of the job that is shown; the one before stays until it is there. @param {"surfaces" | "meshes" | "sensors"} kind @param {string} depends what it depends on @param {string | null | undefined} link */
function follow(kind, depends, link) {
  const { current, answer, draft } = state;
  const path = current && !answer?.stored ? link : null;
  const before = held[kind];
  if (!path || before.of === depends) return;
  const now = Object.assign(before, { of: depends });
  const room = faces(draft.room);
  const isNewest = () => now.of === depends;
  api.get(path).then(
    (value) => isNewest() && (Object.assign(now, { room, value }), set()),
    // a job that another one has replaced is gone
    () => isNewest() && (now.of = ""),
  );
}

/** Light on the faces of a document's room after the passes that are done; null where there is none of this room. @param {JobDocument} draft */
export function surfaces(draft) {
  const { answer } = state;
  if (draft.surfaces) follow("surfaces", `${answer?.job.links.self} ${answer?.job.progress.passes}`, answer?.job.links.surfaces);
  return draft.surfaces && held.surfaces.room === faces(draft.room) ? held.surfaces.value : null;
}

/** What the meshes of a document depend on; empty where it has none. Drafts do not change. @type {WeakMap<JobDocument, string>} */
const known = new WeakMap();

/** @param {JobDocument} draft */
function dependsOf(draft) {
  const all = meshed(draft);
  const made = known.get(draft) ?? (all.length ? JSON.stringify([all, all.some((one) => "parts" in one) && faces(draft.room)]) : "");
  known.set(draft, made);
  return made;
}

/** Triangles of the meshes of a document; null where it has none, or as long as none are there. @param {JobDocument} draft */
export function meshes(draft) {
  const depends = dependsOf(draft);
  if (!depends) return null;
  follow("meshes", depends, state.answer?.job.links.meshes);
  return held.meshes.value;
}

/** The light at the single sensors of an answer; null where it has none, or as long as none is there. @param {Answer} answer @returns {Grid | null} */
export function sensorLight({ job, grid }) {
  const name = job.document.grids?.find(({ points_m }) => points_m)?.name;
  if (name === undefined || name === grid?.name) return name === undefined ? null : grid;
  const posted = /** @type {Partial<FinishedJob>} */ (job).grid_results?.[name];
  if (posted) return posted;
  follow("sensors", `${job.links.self} ${job.progress.passes}`, job.links.grids?.[name]);
  return held.sensors.value;
}
