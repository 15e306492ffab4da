// The partitions on the plan: lines with ends that are moved by hand or by keys.
import { across, down } from "./map.js";
import { keys, partitionDrag, still } from "./plan_hand.js";
import { partitionLine } from "./room_plan.js";
import { set, state } from "./state.js";
import { svg } from "./vendor/lit-html.js";

/** @typedef {import("./draft_partition.js").End} End */

/** @param {Schemas["PartitionDocument"]} partition @param {number} index @param {import("./map.js").Layout} at */
export function partition(partition, index, at) {
  const [[ax, ay], [bx, by]] = [partition.from_m, partition.to_m];
  const [x1, y1, x2, y2] = [across(at, ax), down(at, ay), across(at, bx), down(at, by)];
  const line = (/** @type {string} */ name) => partitionLine(partition, at, name);
  const end = (/** @type {End} */ name, /** @type {number} */ x, /** @type {number} */ y) => {
    const [metresX, metresY] = partition[name];
    return svg`<g class="corner" tabindex="0" role="button" aria-label=${`${name === "from_m" ? "Begin" : "End"} of partition ${index + 1} at ${metresX} m, ${metresY} m`}
      @touchstart=${still} @focus=${() => set({ partition: index })}
      @pointerdown=${(/** @type {PointerEvent} */ event) => partitionDrag(event, index, name, at)}
      @keydown=${(/** @type {KeyboardEvent} */ event) => keys(event, { partition: index, end: name })}>
      <circle class="hold" cx=${x} cy=${y} r="13"></circle><circle class="seen" cx=${x} cy=${y} r="4.5"></circle></g>`;
  };
  return svg`<g class=${`partition ${state.partition === index ? "chosen" : ""}`}><g @touchstart=${still}
    @pointerdown=${(/** @type {PointerEvent} */ event) => partitionDrag(event, index, null, at)}>${line("hold")}${line("seen")}</g>
    ${end("from_m", x1, y1)}${end("to_m", x2, y2)}</g>`;
}
