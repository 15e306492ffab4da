// Pages of jobs: sentences of the service, and pictures of a job that runs.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { until } from "./visit.mjs";

/** Posts a job, and returns its path below the page. @param {string} url @param {object} document @param {string} [prefer] */
async function posted(url, document, prefer = "respond-async") {
  const answer = await fetch(`${url}/v1/jobs`, {
    method: "POST",
    headers: { "Content-Type": "application/json", Prefer: prefer },
    body: JSON.stringify(document),
  });
  const { id } = await answer.json();
  return `/jobs/${id}`;
}

/** Names of fields in sentences of the service are code, and no backtick is seen. */
export async function readsProse(visitor) {
  const { page } = visitor;
  const told = await page.evaluate(async () => {
    const [{ prose }, { render }] = [await import("/web/prose.js"), await import("/web/vendor/lit-html.js")];
    return ["needs `sky` or `annual`", "one ` alone", "<b>`<i>`"].map((sentence) => {
      const host = document.createElement("p");
      render(prose(sentence), host);
      return [host.textContent, [...host.querySelectorAll("code")].map((code) => code.textContent)];
    });
  });
  assert.deepEqual(told, [
    ["needs sky or annual", ["sky", "annual"]],
    ["one ` alone", []],
    ["<b><i>", ["<i>"]],
  ]);
  // a lamp needs no sky, and the place changes nothing
  const { sky, time, tubes, ...lit } = JSON.parse(readFileSync("examples/two_tubes.json", "utf8"));
  const lamp = { kind: "rectangle", corner_m: [2, 2, 2], edge_u_m: [0, 0.2, 0], edge_v_m: [0.2, 0, 0], luminance_cd_m2: 5000 };
  const path = await posted(visitor.url, { ...lit, views: [], tubes: [], location: { latitude_deg: 50, longitude_deg: 10 }, room: { ...lit.room, luminaires: [lamp] } }, "wait=50");
  await visitor.page.goto(visitor.url + path);
  const warning = page.locator(".warning", { hasText: "there is no daylight" });
  await warning.waitFor();
  assert.deepEqual(await warning.locator("code").allInnerTexts(), ["sky", "location", "time", "surroundings"]);
  assert(!(await page.locator("main").innerText()).includes("`"));
  const report = await (await fetch(`${visitor.url}${path}/report`)).text();
  assert.match(report, /without <code>sky<\/code> there is no daylight/);
  await visitor.open("/");
}

/** The page of a job that runs has its picture, which a later pass replaces. */
export async function seesARunningJob(visitor) {
  const { page } = visitor;
  const { views, ...hall } = JSON.parse(readFileSync("examples/l_hall.json", "utf8"));
  const view = { name: "door", eye_m: [7.5, 0.5, 1.6], look_at_m: [2, 2, 1], vertical_fov_deg: 60, size_px: [80, 60] };
  const path = await posted(visitor.url, { ...hall, views: [view], stop: { view_relative_error: 1e-5, relative_error: 1e-5, max_seconds: 300, max_passes: 1_000_000 } });
  await page.goto(visitor.url + path);
  const picture = page.getByAltText("The view door of the room");
  const drawn = () => picture.evaluate((image) => (image.complete && image.naturalWidth === 80 ? image.src : ""));
  await picture.waitFor();
  await page.locator(".accurate p", { hasText: "% of the map so far" }).waitFor();
  await until(drawn, "a job that runs has no picture");
  const first = await drawn();
  await until(async () => ![first, ""].includes(await drawn()), "a later pass has no picture of its own");
  assert.equal((await visitor.get(`/v1${path}`)).body.status, "running");
  await page.getByRole("button", { name: "Stop" }).click();
  await until(async () => (await visitor.get(`/v1${path}`)).body.status === "cancelled", "the job runs on");
  await visitor.open("/");
}
