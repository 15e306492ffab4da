// Weather files of the visitor's, and the synthetic year that comes with the service: taken to the service, found there again.
import * as api from "./api.js";
import { setYear, state } from "./state.js";

/** Name of the synthetic year in the page's address, and of its file. */
export const SYNTHETIC = "synthetic";

/** Number of days of a file. @param {Weather} weather */
const days = ({ report }) => Math.ceil(report.records / (24 * report.records_per_hour));

/** Number of the weather that was asked for last: what comes later of others is dropped. */
let asked = 0;

/** Takes the weather over that is on its way. @param {() => Promise<Weather>} coming @param {boolean} synthetic */
async function take(coming, synthetic) {
  const mine = ++asked;
  setYear({ reading: true, fault: "" });
  try {
    const weather = await coming();
    if (mine !== asked) return;
    setYear({ weather, synthetic, reading: false, day: Math.max(1, Math.min(state.year.day, days(weather))) });
  } catch (error) {
    if (mine !== asked) return;
    setYear({ reading: false, fault: api.problemOf(error).detail });
  }
}

/** Takes a file to the service. @param {File} file */
export const takeFile = (file) => take(() => api.postWeather(file), false);

/** Takes the synthetic year to the service. */
export const trySynthetic = () => take(async () => api.postWeather(new Blob([await api.bytes(`/web/${SYNTHETIC}.epw`)])), true);

/** Finds the weather of an address. @param {string} name */
export const find = (name) => (name === SYNTHETIC ? trySynthetic() : take(() => api.get(`/v1/weather/${encodeURIComponent(name)}`), false));
