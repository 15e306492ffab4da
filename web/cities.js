// Cities by name, each with its coordinates and its time zone, the largest first: capitals, and large cities of every country, from data of
// GeoNames (CC BY 4.0).
import { get } from "./api.js";

/** @typedef {{ name: string, country: string, latitude_deg: number, longitude_deg: number, time_zone: string }} City */

const countries = new Intl.DisplayNames("en", { type: "region" });

/** Letters without accents, as people type them. @param {string} text */
const plain = (text) => text.trim().toLowerCase().replaceAll("ø", "o").replaceAll("ł", "l").replaceAll("ı", "i").normalize("NFD").replaceAll(/\p{M}/gu, "");

/** Reads the list. @returns {Promise<City[]>} */
export async function listed() {
  /** @type {[string, string, number, number, string][]} */
  const rows = await get("/web/cities.json");
  return rows.map(([name, code, latitude_deg, longitude_deg, time_zone]) => ({
    name,
    country: countries.of(code) ?? code,
    latitude_deg,
    longitude_deg,
    time_zone,
  }));
}

/** @param {City} city */
export const called = ({ name, country }) => (name === country ? name : `${name}, ${country}`);

/** The city that a text names, or begins to name; the largest one of several. @param {City[]} cities @param {string} text */
export function named(cities, text) {
  const wanted = plain(text);
  const begins = (/** @type {string} */ of) => plain(of).startsWith(wanted);
  return (wanted && (cities.find(({ name }) => plain(name) === wanted) ?? cities.find((city) => begins(called(city))))) || null;
}

/** The city at coordinates. @param {City[]} cities @param {{ latitude_deg: number, longitude_deg: number } | null | undefined} place */
export const at = (cities, place) =>
  cities.find((city) => city.latitude_deg === place?.latitude_deg && city.longitude_deg === place.longitude_deg);
