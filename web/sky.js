// The skies to choose from, in words, with a small picture of each.
import { number } from "./field.js";
import { edit } from "./live.js";
import { state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @type {Record<number, string>} */
const skyNames = {
  1: "overcast",
  2: "overcast, bright to the sun",
  3: "light overcast",
  4: "light overcast, bright to the sun",
  5: "even white",
  6: "veiled, bright to the sun",
  7: "veiled with sun",
  8: "veiled, sun with corona",
  9: "cloudy, sun hidden",
  10: "cloudy with sun",
  11: "bright haze",
  12: "clear with sun",
  13: "clear, polluted air",
  14: "cloudless, turbid",
  15: "turbid, wide corona",
  16: "overcast, traditional",
};

/** A sky in words; empty for one that has no name. @param {Pick<Schemas["SkyDocument"], "cie_type" | "perez"> | null | undefined} sky */
export const skyName = (sky) => (sky?.cie_type ? (skyNames[sky.cie_type] ?? "") : sky?.perez ? "sky of given irradiances" : "");

/** Skies that are shown first: from overcast to clear. */
const COMMON = [1, 9, 11, 12];

/** Sun of the small pictures: so high, to the right. */
const ALTITUDE = (40 * Math.PI) / 180;
const PIXELS = 48;

/** @type {Map<number, string>} */
const pictures = new Map();

/** The sky as a disc seen from below, its luminances by the formula of the CIE. @param {SkyType} sky */
function thumbnail(sky) {
  const { a, b, c, d, e } = sky.parameters ?? { a: 4, b: -0.7, c: 0, d: -1, e: 0 };
  const luminance = (/** @type {number} */ zenith, /** @type {number} */ azimuth) => {
    const toSun = Math.acos(
      Math.min(1, Math.sin(zenith) * Math.cos(azimuth) * Math.cos(ALTITUDE) + Math.cos(zenith) * Math.sin(ALTITUDE)),
    );
    const indicatrix = 1 + c * (Math.exp(d * toSun) - Math.exp((d * Math.PI) / 2)) + e * Math.cos(toSun) ** 2;
    return { value: (1 + a * Math.exp(b / Math.max(Math.cos(zenith), 0.01))) * indicatrix, toSun };
  };
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = PIXELS;
  const context = canvas.getContext("2d");
  if (!context) return "";
  const pixels = context.createImageData(PIXELS, PIXELS);
  const white = luminance(Math.PI / 2 - ALTITUDE, 0).value;
  const clear = sky.cie_type >= 11 && sky.cie_type <= 15;
  for (let i = 0; i < PIXELS * PIXELS; i++) {
    const [x, y] = [(((i % PIXELS) + 0.5) / PIXELS) * 2 - 1, ((Math.floor(i / PIXELS) + 0.5) / PIXELS) * 2 - 1];
    const radius = Math.hypot(x, y);
    if (radius > 1) continue;
    const { value, toSun } = luminance((radius * Math.PI) / 2, Math.atan2(y, x));
    const light = Math.min(1, value / white) ** 0.45;
    // by eye: clear skies are blue where they are dark
    const blue = clear ? 1 - light : 0.12 * (1 - light);
    const sun = !sky.sunless && sky.cie_type !== 9 && toSun < 0.13;
    const colour = sun
      ? [255, 236, 150]
      : [255 * (light - 0.35 * blue), 255 * (light - 0.1 * blue), 255 * Math.min(1, light + 0.35 * blue)];
    pixels.data.set([...colour.map((channel) => Math.max(0, channel)), 255], 4 * i);
  }
  context.putImageData(pixels, 0, 0);
  return canvas.toDataURL();
}

/** How bright the sky is where somebody says so. */
function level() {
  return number({
    pointer: "/sky/diffuse_horizontal_illuminance_lux",
    label: "Light of the sky outside",
    unit: "lx",
    value: state.draft.sky?.diffuse_horizontal_illuminance_lux,
    step: 100,
    min: 0,
    set: (lux) =>
      edit(
        ({ sky }) =>
          sky &&
          Object.assign(sky, {
            diffuse_horizontal_illuminance_lux: lux,
            zenith_luminance_cd_m2: null,
            luminous_turbidity: null,
            dv_ev: null,
          }),
      ),
    clear: () => edit(({ sky }) => sky && delete sky.diffuse_horizontal_illuminance_lux),
  });
}

/** Irradiances of a clear hour, to begin with. */
const CLEAR_HOUR = { direct_normal_irradiance_w_m2: 700, diffuse_horizontal_irradiance_w_m2: 100 };

/** The irradiances of a sky that follows from them. @param {Schemas["PerezDocument"]} perez */
function irradiances(perez) {
  const of = (/** @type {keyof typeof CLEAR_HOUR} */ name, /** @type {string} */ label, /** @type {number} */ max) =>
    number({
      pointer: `/sky/perez/${name}`,
      label,
      unit: "W/m²",
      value: perez[name],
      step: 10,
      min: 0,
      max,
      set: (to) => edit(({ sky }) => sky?.perez && (sky.perez[name] = to)),
    });
  return html`<div class="pair">${of("direct_normal_irradiance_w_m2", "Direct normal", 1450)}${of("diffuse_horizontal_irradiance_w_m2", "Diffuse", 1100)}</div>`;
}

/** The part of the form about the sky. */
export function sky() {
  const chosen = state.draft.sky?.cie_type ?? null;
  const perez = state.draft.sky?.perez;
  const shown = state.skies.filter(({ cie_type }) => cie_type <= 15 || cie_type === chosen);
  /** @param {Pick<Schemas["SkyDocument"], "cie_type" | "perez">} kind */
  const take = (kind) =>
    edit((draft) => {
      // a level that was given belongs to the sky that was given
      draft.sky = { ...kind, ...(draft.sky?.sun_position ? { sun_position: draft.sky.sun_position } : {}) };
      draft.location ??= { latitude_deg: 55.68, longitude_deg: 12.57 };
      draft.time ??= "2026-03-21T12:00:00+01:00";
    });
  const choice = (/** @type {SkyType} */ it) => {
    const picture = pictures.get(it.cie_type) ?? thumbnail(it);
    pictures.set(it.cie_type, picture);
    return html`<label title=${it.description}><input type="radio" name="sky" value=${it.cie_type}
      .checked=${it.cie_type === chosen} @change=${() => take({ cie_type: it.cie_type })}>
      <img src=${picture} alt="" width="40"
        height="40"><span>${skyNames[it.cie_type]} <small>(${it.cie_type})</small></span></label>`;
  };
  const isCommon = (/** @type {SkyType} */ { cie_type }) => COMMON.includes(cie_type) || cie_type === chosen;
  const measured = html`<label class="check"><input type="radio" name="sky" value="perez" .checked=${Boolean(perez)}
    @change=${() => take({ perez: CLEAR_HOUR })}>by irradiances, as weather files have them (Perez)</label>`;
  return html`<fieldset><legend class="unseen">Sky</legend><div class="skies">${shown.filter(isCommon).map(choice)}</div>
    ${measured}${perez ? irradiances(perez) : nothing}
    <details><summary>More skies</summary><div class="skies">${shown.filter((it) => !isCommon(it)).map(choice)}</div></details></fieldset>
  ${level()}${
    chosen === null && state.draft.sky?.preset
      ? html`<p
    class="note">The sky of the document is ${state.draft.sky.preset}.</p>`
      : nothing
  }`;
}
