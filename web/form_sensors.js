// The form of single sensors: which one, its place, and what it faces.
import { addSensor, removeSensor, turnSensor } from "./draft_sensors.js";
import { choice, number } from "./field.js";
import { edit } from "./live.js";
import { NAMED, angles, facing, sensorsOf } from "./sensor.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @type {[import("./sensor.js").Facing, string][]} */
const FACINGS = [
  ["up", "up (level)"],
  ["north", "north (vertical)"],
  ["east", "east (vertical)"],
  ["south", "south (vertical)"],
  ["west", "west (vertical)"],
  ["other", "another direction"],
];

/** True of a sensor whose direction is to be typed, though it has a name. */
let isTyped = false;

/** Adds a sensor, which the form shows. */
function add() {
  edit(addSensor);
  isTyped = false;
  set({ sensor: sensorsOf(state.draft).points.length - 1 });
}

/** The sensors: which one, and its numbers. */
export function sensors() {
  const { grid, points } = sensorsOf(state.draft);
  const chosen = state.sensor === null ? undefined : points[state.sensor];
  const tabs = points.map(
    (_, at) => html`<button type="button" aria-label=${`Sensor ${at + 1}`} aria-pressed=${at === state.sensor}
      @click=${() => ((isTyped = false), set({ sensor: at }))}>${at + 1}</button>`,
  );
  return html`<h3>Sensors beside the work plane</h3><div class="group tabs" role="group" aria-label="Sensors">${tabs}<button type="button"
      title="A single place, such as an eye: its illuminance on a plane that faces any direction" @click=${add}>Add a sensor</button></div>
    ${chosen && state.sensor !== null ? numbers(chosen, grid, state.sensor) : nothing}`;
}

/** @param {import("./sensor.js").Sensor} sensor @param {number} grid @param {number} index */
function numbers(sensor, grid, index) {
  const at = `/grids/${grid}/points_m/${index}`;
  const metres = (/** @type {0 | 1 | 2} */ axis, /** @type {string} */ label) =>
    number({
      pointer: `${at}/${axis}`,
      label,
      unit: "m",
      value: sensor[axis],
      step: 0.05,
      set: (to) => edit((draft) => sensorsOf(draft).points[index] && ((sensorsOf(draft).points[index] ?? sensor)[axis] = to)),
    });
  const turn = (/** @type {number} */ azimuth, /** @type {number} */ altitude) => edit((draft) => turnSensor(draft, index, azimuth, altitude));
  const [azimuth, altitude] = angles(sensor);
  const shown = isTyped ? "other" : facing(sensor);
  const degrees = (/** @type {3 | 5} */ part, /** @type {string} */ label, /** @type {number} */ value, /** @type {number} */ least, /** @type {number} */ most, /** @type {(to: number) => void} */ set) =>
    number({ pointer: `${at}/${part}`, label, unit: "°", value, step: 5, min: least, max: most, set });
  const remove = () => {
    edit((draft) => removeSensor(draft, index));
    set({ sensor: null });
  };
  return html`<div class="card"><div class="head"><h3>Sensor ${index + 1}</h3><button type="button"
      aria-label=${`Remove sensor ${index + 1}`} @click=${remove}>Remove</button></div>
    <div class="triple">${metres(0, "Sensor x")}${metres(1, "Sensor y")}${metres(2, "Sensor height")}</div>
    ${choice({
      pointer: `${at}/4`,
      label: "Faces (north is up on the plan)",
      value: shown,
      options: FACINGS,
      set: (to) => {
        isTyped = to === "other";
        if (to === "other") return set();
        turn(...NAMED[to]);
      },
    })}
    ${
      shown === "other"
        ? html`<div class="pair">${degrees(3, "Azimuth from north", azimuth, 0, 360, (to) => turn(to, altitude))}
      ${degrees(5, "Up from level", altitude, -90, 90, (to) => turn(azimuth, to))}</div>`
        : nothing
    }</div>`;
}
