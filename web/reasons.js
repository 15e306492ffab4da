// What is simulated and what is not, by which methods, and why.
import { prose } from "./prose.js";
import { html, nothing } from "./vendor/lit-html.js";

/** @param {string} name */
const words = (name) => name.replaceAll("_", " ");

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
    ${guides.length ? html`<details><summary>How light is followed through the tubes</summary><ol>${guides.map(({ reason }) => html`<li>${prose(reason)}</li>`)}</ol></details>` : nothing}`;
}
