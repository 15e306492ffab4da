// What stands around the building: the horizon and the ground.
import { choice, lines, number, slider } from "./field.js";
import { altitudeAt, evenAltitude, parsed, pointsOf, written } from "./horizon.js";
import { obstructions } from "./form_obstructions.js";
import { edit } from "./live.js";
import { set, state } from "./state.js";
import { html, nothing, svg } from "./vendor/lit-html.js";

/** @typedef {"open" | "even" | "points"} Kind */
/** @typedef {NonNullable<JobDocument["surroundings"]>} Surroundings */

/** Altitude of a horizon to begin with, and reflectance of the ground where a document with surroundings, or with a tube's own horizon, does not say. */
const USUAL = { altitude_deg: 15, ground: 0.2 };

/** Changes the surroundings; none are left where nothing is around. @param {(surroundings: Surroundings) => void} change */
const around = (change) =>
  edit((draft) => {
    const next = (draft.surroundings ??= {});
    change(next);
    if (!Object.keys(next).length) delete draft.surroundings;
  });

/** @param {import("./horizon.js").Horizon | null} horizon */
const setHorizon = (horizon) =>
  around((next) => {
    delete next.horizon;
    delete next.horizon_pvgis;
    Object.assign(next, horizon);
  });

/** Points of a horizon that were typed and cannot be read, and the text of the horizon in whose place they were typed. @type {{ text: string, before: string } | null} */
let refused = null;
const UNREAD = "This was not read, and the horizon is as it was. Write azimuths and heights as 90: 12, a line for each, with decimal points; or paste what PVGIS prints.";

/** True of a horizon that is even, but is to be given by points. */
let byPoints = false;
/** True once the part of the form has something to show. */
let used = false;

/** Tubes with a horizon of their own. */
const ownHorizons = () => (state.draft.tubes ?? []).filter(({ horizon }) => horizon).length;

/** True of a document with surroundings or a horizon, and from then on. */
export const isUsed = () => (used ||= Boolean(state.draft.surroundings) || ownHorizons() > 0);

/** The part of the form about what is around. */
export function outside() {
  const { surroundings } = state.draft;
  const points = pointsOf(surroundings);
  const even = evenAltitude(points);
  const kind = /** @type {Kind} */ (!points.length ? "open" : even === null || byPoints ? "points" : "even");
  const take = (/** @type {Kind} */ to) => {
    byPoints = to === "points";
    refused = null;
    if (to === "open") return setHorizon(null);
    const highest = Math.max(0, ...points.map(([, altitude]) => altitude)) || USUAL.altitude_deg;
    setHorizon({ horizon: to === "even" ? [[0, highest]] : [0, 90, 180, 270].map((azimuth) => [azimuth, Math.round(10 * (points.length ? altitudeAt(points, azimuth) : highest)) / 10]) });
  };
  const fromSouth = Boolean(surroundings?.horizon_pvgis);
  const paste = (/** @type {string} */ text) => {
    const horizon = parsed(text, fromSouth);
    refused = horizon ? null : { text, before };
    if (horizon) setHorizon(horizon);
    else set({ said: "The horizon was not read." });
  };
  const pointer = fromSouth ? "/surroundings/horizon_pvgis" : "/surroundings/horizon";
  const typed = /** @type {import("./horizon.js").Point[]} */ (surroundings?.horizon_pvgis ?? surroundings?.horizon ?? []);
  const before = `${pointer}\n${written(typed)}`;
  const unread = refused?.before === before ? refused.text : null;
  const own = ownHorizons();
  const ground = surroundings?.ground_reflectance ?? (surroundings || own ? USUAL.ground : 0);
  const more = [
    own ? `${own === 1 ? "One tube has" : `${own} tubes have`} a horizon of ${own === 1 ? "its" : "their"} own in the document, in place of this one.` : "",
  ];
  return html`
    ${choice({
      pointer,
      id: "horizon-kind",
      label: "Horizon",
      value: kind,
      options: [["open", "open sky"], ["even", "one height all around"], ["points", "heights by azimuth"]],
      set: take,
    })}
    ${
      kind === "even"
        ? slider({ pointer, label: "Height of the horizon", unit: "°", value: even ?? 0, step: 1, min: 0, max: 90, set: (to) => setHorizon({ horizon: [[0, to]] }) })
        : nothing
    }
    ${
      kind === "points"
        ? lines({
            pointer,
            label: `Azimuth from ${fromSouth ? "south" : "north"}: height, °; or a horizon of PVGIS`,
            value: unread ?? written(typed),
            fault: unread === null ? "" : UNREAD,
            set: paste,
          })
        : nothing
    }
    ${points.length ? diagram(points) : nothing}
    ${number({
      pointer: "/surroundings/ground_reflectance",
      label: "Ground reflects",
      value: ground,
      step: 0.05,
      min: 0,
      max: 1,
      set: (to) => around((next) => (next.ground_reflectance = to)),
    })}
    <p class="note">Tilted panes, leaning tubes and dielectric domes see the ground. With a horizon it reflects ${USUAL.ground} unless it is given; without, nothing.
      ${more.filter(Boolean).join(" ")}</p>
    ${obstructions()}`;
}

/** Size of the diagram, and the space for its letters. */
const SIZE = { width: 300, height: 84, below: 15 };
/** Least altitude of its upper end. */
const LEAST_TOP_DEG = 45;

/** The horizon from north over east, south and west to north, and where the sun stands. @param {import("./horizon.js").Point[]} points */
function diagram(points) {
  const sun = state.current ? state.answer?.job.provenance?.sun : null;
  const [azimuth, altitude] = [Number(sun?.azimuth_deg), Number(sun?.altitude_deg)];
  const out = altitude > 0;
  const top = Math.min(90, Math.max(LEAST_TOP_DEG, ...points.map(([, high]) => high + 10), out ? altitude + 8 : 0));
  const bottom = SIZE.height - SIZE.below;
  const x = (/** @type {number} */ degrees) => 1 + ((SIZE.width - 2) * degrees) / 360;
  const y = (/** @type {number} */ degrees) => bottom - (bottom * degrees) / top;
  const ends = [0, 360].map((azimuth) => /** @type {const} */ ([azimuth, altitudeAt(points, azimuth)]));
  const line = [ends[0], ...points.filter(([azimuth]) => azimuth > 0 && azimuth < 360), ends[1]].map(([azimuth = 0, high = 0] = [0, 0]) => `L${x(azimuth).toFixed(1)} ${y(high).toFixed(1)}`);
  const hidden = out && altitudeAt(points, azimuth) > altitude;
  const words = out ? `; the sun is ${hidden ? "behind it" : "above it"}` : "";
  return svg`<svg class="horizon" viewBox=${`0 0 ${SIZE.width} ${SIZE.height}`} role="img" aria-label=${`Horizon from north over south to north${words}`}>
    <rect class="air" width=${SIZE.width} height=${bottom}></rect>
    ${out ? svg`<circle class=${hidden ? "hidden" : ""} cx=${x(azimuth)} cy=${y(altitude)} r="5"></circle>` : nothing}
    <text class="end" x=${SIZE.width - 4} y="13">${Math.round(top)}°</text>
    <path class="hill" d=${`M${x(0)} ${bottom}${line.join("")}L${x(360)} ${bottom}Z`}></path>
    ${[..."NESWN"].map((letter, k) => svg`<text class=${k === 4 ? "end" : k ? "middle" : ""} x=${x(90 * k)} y=${SIZE.height - 2}>${letter}</text>`)}</svg>`;
}
