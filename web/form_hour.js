// The day and the hour of a year that are shown. All hours are in the page: moving through them asks nothing of the service.
import { hourName, isoDay, read } from "./clock.js";
import { slider } from "./field.js";
import { setYear, state } from "./state.js";
import { html } from "./vendor/lit-html.js";
import { dayOfYear, span } from "./year_plan.js";

/** Sliders for the day and the hour. @param {import("./year_job.js").YearAnswer} answer */
export function chooseHour(answer) {
  const { day, hour } = state.year;
  const { days, perHour, first } = answer.hours;
  const date = isoDay(first.year, first.day + day - 1);
  const within = (/** @type {number} */ of) => Math.max(1, Math.min(days, of));
  return html`${slider({
      pointer: "/year/day",
      label: "Day",
      value: day,
      shown: dayOfYear(answer),
      step: 1,
      min: 1,
      max: days,
      typed: {
        type: "date",
        text: date,
        enter: (text) => setYear({ day: within(Math.round((Date.parse(text) - Date.UTC(first.year, 0, first.day)) / 86_400_000) + 1) }),
      },
      set: (to) => setYear({ day: to }),
    })}
    ${slider({
      pointer: "/year/hour",
      label: "Hour",
      value: hour,
      shown: `${span(answer, hour)}, standard time`,
      step: 1 / perHour,
      min: 0,
      max: 24 - 1 / perHour,
      typed: {
        type: "time",
        text: hourName(hour),
        enter: (text) => setYear({ hour: Math.floor(read(`${date}T${text}`).hour * perHour) / perHour }),
      },
      set: (to) => setYear({ hour: to }),
    })}`;
}
