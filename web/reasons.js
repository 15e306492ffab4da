// What is simulated and what is not, by which methods, and why.
import { prose } from "./prose.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @param {string} name */
const words = (name) => name.replaceAll("_", " ");

/** Numbers of tubes in words: 1, "1 to 40" or "2, 5". @param {number[]} of */
const range = (of) => (of.length > 2 && (of.at(-1) ?? 0) - (of[0] ?? 0) === of.length - 1 ? `${of[0]} to ${of.at(-1)}` : of.join(", "));

/** How light is followed through the tubes, those together of which the same is said, counted from 1. @param {{ reason: string }[]} guides */
function guided(guides) {
  /** @type {Map<string, number[]>} */
  const tubes = new Map();
  guides.forEach(({ reason }, at) => tubes.set(reason, [...(tubes.get(reason) ?? []), at + 1]));
  return [...tubes].map(([reason, of]) => html`<li><strong>${of.length > 1 ? "Tubes" : "Tube"} ${range(of)}:</strong> ${prose(reason)}</li>`);
}

/** @param {Job} job */
export function reasons(job) {
  const { effects, methods, guides } = job.plan;
  const effect = (/** @type {Schemas["EffectResult"]} */ { name, on, reason }) =>
    html`<li class=${on ? "on" : "off"}><span
      class="mark">${on ? "on" : "off"}</span> <strong>${words(name)}</strong> ${prose(reason)}</li>`;
  const method = (/** @type {"grids" | "views"} */ of, /** @type {string} */ words_) =>
    methods[of] ? html`<p><strong>${words_}: ${words(methods[of].name)}</strong>, ${prose(methods[of].reason)}</p>` : nothing;
  const warnings = [...job.warnings, ...(job.render_warnings ?? [])];
  return html`<h2>What is simulated, and why</h2>
    ${warnings.map((warning) => html`<p class="warning" role="note">${prose(warning.detail)}</p>`)}
    ${job.cross_check ? html`<p class="check"><strong>Second opinion:</strong> ${prose(job.cross_check.verdict)}.</p>` : nothing}
    ${method("grids", "Map")}${method("views", "Picture")}
    <ul class="effects">${effects.filter(({ on }) => on).map(effect)}</ul>
    <details><summary>Left out: ${effects.filter(({ on }) => !on).length} effects</summary><ul
      class="effects">${effects.filter(({ on }) => !on).map(effect)}</ul></details>
    ${guides.length ? html`<details><summary>How light is followed through the tubes</summary><ul class="effects">${guided(guides)}</ul></details>` : nothing}`;
}
