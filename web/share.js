// Document, target and year in the page's address; the document as a program, and as files.
import { complete } from "./draft.js";
import { isOf, judgedBy } from "./goal.js";
import { live } from "./live.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";
import { SYNTHETIC } from "./weather.js";
import { SCHEDULES } from "./year_sentence.js";

/** @param {ReadableStream<Uint8Array<ArrayBuffer>>} stream */
const bytesOf = async (stream) => new Uint8Array(await new Response(stream).arrayBuffer());

/** The document as a part of an address. @param {JobDocument} draft */
export async function packed(draft) {
  const bytes = await bytesOf(new Blob([JSON.stringify(draft)]).stream().pipeThrough(new CompressionStream("deflate-raw")));
  return btoa(String.fromCharCode(...bytes))
    .replaceAll("+", "-")
    .replaceAll("/", "_")
    .replaceAll("=", "");
}

/** Noon of a day in June, with which the year of a copy begins. */
const JUNE = "&day=172&hour=12&map=autonomy";

/**
 * The address of the editor with a copy of a job's document. That of a year has its first weather and hours that are like its own; the sky
 * of its moment is that of daylight factors, at the place of the weather.
 * @param {JobDocument} document @param {Schemas["SiteResult"] | null} site of the weather
 * @param {import("./goal.js").Goal | null} goal
 */
export async function copyAddress({ annual, ...document }, site, goal) {
  const target = goal ? `&lux=${goal.lux}&of=${goal.of}` : "";
  if (!annual) return `/#d=${await packed(document)}${target}`;
  const kind = annual.schedule?.kind === "weekly" ? "weekdays" : annual.schedule?.kind;
  const hours = SCHEDULES.find(([name]) => name === kind)?.[0] ?? "lm83";
  const place = site ? { location: { latitude_deg: site.latitude_deg, longitude_deg: site.longitude_deg } } : {};
  const draft = { ...place, ...document, sky: { cie_type: 1, diffuse_horizontal_illuminance_lux: 10_000 } };
  return `/#d=${await packed(draft)}${target}&hours=${hours}${JUNE}&weather=${encodeURIComponent([annual.weather].flat()[0] ?? "")}`;
}

/** The document of an address, its target, and its year with the name of the weather. @typedef {{ draft: JobDocument, goal: import("./goal.js").Goal | null, year: ReturnType<typeof yearOf> }} Linked */

/**
 * The document of an address, with target and year where it has them; null where it has no document, or one that cannot be read.
 * @param {string} hash
 * @returns {Promise<Linked | null>}
 */
export async function unpacked(hash) {
  const fields = new URLSearchParams(hash.slice(1));
  const text = fields.get("d") ?? "";
  if (!/^[\w-]+$/.test(text)) return null;
  const [lux, of] = [Number(fields.get("lux")), fields.get("of") ?? "mean"];
  try {
    const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (letter) => letter.charCodeAt(0));
    const read = await bytesOf(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")));
    return { draft: complete(JSON.parse(new TextDecoder().decode(read))), goal: lux > 0 && isOf(of) ? { lux, of } : null, year: yearOf(fields) };
  } catch {
    return null;
  }
}

/** What an address has of the year; null where it shows a moment. @param {URLSearchParams} fields */
function yearOf(fields) {
  const schedule = SCHEDULES.find(([name]) => name === fields.get("hours"))?.[0];
  if (!schedule) return null;
  const whole = (/** @type {string} */ name, /** @type {number} */ most) => Math.max(0, Math.min(most, Number(fields.get(name)) || 0));
  const layer = fields.get("map") === "lux" ? /** @type {const} */ ("lux") : /** @type {const} */ ("autonomy");
  const [column, row] = (fields.get("at") ?? "").split(".").map(Number);
  const pin = /** @type {[number, number] | null} */ (Number.isInteger(column) && Number.isInteger(row) ? [column, row] : null);
  return { weather: fields.get("weather"), schedule, day: Math.max(1, Math.trunc(whole("day", 366))), hour: whole("hour", 23.99), layer, pin };
}

/** What the address has beside the document: the target, and in its tab the year. */
function rest() {
  const { goal, tab, year } = state;
  const target = `&lux=${goal.lux}&of=${goal.of}`;
  if (tab !== "year") return target;
  const { weather, synthetic, schedule, day, hour, layer, pin } = year;
  const of = weather ? `&weather=${synthetic ? SYNTHETIC : encodeURIComponent(weather.id)}` : "";
  return `${target}&hours=${schedule}&day=${day}&hour=${hour}&map=${layer}${pin ? `&at=${pin.join(".")}` : ""}${of}`;
}

/** What the address has. @type {{ draft: JobDocument | null, rest: string }} */
const written = { draft: null, rest: "" };

/** Writes document, target and year into the address when the hand rests. */
export async function remember() {
  const now = { draft: state.draft, rest: rest() };
  if (now.draft === written.draft && now.rest === written.rest) return;
  Object.assign(written, now);
  const hash = `#d=${await packed(now.draft)}${now.rest}`;
  if (now.draft === written.draft && now.rest === written.rest) history.replaceState(null, "", hash);
}

/** The address is the document's and the target's already, but for a year. @param {JobDocument} draft */
export const known = (draft) => Object.assign(written, { draft, rest: state.tab === "year" ? "" : rest() });

/** Lets the address be written anew. */
export const forget = () => void (written.draft = null);

/** Copies the address of the page. */
export async function share() {
  forget();
  await remember();
  const copied = await navigator.clipboard?.writeText(location.href).then(
    () => true,
    () => false,
  );
  set({
    said: copied
      ? "The link is copied: it holds the whole document."
      : "The address of this page holds the whole document: copy it.",
  });
}

/** @param {JobDocument} draft @param {"curl" | "Python"} language */
function program(draft, language) {
  const json = JSON.stringify(draft, null, 2);
  if (language === "curl")
    return `curl -s -X POST ${location.origin}/v1/jobs -H 'Content-Type: application/json' -H 'Prefer: wait=20' --data @- <<'END'\n${json}\nEND\n`;
  return `import json
import urllib.request

document = json.loads(r"""
${json}
""")
headers = {"Content-Type": "application/json", "Prefer": "wait=20"}
request = urllib.request.Request("${location.origin}/v1/jobs", json.dumps(document).encode(), headers)
job = json.load(urllib.request.urlopen(request))
for name, grid in job["grid_results"].items():
    print(name, grid["statistics"]["mean_lux"], "lx")
`;
}

/** Name of a file of a year. @param {string} path */
export function yearFile(path) {
  const name = path.split("/").at(-1) ?? "";
  return name.includes(".") ? name : "annual.json";
}

/**
 * Links of a job's files, in whose report the first grid is compared with a target, if given.
 * @param {Job} job
 * @param {import("./goal.js").Goal | null} [goal]
 */
export function files(job, goal) {
  const { links } = job;
  const grids = Object.entries(links.grid_files ?? {}).flatMap(([name, { csv, json, png, svg, pdf }]) => [
    [`${name}.csv`, csv],
    [`${name}.json`, json],
    [`${name}.png`, png],
    [`${name}.svg`, svg],
    [`${name}.pdf`, pdf],
  ]);
  const views = Object.entries(links.views ?? {}).flatMap(([name, { exr, png }]) => [
    [`${name}.exr`, exr],
    [`${name}.png`, png],
  ]);
  const tubes = (links.tubes ?? []).map(({ svg }, index) => html`<a href=${svg} aria-label=${`tube ${index + 1}`}>${index + 1}</a>`);
  return [
    ...grids,
    ...views,
    ["convergence.csv", links.convergence_csv],
    ["convergence.png", links.convergence_png],
    ["report.pdf", `${links.report_pdf}${judgedBy(goal)}`],
    ...(links.scene ? [["scene.glb", links.scene]] : []),
    ...(links.surfaces ? [["surfaces.json", links.surfaces]] : []),
    ["job.json", links.self],
    ...(links.annual ?? []).map((path) => [yearFile(path), path]),
  ]
    .map(([name = "", path = ""]) => html`<a href=${path} download=${name}>${name}</a>`)
    .concat(tubes.length ? [html`<span>${tubes.length === 1 ? "tube" : "tubes"}</span>`, ...tubes] : []);
}

/** The part of the page about taking it away. */
export function take() {
  const { answer, draft, code, goal } = state;
  const button = (/** @type {"curl" | "Python"} */ language) =>
    html`<button type="button" aria-pressed=${code === language}
      @click=${() => set({ code: code === language ? null : language })}>${language}</button>`;
  const keeping = () => live.keep();
  return html`<h2>Files</h2>
    ${
      answer && state.current && !answer.stored
        ? html`<p class="links" @click=${keeping} @auxclick=${keeping} @contextmenu=${keeping}>${files(answer.job, goal)}<a
      href=${`/jobs/${answer.job.id}${judgedBy(goal)}`}>page of this job</a><a href=${`${answer.job.links.report}${judgedBy(goal)}`}>report</a></p>`
        : html`<p class="note">Files are there once the result is.</p>`
    }
    <div class="group"><button type="button"
      @click=${() => void share()}>Copy the link</button>${button("curl")}${button("Python")}</div>
    ${code ? html`<pre tabindex="0" aria-label=${`${code} program with the document`}>${program(draft, code)}</pre>` : nothing}`;
}
