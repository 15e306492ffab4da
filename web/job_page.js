// One job, at an address of its own: what was asked for, how far it is, what came out.
import { chart, duration, percent, timeLeft, times } from "./accuracy.js";
import * as api from "./api.js";
import { at as cityAt, called, listed } from "./cities.js";
import { place } from "./columns.js";
import { centimetres } from "./draft.js";
import { across, bar, isolines, largest, lux, measures, outlined, outside, reaching, values } from "./map.js";
import { fresh } from "./fresh.js";
import { asked, judgedBy } from "./goal.js";
import { figure, fluxesOf, yearOf } from "./job_year.js";
import { jobs } from "./jobs.js";
import { prose } from "./prose.js";
import { reasons } from "./reasons.js";
import { headline, numbers } from "./results.js";
import { alongside, extent, outline, steepness } from "./room.js";
import { LARGE, SMALL, axis, fitted, furniture, marks, north, partitionLine, rim } from "./room_plan.js";
import { scale } from "./scale.js";
import { stillSensor } from "./sensor_marks.js";
import { copyAddress, files } from "./share.js";
import { skyName } from "./sky.js";
import { drawnBy, set, state } from "./state.js";
import { judged } from "./verdict.js";
import { html, nothing, render, svg } from "./vendor/lit-html.js";

/**
 * What the page knows of its job; `edit` is the address of a copy, empty until it is known.
 * @typedef {{ job: Job | null, grid: Grid | null, meshes: Schemas["MeshesResult"] | null, year: Schemas["AnnualResult"] | null, passes: Pass[], left: number | null, history: ErrorHistory | null, fault: string, edit: string }} Seen
 */

/** True where a drawing is no wider than a small one. */
const narrow = matchMedia("(max-width: 500px)");
/** Size of the chart of errors elsewhere. */
const WIDE = { width: 430, height: 210 };

/** Shows a job, and follows it until it ends. @param {string} id @param {HTMLElement} app @param {() => Drawn} header */
export async function jobPage(id, app, header) {
  /** @type {Seen} */
  const seen = { job: null, grid: null, meshes: null, year: null, passes: [], left: null, history: null, fault: "", edit: "" };
  const ended = () => seen.job?.status !== "queued" && seen.job?.status !== "running";
  const look = async () => {
    seen.job = await api.job(id);
    document.title = `${seen.job.name ?? "Job"}, skyduct`;
    // before the first pass there is nothing
    const begun = seen.job.progress.passes > 0 || ended();
    seen.grid = begun ? await api.firstGrid(seen.job) : null;
    seen.meshes ??= await meshesOf(seen.job);
    seen.year = begun ? await yearOfJob(seen.job) : null;
    const { passes, grids, views } = await api.convergence(id);
    Object.assign(seen, { passes, history: grids ?? views ?? null });
    seen.edit = await copyAddress(seen.job.document, seen.year?.site ?? null, asked(location.search));
    set();
  };
  narrow.addEventListener("change", () => set());
  // without their names places have coordinates alone
  void listed().then(
    (cities) => set({ cities }),
    () => {},
  );
  drawnBy(() => {
    render(html`${header()}<main class="job">${jobs()}<div class="columns">${page(seen)}</div></main><p class="said" role="status">${prose(state.said)}</p>`, app);
    place(/** @type {HTMLElement} */ (app.querySelector(".columns")));
  });
  try {
    await look();
    let looked = performance.now();
    if (!ended()) {
      await api.follow(
        id,
        (name, data) => {
          if (name === "pass") Object.assign(seen, { passes: [...seen.passes, data], left: data.seconds_left });
          set();
          // the first pass is looked at as soon as it is there
          const isFirst = name === "pass" && !seen.job?.progress.passes;
          if (isFirst || performance.now() - looked > 2000) {
            looked = performance.now();
            void look();
          }
        },
        new AbortController().signal,
      );
      await look();
    }
  } catch (error) {
    seen.fault = error instanceof api.Refused ? error.problem.detail : String(error);
    set();
  }
}

/** The year of a job, as far as it is computed; null where there is none yet. @param {Job} job @returns {Promise<Schemas["AnnualResult"] | null>} */
async function yearOfJob({ links }) {
  const path = links.annual?.[0];
  return path ? api.get(path).catch(() => null) : null;
}

/** Triangles of the meshes of a job; null where it has none, or they are not there yet. @param {Job} job @returns {Promise<Schemas["MeshesResult"] | null>} */
const meshesOf = async ({ links }) => (links.meshes ? api.get(links.meshes).catch(() => null) : null);

/** @param {Seen} seen */
function page({ job, grid, meshes, year, passes, left: seconds, history, fault, edit }) {
  if (!job)
    return html`<section class="panel"><h2>${fault ? "This job is not here" : "Job"}</h2><p>${prose(fault || "…")}</p><p><a
      href="/">To the editor</a></p></section>`;
  const why = job.stopped_by && job.stopped_by !== job.status ? `, stopped by ${job.stopped_by.replaceAll("_", " ")}` : "";
  const runs = job.status === "queued" || job.status === "running";
  const views = Object.entries(job.links.views ?? {});
  const overcast = job.document.annual ? html`<p class="note">Below an overcast sky of 10\u202f000\u202flx, which daylight factors are for.</p>` : nothing;
  const given = asked(location.search);
  const goal = goalOf(job, grid?.name, given);
  // passes are told sooner than the job
  const error = (runs ? passes.at(-1)?.relative_error : null) ?? job.progress.relative_error;
  return html`<section class="panel about" aria-label="Job"><h2>${job.name || "Job"}</h2>
      <p>${job.status}${why}; ${job.progress.passes} ${job.progress.passes === 1 ? "pass" : "passes"} in ${duration(job.progress.seconds)}${runs ? timeLeft(seconds) : ""}</p>
      <dl class="numbers">${wanted(job.document, year).map(([name, value]) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>
      <p class="links">${job.document.room.faces || !edit ? nothing : html`<a href=${edit}>Edit a copy</a>`}<a href=${`${job.links.report}${judgedBy(given)}`}>Report</a>${runs ? html`<button type="button" @click=${() => void api.cancelJob(job.id)}>Stop</button>` : nothing}</p>
      ${job.problem ? html`<p class="fault">${prose(job.problem.detail)}</p>` : nothing}</section>
    ${year ? [yearOf(job, year, runs, (name) => goalOf(job, name, given)), fluxesOf(job, runs)] : nothing}
    ${
      grid
        ? html`<section class="panel map" aria-label="Map"><h2>${grid.name}</h2>${overcast}${map(job, grid, meshes)}</section><section
      class="panel result" aria-label="Result">${job.document.annual ? overcast : goal ? judged({ job, grid }, goal) : nothing}${headline({ job, grid })}${numbers({ job, grid })}</section>`
        : nothing
    }
    ${runs ? nothing : section(job)}
    ${views.map(
      ([name, { png }]) => {
        const address = runs ? fresh(png, job.progress.passes) : png;
        return address ? html`<section class="panel view" aria-label=${`Picture ${name}`}><h2>${name}</h2><img
          class="rendered" src=${address} alt=${`The view ${name} of the room`}></section>` : nothing;
      },
    )}
    <section class="panel accurate" aria-label="Accuracy"><h2>Error against time</h2>${chart(
      passes.map((pass) => ({ ...pass, relative_error: pass.relative_error ?? /** @type {any} */ (pass).view_relative_error })),
      null,
      narrow.matches ? undefined : WIDE,
    )}
      <p>${error ? `${percent(error)} of the map ${runs ? "so far" : "at the end"}` : passes.length < 2 ? "One pass tells no error." : ""}</p>
      ${history ? times(history) : nothing}</section>
    <section class="panel why" aria-label="Reasons">${reasons(job)}</section>
    <section class="panel take" aria-label="Files"><h2>Files</h2><p class="links">${files(job, given)}</p></section>`;
}

/** The target of a grid: of the first one that of the address, else that of the document, which is for the mean. @param {Job} job @param {string | undefined} name @param {import("./goal.js").Goal | null} given by the address */
function goalOf({ document: { grids = [] } }, name, given) {
  const lux = grids.find((grid) => grid.name === name)?.target_lux;
  return (name === grids[0]?.name && given) || (lux ? { lux, of: /** @type {const} */ ("mean") } : null);
}

/** The section that shows the slope of the ceiling, else that along the longer side of the room. @param {Job} job */
function section({ document, links }) {
  const { width, depth } = extent(document.room);
  const { room } = document;
  const alongY = steepness(room) > 0 ? alongside(room) === "west" : depth > width;
  const drawn = links.figures?.[alongY ? "section_y" : "section_x"];
  return drawn ? html`<section class="panel view" aria-label="Section"><h2>Section</h2>${figure(drawn.svg, drawn.svg, "A section through the room and its tubes")}</section>` : nothing;
}

/** What was asked for, in words; weather files have names once the year is there. @param {JobDocument} document @param {Schemas["AnnualResult"] | null} year @returns {[string, string][]} */
function wanted({ room, sky, time, location, tubes, annual }, year) {
  const named = skyName(sky);
  const city = cityAt(state.cities, location);
  const weather = year ? [year, ...(year.others ?? [])].map(({ site }) => site.name) : [annual?.weather ?? []].flat();
  return [
    ["room", size(room)],
    ["tubes", String(tubes?.length ?? 0)],
    ...(named ? [/** @type {[string, string]} */ (["sky", `${named}${sky?.cie_type ? ` (${sky.cie_type})` : ""}`])] : []),
    ...(annual ? [/** @type {[string, string]} */ (["weather", weather.join(", ")])] : []),
    ...(time ? [/** @type {[string, string]} */ (["time", time.replace("T", " ").replace(/(:\d\d):00(?=\D|$)/, "$1 ")])] : []),
    ...(location ? [/** @type {[string, string]} */ (["place", [...(city ? [called(city)] : []), coordinates(location)].join(", ")])] : []),
  ];
}

/** Size of a room in words. @param {JobDocument["room"]} room */
function size(room) {
  const { width, depth, lowest, height } = extent(room);
  if (room.size_m) return `${room.size_m.join(" × ")} m`;
  return `${outline(room).length} corners, ${centimetres(width)} × ${centimetres(depth)} × ${lowest < height ? `${centimetres(lowest)} to ` : ""}${centimetres(height)} m`;
}

/** @param {{ latitude_deg: number, longitude_deg: number }} place */
const coordinates = ({ latitude_deg: north, longitude_deg: east }) =>
  `${Math.abs(north)}° ${north < 0 ? "S" : "N"}, ${Math.abs(east)}° ${east < 0 ? "W" : "E"}`;

/** @param {Job} job @param {Grid} grid @param {Schemas["MeshesResult"] | null} meshes */
function map(job, grid, meshes) {
  const { rows, unit } = values(grid, "lux");
  const { room, tubes = [] } = job.document;
  const { east, depth } = extent(room);
  const at = fitted(room, narrow.matches ? SMALL : LARGE);
  const { end, ticks } = scale(largest(rows));
  const { numbers, taken } = marks(room, tubes, at);
  return svg`<svg class="plan" viewBox=${`0 0 ${at.box.join(" ")}`} role="img" aria-label=${`Illuminance of ${grid.name}`}>
    ${lux(grid, reaching(grid, rows, room), at, end)}${furniture(room, meshes, at)}${isolines(grid, rows, at, room, taken, unit, end)}
    ${outside(room, grid, at)}${outlined(room, at, "frame")}
    ${(room.partitions ?? []).map((sheet) => svg`<g class="partition still">${partitionLine(sheet, at, "seen")}</g>`)}
    ${tubes.map((tube) => [axis(room, tube, at), rim(room, tube, at)])}${numbers}
    ${(grid.points_m ?? []).map((point, index) => stillSensor(/** @type {import("./sensor.js").Sensor} */ (point), index, at))}
    ${measures(room, at)}
    ${grid.points_m ? nothing : bar(end, ticks, unit, across(at, east) + 18, at.top, at.k * depth)}${north(room.rotation_deg ?? 0)}</svg>`;
}
