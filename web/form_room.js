// The room: its size, its surfaces, its work plane.
import { number, words } from "./field.js";
import { partitions } from "./form_partition.js";
import { shapes } from "./form_plan.js";
import { sensors } from "./form_sensors.js";
import { edit } from "./live.js";
import { state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** What surfaces reflect where a document says nothing. */
const USUAL = /** @type {const} */ ({ floor: 0.2, walls: 0.5, ceiling: 0.7 });

/** The part of the form about the room. */
export function room() {
  const { draft } = state;
  const grid = draft.grids?.[0];
  const { objects, luminaires, plan } = draft.room;
  const also = [
    ...(objects?.length || luminaires?.length ? [`${objects?.length ?? 0} objects`, `${luminaires?.length ?? 0} luminaires`] : []),
    ...(plan?.holes_m?.length ? [`${plan.holes_m.length} columns`] : []),
  ];
  const reflectance = (/** @type {keyof typeof USUAL} */ name) => {
    const value = draft.room.surfaces?.[name] ? draft.room.surfaces[name].reflectance : USUAL[name];
    const pointer = `/room/surfaces/${name}/reflectance`;
    if (typeof value !== "number")
      return html`<p class="note">${name}: ${value === null || value === undefined ? "open" : `in colours (${value.join(", ")})`}</p>`;
    const set = (/** @type {number} */ to) =>
      edit((next) => {
        const surfaces = (next.room.surfaces ??= {});
        surfaces[name] = { ...surfaces[name], reflectance: to };
      });
    return number({ pointer, label: name[0]?.toUpperCase() + name.slice(1), value, step: 0.05, min: 0, max: 1, set });
  };
  const raise = (/** @type {number} */ to) => edit((next) => next.grids?.[0] && (next.grids[0].height_m = to));
  return html`
    ${words({ pointer: "/name", label: "Name", value: draft.name ?? "", set: (to) => edit((next) => (next.name = to)) })}
    ${shapes()}
    <h3>Reflectances</h3>
    <div class="triple">${reflectance("floor")}${reflectance("walls")}${reflectance("ceiling")}</div>
    <div class="pair">
      ${
        grid
          ? number({
              pointer: "/grids/0/height_m",
              label: "Work plane",
              unit: "m",
              value: grid.height_m,
              step: 0.05,
              min: 0,
              set: raise,
            })
          : nothing
      }
      ${number({
        pointer: "/room/rotation_deg",
        label: "Turned by",
        unit: "°",
        value: draft.room.rotation_deg ?? 0,
        step: 5,
        min: -360,
        max: 360,
        set: (to) => edit((next) => (next.room.rotation_deg = to)),
      })}
    </div>
    ${partitions()}${sensors()}
    ${
      also.length
        ? html`<p
      class="note">The room also has ${also.join(" and ")}, which the document describes.</p>`
        : nothing
    }`;
}
