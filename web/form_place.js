// Place and time, or where the sun is.
import { at as cityAt, called, named } from "./cities.js";
import { dayName, hourName, isoDay, offset, read, time } from "./clock.js";
import { number, slider } from "./field.js";
import { edit } from "./live.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";
import { setClock, zone } from "./zone.js";

/**
 * Sets coordinates and clock of the place.
 * @param {JobDocument} draft
 * @param {{ latitude?: number, longitude?: number, year?: number, day?: number, hour?: number }} to
 */
function at(draft, to) {
  const { year, day, hour } = { ...read(draft.time), ...to };
  const location = (draft.location ??= { latitude_deg: 55.68, longitude_deg: 12.57 });
  location.latitude_deg = to.latitude ?? location.latitude_deg;
  location.longitude_deg = to.longitude ?? location.longitude_deg;
  draft.time = time(year, day, hour, offset(draft.time));
}

/** @param {Event} event */
function takeCity(event) {
  const field = /** @type {HTMLInputElement} */ (event.target);
  const { value } = field;
  const city = named(state.cities, value);
  if (!city) {
    const now = cityAt(state.cities, state.draft.location);
    field.value = now ? called(now) : "";
    return void set({ said: `No city called ${value} is listed: give its coordinates.` });
  }
  setClock((draft) => at(draft, { latitude: city.latitude_deg, longitude: city.longitude_deg }));
}

/** The cities to choose from, by what is typed; drawn once. @param {import("./cities.js").City[]} cities */
export const suggestions = (cities) =>
  html`<datalist id="cities">${cities.map((city) => html`<option value=${called(city)}>${city.time_zone}</option>`)}</datalist>`;

/** The part of the form about place and time. */
export function place() {
  const { draft, cities } = state;
  if (draft.sky?.sun_position) return sun(draft.sky.sun_position);
  const { year, day, hour } = read(draft.time);
  const { latitude_deg, longitude_deg } = draft.location ?? { latitude_deg: 0, longitude_deg: 0 };
  const city = cityAt(cities, draft.location);
  const sunNow = state.answer?.job.provenance?.sun;
  const altitude = Number(sunNow?.altitude_deg);
  return html`
    <div class="field"><label for="city">City</label><input id="city" list="cities" autocomplete="off"
      .value=${city ? called(city) : ""} placeholder="name, or coordinates below" @change=${takeCity}></div>
    <div class="pair">
      ${number({
        pointer: "/location/latitude_deg",
        label: "Latitude",
        unit: "°N",
        value: latitude_deg,
        set: (latitude) => setClock((next) => at(next, { latitude })),
      })}
      ${number({
        pointer: "/location/longitude_deg",
        label: "Longitude",
        unit: "°E",
        value: longitude_deg,
        set: (longitude) => setClock((next) => at(next, { longitude })),
      })}
    </div>
    ${slider({
      pointer: "/time/day",
      label: "Day",
      value: day,
      shown: dayName(year, day),
      step: 1,
      min: 1,
      max: 365,
      typed: {
        type: "date",
        text: isoDay(year, day),
        enter: (text) => {
          // a year of which digits are still to come
          if (text.startsWith("0")) return;
          const { year, day } = read(`${text}T12:00`);
          setClock((next) => at(next, { year, day }));
        },
      },
      set: (to) => setClock((next) => at(next, { day: to })),
    })}
    ${slider({
      pointer: "/time",
      label: "Hour",
      value: hour,
      shown: hourName(hour),
      step: 0.25,
      min: 0,
      max: 23.75,
      typed: {
        type: "time",
        text: hourName(hour),
        enter: (text) => setClock((next) => at(next, { hour: read(`${isoDay(year, day)}T${text}`).hour })),
      },
      set: (to) => setClock((next) => at(next, { hour: to })),
    })}
    ${zone()}
    <p class="note">${state.current && Number.isFinite(altitude) ? where(altitude, Number(sunNow?.azimuth_deg)) : nothing}</p>`;
}

/** Where the sun is, in words. @param {number} altitude @param {number} azimuth */
const where = (altitude, azimuth) =>
  altitude > 0
    ? `The sun stands ${altitude.toFixed(1)}° high, ${compass(azimuth)}.`
    : `The sun is ${(-altitude).toFixed(1)}° below the horizon.`;

/** @param {number} azimuth */
const compass = (azimuth) =>
  `in the ${["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"][Math.round(azimuth / 45) % 8]}`;

/** @param {{ altitude_deg: number, azimuth_deg: number }} position */
function sun(position) {
  const change = (/** @type {(position: { altitude_deg: number, azimuth_deg: number }) => void} */ to) =>
    edit((next) => next.sky?.sun_position && to(next.sky.sun_position));
  const free = () =>
    setClock((next) => {
      if (next.sky) delete next.sky.sun_position;
      at(next, {});
    });
  return html`
    ${slider({
      pointer: "/sky/sun_position/altitude_deg",
      label: "Height of the sun",
      value: position.altitude_deg,
      unit: "°",
      step: 1,
      min: 0,
      max: 90,
      set: (to) => change((it) => (it.altitude_deg = to)),
    })}
    ${slider({
      pointer: "/sky/sun_position/azimuth_deg",
      label: "Azimuth of the sun",
      value: position.azimuth_deg,
      unit: "°",
      step: 1,
      min: 0,
      max: 359,
      set: (to) => change((it) => (it.azimuth_deg = to)),
    })}
    <button type="button" @click=${free}>Set place and time instead</button>`;
}
