// The tubes: kinds, sizes, closures; models in OBJ files.
import * as api from "./api.js";
import { lieOf, moveTube, removeTube, roomiest, setDrop, setLie } from "./draft.js";
import { choice, file, number, slider } from "./field.js";
import { edit } from "./live.js";
import { add } from "./plan_hand.js";
import { extent, steepness } from "./room.js";
import { set, state } from "./state.js";
import { diameter, isMesh, square, usualTube } from "./tube.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @typedef {ParametricTube["collector"]} Collector */
/** @typedef {ParametricTube["diffuser"]} Diffuser */

/** Usual optics by kind. @type {Record<Exclude<Collector["kind"], never>, Collector>} */
const COLLECTORS = {
  dome: { kind: "dome", transmittance: 0.92 },
  dielectric_dome: { kind: "dielectric_dome", refractive_index: 1.49, thickness_m: 0.003 },
  flat: { kind: "flat", transmittance: 0.92 },
  open: { kind: "open" },
};
/** @type {[Collector["kind"], string][]} */
const COLLECTOR_WORDS = [
  ["dome", "clear dome"],
  ["dielectric_dome", "acrylic dome, refracting"],
  ["flat", "flat glass"],
  ["open", "open"],
];
/** @type {[Diffuser["kind"], string][]} */
const DIFFUSER_WORDS = [
  ["lambertian", "opal"],
  ["clear", "clear"],
  ["mixed", "opal with a clear ring"],
  ["open", "open"],
];

/** Side of a square diffuser to begin with, as panels of suspended ceilings have it. */
const SIDE_M = 0.6;

/** @type {[import("./draft.js").Lie, string][]} */
const LIES = [
  ["level", "level, in the ceiling"],
  ["slope", "in the plane of the slope"],
  ["wall", "in the nearest wall"],
];

/** @param {Diffuser["kind"]} kind @param {number} diameter @returns {Diffuser} */
function usualDiffuser(kind, diameter) {
  if (kind === "clear") return { kind, transmittance: 0.9 };
  if (kind === "open") return { kind };
  if (kind === "mixed")
    return {
      kind,
      lambertian_radius_m: Math.round(350 * diameter) / 1000,
      inner: "lambertian",
      lambertian_transmittance: 0.6,
      clear_transmittance: 0.9,
    };
  return { kind: "lambertian", transmittance: 0.6 };
}

/** Usual pieces of a tube; outside a wall the pipe turns up. @param {"straight" | "bent"} kind @param {Tube} tube @returns {ParametricTube["segments"]} */
function usualSegments(kind, tube) {
  const { segments } = usualTube(kind, [0, 0]);
  return lieOf(state.draft.room, tube) === "wall" ? segments.map(({ length_m }) => ({ length_m })) : segments;
}

/** The part of the form about tubes: which one, and its numbers. */
export function tubes() {
  const of = state.draft.tubes ?? [];
  const index = Math.min(state.tube, of.length - 1);
  const tube = of[index];
  const tabs = of.map(
    (_, at) => html`<button type="button" aria-label=${`Tube ${at + 1}`} aria-pressed=${at === index}
      @click=${() => set({ tube: at })}>${at + 1}</button>`,
  );
  const together = html`<label class="check"><input type="checkbox" .checked=${state.together}
    @change=${() => set({ together: !state.together })}> Change all tubes together</label>`;
  const form = (/** @type {Tube} */ tube) => html`<div class="card">
    <div class="head"><h3>Tube ${index + 1} <small>${words(tube)}</small></h3><button type="button" aria-label=${`Remove tube ${index + 1}`}
      @click=${() => edit((draft) => removeTube(draft, index))}>Remove</button></div>
    ${place(tube, index)}${isMesh(tube) ? mesh(tube, index) : pipe(tube, index)}</div>`;
  return html`<div class="group tabs" role="group" aria-label="Tubes">${tabs}<button type="button" @click=${add}>Add a tube</button></div>
    ${tube ? form(tube) : nothing}${of.length > 1 ? together : nothing}${file({ accept: ".obj,model/obj", label: "Model of a tube: drop an OBJ file here, or choose one", take: (it) => void take(it) })}`;
}

/** @param {Tube} tube */
const words = (tube) =>
  isMesh(tube)
    ? "model"
    : `${tube.diameter_m} × ${Number(tube.segments.reduce((sum, { length_m }) => sum + length_m, 0).toFixed(2))} m`;

/** Changes a tube of pipes. @param {number} index @param {(tube: ParametricTube) => void} change */
const change = (index, change) =>
  edit((draft) => {
    for (const [at, tube] of (draft.tubes ?? []).entries()) {
      if ((state.together || at === index) && !isMesh(tube)) change(tube);
    }
  });

/** @param {ParametricTube} tube @param {number} index */
function pipe(tube, index) {
  const at = `/tubes/${index}`;
  const bent = tube.segments.length > 1;
  const lengths = tube.segments.map((segment, piece) =>
    slider({
      pointer: `${at}/segments/${piece}/length_m`,
      label: bent ? (piece ? "Above the bend" : "Below the bend") : "Length",
      value: segment.length_m,
      unit: "m",
      step: 0.05,
      min: 0.1,
      max: 6,
      set: (to) => change(index, ({ segments }) => segments[piece] && (segments[piece].length_m = to)),
    }),
  );
  const lean = (/** @type {number} */ piece, /** @type {Partial<ParametricTube["segments"][number]>} */ to) =>
    change(index, ({ segments }) => Object.assign(segments[piece] ?? {}, to));
  const leans = tube.segments.slice(1).map(
    (segment, piece) => html`<div class="pair">
    ${number({
      pointer: `${at}/segments/${piece + 1}/tilt_deg`,
      label: "Leans by",
      unit: "°",
      value: segment.tilt_deg ?? 0,
      step: 5,
      min: 0,
      max: 135,
      set: (to) => lean(piece + 1, { tilt_deg: to }),
    })}
    ${number({
      pointer: `${at}/segments/${piece + 1}/azimuth_deg`,
      label: "Toward",
      unit: "°",
      value: segment.azimuth_deg ?? 0,
      step: 15,
      min: -360,
      max: 360,
      set: (to) => lean(piece + 1, { azimuth_deg: to }),
    })}</div>`,
  );
  return html`
    <div class="pair">
    ${choice({
      pointer: `${at}/segments`,
      label: "Kind",
      value: bent ? "bent" : "straight",
      options: [
        ["straight", "straight"],
        ["bent", "bent"],
      ],
      set: (kind) => change(index, (next) => (next.segments = usualSegments(kind, next))),
    })}
    ${mirror(tube, index)}</div>
    ${slider({
      pointer: `${at}/diameter_m`,
      label: "Diameter",
      value: tube.diameter_m,
      unit: "m",
      step: 0.01,
      min: 0.1,
      max: 1,
      set: (to) => change(index, (next) => (next.diameter_m = to)),
    })}
    ${lengths}${leans}
    <div class="pair">
      ${choice({
        pointer: `${at}/collector`,
        label: "Collector",
        value: tube.collector.kind,
        options: COLLECTOR_WORDS,
        set: (kind) => change(index, (next) => (next.collector = structuredClone(COLLECTORS[kind]))),
      })}
      ${choice({
        pointer: `${at}/diffuser`,
        label: "Diffuser",
        value: tube.diffuser.kind,
        options: tube.diffuser.kind === "measured" ? [...DIFFUSER_WORDS, ["measured", "measured table"]] : DIFFUSER_WORDS,
        set: (kind) =>
          kind !== "measured" &&
          change(index, (next) => {
            next.diffuser = usualDiffuser(kind, next.diameter_m);
            if (kind !== "lambertian") delete next.closure_shape;
          }),
      })}
      ${share(`${at}/collector/transmittance`, "passes", tube.collector, (to) => change(index, (next) => "transmittance" in next.collector && (next.collector.transmittance = to)))}
      ${share(`${at}/diffuser/transmittance`, "passes", tube.diffuser, (to) => change(index, (next) => "transmittance" in next.diffuser && (next.diffuser.transmittance = to)))}
      ${tube.diffuser.kind === "lambertian" ? outlines(tube, index) : nothing}
    </div>`;
}

/** Outline of an opal diffuser: that of its pipe, or a square as suspended ceilings have them. @param {ParametricTube} tube @param {number} index */
function outlines(tube, index) {
  const side = square(tube)?.side_m;
  /** @type {["round" | "square", string][]} */
  const shapes = [
    ["round", "round"],
    ["square", "square"],
  ];
  const reshape = (/** @type {"round" | "square"} */ to) =>
    change(index, (next) => {
      if (to === "round") delete next.closure_shape;
      else next.closure_shape = { kind: "square", side_m: Math.max(SIDE_M, next.diameter_m) };
    });
  const resize = (/** @type {number} */ to) => change(index, ({ closure_shape }) => closure_shape && (closure_shape.side_m = to));
  return html`${choice({ pointer: `/tubes/${index}/closure_shape`, label: "Diffuser is", value: side ? "square" : "round", options: shapes, set: reshape })}
    ${side ? number({ pointer: `/tubes/${index}/closure_shape/side_m`, label: "Side", unit: "m", value: side, step: 0.05, min: 0.05, set: resize }) : nothing}`;
}

/** Where a tube is, how its opening lies, and how far it hangs below the ceiling. @param {Tube} tube @param {number} index */
function place(tube, index) {
  const metres = (/** @type {string} */ name, /** @type {string} */ label, /** @type {number} */ value, /** @type {(to: number) => void} */ set) =>
    number({ pointer: `/tubes/${index}/${name}`, label, unit: "m", value, step: 0.05, set });
  const move = (/** @type {0 | 1} */ axis) => (/** @type {number} */ to) =>
    edit((draft) => draft.tubes?.[index] && (draft.tubes[index].centre_m[axis] = to));
  const { room } = state.draft;
  const lie = lieOf(room, tube);
  const all = (/** @type {(tube: Tube) => void} */ change) =>
    edit((draft) => draft.tubes?.forEach((other, at) => (state.together || at === index) && change(other)));
  const [x, y, z = 0] = tube.centre_m;
  const along = (/** @type {[number, number]} */ place) => edit((draft) => moveTube(draft, index, ...place));
  const raise = (/** @type {number} */ to) => edit((draft) => draft.tubes?.[index] && (draft.tubes[index].centre_m[2] = to));
  const third = {
    level: () => metres("drop_m", "Drop", tube.drop_m ?? 0, (to) => all((other) => setDrop(other, to))),
    slope: () => nothing,
    wall: () => metres("centre_m/2", "Height", z, raise),
  };
  return html`<div class="triple">
    ${metres("centre_m/0", "x", x, lie === "wall" ? (to) => along([to, y]) : move(0))}
    ${metres("centre_m/1", "y", y, lie === "wall" ? (to) => along([x, to]) : move(1))}
    ${third[lie]()}</div>
    ${choice({
      pointer: `/tubes/${index}/normal`,
      label: "Opening lies",
      value: lie,
      options: LIES.filter(([of]) => of !== "slope" || steepness(room) > 0),
      set: (to) => all((other) => setLie(room, other, to)),
    })}`;
}

/** @param {string} pointer @param {string} label @param {Collector | Diffuser} closure @param {(to: number) => void} set */
function share(pointer, label, closure, set) {
  const what = pointer.includes("collector") ? "Collector" : "Diffuser";
  if (!("transmittance" in closure) || typeof closure.transmittance !== "number") return html`<span></span>`;
  return number({ pointer, label: `${what} ${label}`, value: closure.transmittance, step: 0.01, min: 0, max: 1, set });
}

/** @param {ParametricTube} tube @param {number} index */
function mirror({ reflectance }, index) {
  if (typeof reflectance !== "number") return html`<p class="note">The mirror is a table in the document.</p>`;
  const set = (/** @type {number} */ to) => change(index, (next) => (next.reflectance = to));
  return number({
    pointer: `/tubes/${index}/reflectance`,
    label: "Mirror reflects",
    value: reflectance,
    step: 0.005,
    min: 0,
    max: 1,
    set,
  });
}

/** @param {MeshTube} tube @param {number} index */
function mesh(tube, index) {
  const at = `/tubes/${index}`;
  /** @param {(tube: MeshTube) => void} change */
  const alter = (change) =>
    edit((draft) => {
      const next = draft.tubes?.[index];
      if (next && isMesh(next)) change(next);
    });
  return html`<p class="note">A model with ${Object.keys(tube.parts).length} materials.</p>
    <div class="pair">
      ${choice({
        pointer: `${at}/unit`,
        label: "Unit of the model",
        value: tube.unit,
        options: [
          ["m", "metres"],
          ["cm", "centimetres"],
          ["mm", "millimetres"],
          ["in", "inches"],
          ["ft", "feet"],
        ],
        set: (unit) => alter((next) => (next.unit = unit)),
      })}
      ${number({
        pointer: `${at}/opening_diameter_m`,
        label: "Opening",
        unit: "m",
        value: tube.opening_diameter_m,
        step: 0.001,
        min: 0.01,
        set: (to) => alter((next) => (next.opening_diameter_m = to)),
      })}
    </div>
    ${Object.entries(tube.parts).map(([name, part]) =>
      choice({
        pointer: `${at}/parts/${name}`,
        label: name || "(no material)",
        value: part.role,
        options: [
          ["collector", "collector"],
          ["pipe", "mirror pipe"],
          ["diffuser", "diffuser"],
        ],
        set: (role) => alter((next) => (next.parts[name] = usualPart(role))),
      }),
    )}`;
}

/** @param {"collector" | "pipe" | "diffuser"} role @returns {MeshTube["parts"][string]} */
function usualPart(role) {
  if (role === "collector") return { role, transmittance: 0.92 };
  if (role === "pipe") return { role, reflectance: 0.98 };
  return { role: "diffuser", kind: "lambertian", transmittance: 0.6 };
}

/** What a material is, by its name. @param {string} name */
const guessed = (name) =>
  usualPart(/dome|cover|collector|glass|lens/i.test(name) ? "collector" : /diffus|opal/i.test(name) ? "diffuser" : "pipe");

/** Takes a model for a new tube in the middle of the room. @param {File} file */
async function take(file) {
  try {
    const { id, materials, triangles } = await api.postMesh(file);
    const last = state.draft.tubes?.at(-1);
    const opening = last ? diameter(last) : 0.25;
    edit((draft) =>
      (draft.tubes ??= []).push({
        mesh: id,
        unit: "m",
        opening_diameter_m: opening,
        centre_m: draft.room.plan ? roomiest(draft.room, draft.tubes.map(({ centre_m }) => centre_m)) : [extent(draft.room).width / 2, extent(draft.room).depth / 2],
        parts: Object.fromEntries(materials.map((name) => [name, guessed(name)])),
      }),
    );
    set({ tube: (state.draft.tubes?.length ?? 1) - 1, said: `${file.name}: ${triangles} triangles. Check the unit, the opening and what each material is.` });
  } catch (error) {
    set({ problem: api.problemOf(error) });
  }
}
