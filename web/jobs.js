// The list of the service's jobs.
import * as api from "./api.js";
import { percent } from "./accuracy.js";
import { set, state } from "./state.js";
import { html, nothing } from "./vendor/lit-html.js";

/** How many jobs are listed. */
const MOST = 30;

/** Opens the list, or closes it. */
export async function toggle() {
  if (state.jobs) return void set({ jobs: null });
  set({ jobs: (await api.get(`/v1/jobs?limit=${MOST}`)).jobs });
}

/** Closes the list by a key. @param {KeyboardEvent} event */
export const closes = ({ key }) => key === "Escape" && set({ jobs: null });

const again = async () => set({ jobs: (await api.get(`/v1/jobs?limit=${MOST}`)).jobs });

/** The time of a moment of today, the date of an earlier one. @param {Date} moment */
function told(moment) {
  const today = moment.toDateString() === new Date().toDateString();
  return today
    ? moment.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" })
    : moment.toLocaleDateString([], { day: "numeric", month: "short", year: "numeric" });
}

/** @param {string} does @param {string} what @param {() => Promise<void>} ends */
const button = (does, what, ends) =>
  html`<button type="button" aria-label=${`${does} ${what}`} @click=${() => void ends().then(again)}>${does}</button>`;

/** The list, while it is open. */
export function jobs() {
  const { jobs } = state;
  if (!jobs) return nothing;
  // a phone shows rows as blocks, which would be no rows without their roles
  const row = (/** @type {JobSummary} */ { id, name, status, created_at, progress }) => html`<tr role="row">
    <td role="cell"><a href=${`/jobs/${id}`}>${name || id.slice(-8)}</a></td><td role="cell">${status}</td><td role="cell">${created_at ? told(new Date(created_at)) : ""}</td>
    <td role="cell">${progress.relative_error ? percent(progress.relative_error) : progress.view_relative_error ? percent(progress.view_relative_error) : "–"}</td>
    <td role="cell">${status === "queued" || status === "running" ? button("Stop", name || id, () => api.cancelJob(id)) : button("Delete", name || id, () => api.deleteJob(id))}</td></tr>`;
  return html`<section class="panel row" aria-label="Jobs" @keydown=${closes}><div class="head"><h2>Jobs</h2><button type="button"
    @click=${() => void again()}>Refresh</button><button type="button" @click=${() => set({ jobs: null })}>Close</button></div>
    ${
      jobs.length
        ? html`<div class="wide-table" tabindex="0" role="region" aria-label="Table of jobs"><table
      class="jobs" role="table"><thead role="rowgroup"><tr role="row">${["name", "status", "posted", "error"].map((name) => html`<th scope="col" role="columnheader">${name}</th>`)}<th
      scope="col" role="columnheader"><span class="unseen">end</span></th></tr></thead><tbody role="rowgroup">${jobs.map(row)}</tbody></table></div>`
        : html`<p
      class="note">There are none.</p>`
    }</section>`;
}
