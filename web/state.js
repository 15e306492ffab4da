// What the page shows, and who draws it anew when it changes.

/** A drawing that is as large as its panel lets it be. @typedef {"plan" | "section" | "months" | "day" | "strip"} Drawing */
/**
 * @typedef {object} State
 * @property {JobDocument} draft what is being edited
 * @property {Answer | null} answer the newest result; older drafts' while a new one is on its way
 * @property {boolean} current whether the answer is the draft's
 * @property {JobDocument} answered the draft that was last answered
 * @property {Pass[]} passes error against time of the answer's job
 * @property {ErrorHistory | null} history what these errors tell of the time to others
 * @property {{ id: string | null, asked: number } | null} running the job that sharpens
 * @property {number} target relative error that is sharpened to
 * @property {{ draft: JobDocument, told: Schemas["Predictions"] | null } | null} prediction the draft whose times were asked for, and the
 *   answer once it is there
 * @property {Problem | null} problem what is wrong with the draft
 * @property {"lux" | "daylight_factor"} layer what the map shows
 * @property {[number, number] | null} cursor column and row of the cell under the pointer
 * @property {Record<Drawing, [number, number]>} sizes sizes of the drawings in CSS pixels
 * @property {number} tube the tube that the form shows
 * @property {number | null} corner the corner of the outline that is chosen
 * @property {number | null} partition the partition that is chosen
 * @property {number | null} sensor the single sensor that is chosen
 * @property {boolean} draws whether the next drag on the plan draws a partition
 * @property {"moment" | "year"} tab what is computed: the light at a moment, or that of a year
 * @property {import("./year_job.js").YearView} year what is shown of the year
 * @property {import("./goal.js").Goal} goal what the room is to have
 * @property {{ draft: JobDocument, answer: Answer } | null} kept variant A
 * @property {JobSummary[] | null} jobs the list, while it is open
 * @property {import("./picture.js").Picture | null} picture the picture of the room
 * @property {"north" | "west"} look where the section looks
 * @property {"curl" | "Python" | null} code which program shows the document
 * @property {JobDocument[]} past drafts to go back to, the last one last
 * @property {boolean} together whether all tubes are changed with one
 * @property {string} said what was just done
 * @property {SkyType[]} skies that the service knows
 * @property {import("./cities.js").City[]} cities that are known by name, the largest first
 */

/** @type {JobDocument} */
const EMPTY = { room: { size_m: [4, 6, 2.7] }, tubes: [] };

/** @type {State} */
export const state = {
  draft: EMPTY,
  answer: null,
  current: false,
  answered: EMPTY,
  passes: [],
  history: null,
  running: null,
  target: 0.01,
  prediction: null,
  problem: null,
  layer: "lux",
  cursor: null,
  sizes: { plan: [460, 480], section: [340, 360], months: [340, 240], day: [340, 240], strip: [780, 200] },
  tube: 0,
  corner: null,
  partition: null,
  sensor: null,
  draws: false,
  tab: "moment",
  year: {
    weather: null,
    synthetic: false,
    fault: "",
    reading: false,
    schedule: "daylight_hours",
    day: 172,
    hour: 12,
    layer: "autonomy",
    pin: null,
    answer: null,
    current: false,
    running: null,
    problem: null,
    search: null,
  },
  goal: { lux: 300, of: "mean" },
  kept: null,
  jobs: null,
  picture: null,
  look: "north",
  code: null,
  past: [],
  together: false,
  said: "",
  skies: [],
  cities: [],
};

/** @type {() => void} */
let draw = () => {};
let waiting = false;
/** Time for which a notice is shown. */
const NOTICE_MS = 8000;
/** @type {ReturnType<typeof setTimeout> | undefined} */
let notice;

/** @param {() => void} drawn draws the page from the state */
export function drawnBy(drawn) {
  draw = drawn;
}

/** Takes new values over, and what follows from them; the page is drawn once before the next frame. @param {Partial<State>} values */
export function set(values = {}) {
  Object.assign(state, values);
  if (state.current) state.answered = state.draft;
  if (!state.answer?.grid?.daylight_factor_percent) state.layer = "lux";
  if (values.said) {
    clearTimeout(notice);
    notice = setTimeout(() => set({ said: "" }), NOTICE_MS);
  }
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    draw();
  });
}

/** Takes new values of the year over. @param {Partial<State["year"]>} values */
export const setYear = (values) => set({ year: { ...state.year, ...values } });
