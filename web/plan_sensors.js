// Single sensors on the plan, which are moved by hand or by keys.
import { keys, sensorDrag, still } from "./plan_hand.js";
import { faces } from "./sensor.js";
import { mark, place } from "./sensor_marks.js";
import { set, state } from "./state.js";
import { svg } from "./vendor/lit-html.js";

/** @param {import("./sensor.js").Sensor} sensor @param {number} index @param {import("./map.js").Layout} at */
export function sensor(sensor, index, at) {
  const [x, y] = sensor;
  return svg`<g class=${state.sensor === index ? "sensor chosen" : "sensor"} transform=${place(sensor, at)} tabindex="0" role="button"
      aria-label=${`Sensor ${index + 1} at ${x} m, ${y} m, facing ${faces(sensor)}`} @touchstart=${still} @focus=${() => set({ sensor: index })}
      @pointerdown=${(/** @type {PointerEvent} */ event) => sensorDrag(event, index, at)}
      @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { sensor: index })}>
    <circle class="hold" r="15"></circle>
    ${mark(sensor, index)}</g>`;
}
