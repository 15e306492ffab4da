// Single sensors on the plan: discs with their numbers, and an arrow where a sensor faces; moved by hand or by keys.
import { across, down } from "./map.js";
import { keys, sensorDrag, still } from "./plan_hand.js";
import { faces } from "./sensor.js";
import { set, state } from "./state.js";
import { nothing, svg } from "./vendor/lit-html.js";

/** Radius of a disc, and length of its arrow, in units of the drawing. */
const RADIUS = 8;
const ARROW = 9;

/** @param {import("./sensor.js").Sensor} sensor @param {number} index @param {import("./map.js").Layout} at */
export function sensor(sensor, index, at) {
  const [x, y, , east, north, up] = sensor;
  const place = `translate(${across(at, x).toFixed(1)} ${down(at, y).toFixed(1)})`;
  const isLevel = Math.hypot(east, north) < 0.02 * Math.abs(up);
  const turned = (180 / Math.PI) * Math.atan2(east, north);
  return svg`<g class=${state.sensor === index ? "sensor chosen" : "sensor"} transform=${place} tabindex="0" role="button"
      aria-label=${`Sensor ${index + 1} at ${x} m, ${y} m, facing ${faces(sensor)}`} @touchstart=${still} @focus=${() => set({ sensor: index })}
      @pointerdown=${(/** @type {PointerEvent} */ event) => sensorDrag(event, index, at)}
      @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { sensor: index })}>
    <circle class="hold" r="15"></circle>
    ${isLevel ? nothing : svg`<path class="seen" transform=${`rotate(${turned.toFixed(1)})`} d=${`M-6 ${-RADIUS + 2}L0 ${-RADIUS - ARROW}L6 ${-RADIUS + 2}Z`}></path>`}
    <circle class="seen" r=${RADIUS}></circle><text y="4">${index + 1}</text></g>`;
}
