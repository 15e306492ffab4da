// Marks of single sensors: discs with their numbers, and an arrow where a sensor faces.
import { across, down } from "./map.js";
import { faces } from "./sensor.js";
import { nothing, svg } from "./vendor/lit-html.js";

/** Radius of a disc, and length of its arrow, in units of the drawing. */
const RADIUS = 8;
const ARROW = 9;

/** Where a sensor is drawn. @param {import("./sensor.js").Sensor} sensor @param {import("./map.js").Layout} at */
export const place = ([x, y], at) => `translate(${across(at, x).toFixed(1)} ${down(at, y).toFixed(1)})`;

/** The arrow, the disc and the number of a sensor. @param {import("./sensor.js").Sensor} sensor @param {number} index */
export function mark([, , , east, north, up], index) {
  const isLevel = Math.hypot(east, north) < 0.02 * Math.abs(up);
  const turned = (180 / Math.PI) * Math.atan2(east, north);
  return svg`${isLevel ? nothing : svg`<path class="seen" transform=${`rotate(${turned.toFixed(1)})`} d=${`M-6 ${-RADIUS + 2}L0 ${-RADIUS - ARROW}L6 ${-RADIUS + 2}Z`}></path>`}
    <circle class="seen" r=${RADIUS}></circle><text y="4">${index + 1}</text>`;
}

/** A sensor that is not moved. @param {import("./sensor.js").Sensor} sensor @param {number} index @param {import("./map.js").Layout} at */
export const stillSensor = (sensor, index, at) =>
  svg`<g class="sensor still" transform=${place(sensor, at)}><title>${`Sensor ${index + 1}, facing ${faces(sensor)}`}</title>${mark(sensor, index)}</g>`;
