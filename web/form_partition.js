// The form of the partitions of a room: drawn on the plan, or by numbers.
import { roomiest } from "./draft.js";
import { addPartition, removePartition } from "./draft_partition.js";
import { number } from "./field.js";
import { edit } from "./live.js";
import { clearance } from "./outline.js";
import { rings } from "./room.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** Share of the distance to the nearest wall to which a new partition reaches from its middle. */
const REACH = 0.75;

/** Adds a partition where the room has most space. */
function add() {
  const { room } = state.draft;
  const [x, y] = roomiest(room, []);
  const reach = REACH * clearance(rings(room), [x, y]);
  edit((draft) => set({ partition: addPartition(draft, [x - reach, y], [x + reach, y]) }));
}

/** The partitions: which one, and its numbers. */
export function partitions() {
  const of = state.draft.room.partitions ?? [];
  const chosen = state.partition === null ? undefined : of[state.partition];
  const tabs = of.map(
    (_, at) => html`<button type="button" aria-label=${`Partition ${at + 1}`} aria-pressed=${at === state.partition}
      @click=${() => set({ partition: at })}>${at + 1}</button>`,
  );
  return html`<h3>Partitions</h3><div class="group tabs" role="group" aria-label="Partitions">${tabs}<button type="button"
      aria-pressed=${state.draws} title="Drag from one end to the other on the plan"
      @click=${() => set({ draws: !state.draws })}>Draw one</button><button type="button" @click=${add}>Add one</button></div>
    ${chosen && state.partition !== null ? numbers(chosen, state.partition) : nothing}`;
}

/** @param {Schemas["PartitionDocument"]} partition @param {number} index */
function numbers({ from_m, to_m, height_m, surface }, index) {
  const at = `/room/partitions/${index}`;
  const change = (/** @type {(partition: Schemas["PartitionDocument"]) => void} */ change) =>
    edit(({ room }) => room.partitions?.[index] && change(room.partitions[index]));
  const metres = (/** @type {string} */ name, /** @type {string} */ label, /** @type {number} */ value, /** @type {(to: number) => (partition: Schemas["PartitionDocument"]) => void} */ to) =>
    number({ pointer: `${at}/${name}`, label, unit: "m", value, step: 0.05, set: (metres) => change(to(metres)) });
  const remove = () => {
    edit((draft) => removePartition(draft, index));
    set({ partition: null });
  };
  const { reflectance } = surface;
  return html`<div class="card"><div class="head"><h3>Partition ${index + 1}</h3><button type="button"
      aria-label=${`Remove partition ${index + 1}`} @click=${remove}>Remove</button></div>
    <div class="pair">
      ${metres("from_m/0", "From x", from_m[0], (to) => (it) => (it.from_m[0] = to))}
      ${metres("from_m/1", "From y", from_m[1], (to) => (it) => (it.from_m[1] = to))}
      ${metres("to_m/0", "To x", to_m[0], (to) => (it) => (it.to_m[0] = to))}
      ${metres("to_m/1", "To y", to_m[1], (to) => (it) => (it.to_m[1] = to))}
      ${metres("height_m", "Height of it", height_m, (to) => (it) => (it.height_m = to))}
      ${
        typeof reflectance === "number"
          ? number({
              pointer: `${at}/surface/reflectance`,
              label: "Reflects",
              value: reflectance,
              step: 0.05,
              min: 0,
              max: 1,
              set: (to) => change((it) => (it.surface.reflectance = to)),
            })
          : nothing
      }
    </div></div>`;
}
