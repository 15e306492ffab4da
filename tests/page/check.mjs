// What visitors do on the page, in headless Chromium. Usage: check.mjs URL FOLDER, the folder for what is to be looked at.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import * as answers from "./answers.mjs";
import { dividesColumns, fills, fillsAJob } from "./fills.mjs";
import * as jobPages from "./job_pages.mjs";
import { opensOldLinks } from "./links.mjs";
import * as liveJob from "./live_job.mjs";
import * as modules from "./modules.mjs";
import * as openings from "./openings.mjs";
import * as outlines from "./outlines.mjs";
import * as outside from "./outside.mjs";
import { drawsAHall, drawsPartitions, touches, types, typesAPlace } from "./plans.mjs";
import * as sensors from "./sensors.mjs";
import * as view3d from "./view3d.mjs";
import { Visitor, browser, middle, until } from "./visit.mjs";
import * as year from "./year.mjs";

const [, , url, folder] = process.argv;
const shot = (name) => join(folder, `${name}.png`);
const chromium = await browser();

/** A tube that follows the hand; a last number that a fresh job gives, too. */
async function drags(visitor) {
  const { page } = visitor;
  await visitor.open("/");
  await page.locator("#mean").waitFor();
  await visitor.rests();

  const jobs = async () => (await visitor.get("/v1/jobs?limit=500")).body.jobs.length;
  const held = (await jobs()) - 1;
  const before = await visitor.state();
  const [x, y] = await middle(page.locator(".tube .ring").first());
  await page.mouse.move(x, y);
  await page.mouse.down();
  const times = [];
  let last = before.draft.tubes[0].centre_m.join();
  for (let step = 1; step <= 20; step++) {
    const start = performance.now();
    await page.mouse.move(x + 4 * step, y - 3 * step);
    await page.waitForFunction((of) => seen.draft.tubes[0].centre_m.join() !== of, last, { polling: "raf" });
    await visitor.current();
    last = (await visitor.state()).draft.tubes[0].centre_m.join();
    times.push(performance.now() - start);
  }
  await page.mouse.up();
  await visitor.rests();
  const { draft, job, grid } = await visitor.state();
  assert.notDeepEqual(draft.tubes[0].centre_m, before.draft.tubes[0].centre_m);
  assert(
    draft.tubes[0].centre_m.every((metres) => Number.isInteger(Math.round(metres * 1e6) / 1e4)),
    "whole centimetres",
  );
  assert.deepEqual(job.document.tubes[0].centre_m, draft.tubes[0].centre_m);
  const posted = { ...draft, stop: { relative_error: 0.01 } };
  const answer = await fetch(`${url}/v1/jobs`, {
    method: "POST",
    headers: { "Content-Type": "application/json", Prefer: "wait=50" },
    body: JSON.stringify(posted),
  });
  const own = (await answer.json()).grid_results.workplane.statistics;
  const of = grid.statistics.mean_lux;
  assert.equal(of, own.mean_lux, "the same document gives the same bits");
  assert(Math.abs((await visitor.mean()) - of) <= 0.5, "the page shows the mean of its grid");
  // one of the page, one of ours; the rest is deleted soon
  await until(async () => (await jobs()) - held <= 2, "jobs are left of a drag");
  times.sort((a, b) => a - b);
  console.log(`  dragged a tube over 20 steps: ${Math.round(times[10])} ms in the median, ${of.toFixed(1)} lx in the end`);
}

/** Every room to begin with has the result that a fresh job gives. */
async function opensRooms(visitor) {
  const { page } = visitor;
  await visitor.open("/#d=abc");
  const told = page.getByText("The link holds no document that can be read");
  await told.waitFor();
  // another one in an open page changes nothing
  await told.waitFor({ state: "detached" });
  const { draft: shown } = await visitor.state();
  await page.evaluate(() => (location.hash = "#d=abcd"));
  await told.waitFor();
  await page.waitForFunction(() => location.hash.length > 100);
  assert.deepEqual((await visitor.state()).draft, shown);
  await visitor.open("/");
  for (const name of ["corridor", "office", "attic", "thesis", "bathroom"]) {
    const { draft, grid } = JSON.parse(readFileSync(`web/presets/${name}.json`, "utf8"));
    await page.locator("#preset").selectOption(name);
    await visitor.holds((of) => seen.draft.name === of && seen.answer.stored !== true, draft.name);
    await visitor.rests();
    const [stored, fresh] = [grid.statistics, (await visitor.state()).grid.statistics];
    const error = Math.hypot(fresh.mean_lux_standard_error, stored.mean_lux_standard_error);
    const [a, b] = [stored.mean_lux, fresh.mean_lux];
    assert(
      Math.abs(a - b) <= 4 * error,
      `${name}: stored with ${a} lx, a fresh job gives ${b}: node tests/page/presets.mjs makes it anew`,
    );
  }
}

/** What each accuracy would take is asked for by a press alone, and is the draft's: after a change it is gone. */
async function predicts(visitor) {
  const { page } = visitor;
  const asked = [];
  page.on("request", (request) => request.url().includes("/v1/plan") && asked.push(request.url()));
  await page.getByRole("slider", { name: "Diameter" }).first().fill("0.32");
  await visitor.rests();
  assert.deepEqual(asked, []);
  await visitor.opens("How sure?");
  await page.getByRole("button", { name: "What would each accuracy take?" }).click();
  const rows = page.locator("#predicted tbody tr");
  await rows.first().waitFor();
  assert.equal(await rows.count(), 5);
  const texts = (await rows.allInnerTexts()).map((text) => text.replaceAll("\u202f", " ").replaceAll(/\s+/g, " "));
  const told = await page.evaluate(() => seen.prediction.told.grids);
  const planned = told.methods.find((row) => row.planned);
  for (const [index, text] of texts.entries()) {
    const share = [0.05, 0.02, 0.01, 0.005, 0.001][index];
    const at = ({ accuracies }) => accuracies.find(({ relative_error: error }) => error === share);
    const { seconds } = at(planned);
    const known = /^[\d.]+ % ([\d.]+ (ms|s|min)|> 1 h) ([\d.]+ (ms|s|min)|> 1 h) to ([\d.]+ (ms|s|min)|> 1 h|more)/;
    // a trial on a busy machine may not get as far
    assert.match(text, seconds ? known : /^[\d.]+ % not known/, text);
    const cheapest = told.methods.find((row) => at(row)?.cheapest);
    const name = cheapest === planned ? "the same" : (cheapest?.method.replaceAll("_", " ") ?? "not known");
    assert(text.includes(name), `${text}: ${name}`);
    if (seconds >= 10 && seconds < 90) assert(text.includes(`${seconds.toFixed(0)} s`), text);
  }
  assert.equal(asked.length, 1);
  await visitor.isAccessible("the prediction");
  await page.getByRole("slider", { name: "Diameter" }).first().fill("0.3");
  await page.locator("#predicted").waitFor({ state: "detached" });
  await visitor.rests();
}

/** Another sky: another number, and daylight factors under an overcast one. */
async function changesTheSky(visitor) {
  const { page } = visitor;
  const before = await visitor.mean();
  await page.getByRole("radio", { name: "overcast (1)", exact: true }).check();
  await visitor.rests();
  const after = await visitor.mean();
  assert(after < before / 3, `${before} lx under a clear sky with sun, ${after} under an overcast one`);
  await page.getByRole("button", { name: "Daylight factor" }).click();
  await page.locator(".scale text", { hasText: "%" }).waitFor();
  const level = page.getByLabel("Light of the sky outside");
  await level.fill("10000");
  await level.press("Enter");
  await visitor.rests();
  assert.equal((await visitor.state()).grid.external_horizontal_illuminance_lux.sky, 10000);
  await level.fill("");
  await level.press("Enter");
  assert(!("diffuse_horizontal_illuminance_lux" in (await visitor.state()).draft.sky));
  await page.locator("#city").fill("Nairobi");
  await page.locator("#city").press("Enter");
  await visitor.rests();
  assert.match((await visitor.state()).draft.time, /\+03:00$/);
}

/** What the service refuses stands at the field. */
async function errs(visitor) {
  const { page } = visitor;
  await page.getByLabel("Mirror reflects").first().fill("1.5");
  await page.getByLabel("Mirror reflects").first().press("Enter");
  const fault = page.locator(".field", { hasText: "Mirror reflects" }).first().locator(".fault");
  await fault.waitFor();
  assert.match(await fault.innerText(), /1\.5/);
  await visitor.isAccessible("a fault");
  await page.getByLabel("Mirror reflects").first().fill("0.98");
  await page.getByLabel("Mirror reflects").first().press("Enter");
  await fault.waitFor({ state: "detached" });
  await visitor.rests();
  // a service that is away is asked again
  await visitor.context.setOffline(true);
  await page.locator(".tube").first().focus();
  await page.keyboard.press("ArrowUp");
  await page.getByRole("alert").getByText("the service does not answer").waitFor();
  await visitor.context.setOffline(false);
  await visitor.rests();
  await page.getByRole("alert").waitFor({ state: "detached" });
  // what the console has of it
  visitor.faults = visitor.faults.filter((text) => !text.includes("422") && !text.includes("ERR_INTERNET_DISCONNECTED"));
}

/** Sharper, until the error is there; a picture, its files; two variants. */
async function sharpens(visitor) {
  const { page } = visitor;
  await visitor.opens("How sure?");
  await page.getByRole("button", { name: /^1\s%/ }).click();
  await page.getByRole("button", { name: /^0\.5\s%/ }).click();
  await page.waitForFunction(
    () => document.querySelector("#error")?.textContent && Number.parseFloat(document.querySelector("#error").textContent) <= 0.5,
  );
  await visitor.rests();
  const { job } = await visitor.state();
  assert(job.accuracy.relative_error <= 0.005 && job.stopped_by === "relative_error", JSON.stringify(job.accuracy));
  await page.getByRole("button", { name: "Keep as A" }).click();
  await page.getByRole("radio", { name: /^bright haze/ }).check();
  await visitor.rests();
  await page.locator(".compare figure").nth(2).waitFor();
  assert.match(await page.locator(".compare figcaption").nth(2).innerText(), /B − A: \+/);
}

/** Where the light comes from, in the mean and under the cursor; and what another method finds. */
async function seesParts(visitor) {
  const { page } = visitor;
  await page.getByRole("button", { name: "By tube" }).click();
  await visitor.holds(() => seen.current && !seen.running && seen.answer?.grid?.by_tube);
  const { draft, grid } = await visitor.state();
  const sum = (parts) => parts.reduce((all, { mean_lux }) => all + mean_lux, 0);
  for (const parts of [grid.by_tube, Object.values(grid.components)])
    assert(Math.abs(sum(parts) / grid.statistics.mean_lux - 1) < 1e-9, "the parts are the whole");
  assert.equal(grid.by_tube.length, draft.tubes.length);
  const rows = page.locator(".origins tbody tr");
  assert.equal(await rows.count(), grid.by_tube.length + Object.keys(grid.components).length);
  await page.locator(".plan").hover({ position: { x: 200, y: 200 } });
  await page.locator(".readout", { hasText: /tube 1 \d+\s%/ }).waitFor();
  await visitor.isAccessible("the light in parts");
  await visitor.looksAsIn(shot("parts"));
  await page.getByRole("button", { name: "Second opinion" }).click();
  await page.locator(".check", { hasText: "agrees within" }).waitFor();
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByRole("button", { name: "Undo" }).click();
  await visitor.rests();
  assert.equal(await rows.count(), 0);
}

async function takesAPicture(visitor) {
  const { page } = visitor;
  await page.getByRole("button", { name: "Render the picture" }).click();
  await page.locator(".view img").waitFor();
  // who is fast has it all by now
  await page
    .locator(".view")
    .getByRole("button", { name: "Stop" })
    .click({ timeout: 500 })
    .catch(() => {});
  const link = page.locator(".view").getByRole("link", { name: "EXR" });
  await link.waitFor();
  const [download] = await Promise.all([page.waitForEvent("download"), link.click()]);
  assert.equal(download.suggestedFilename(), "room.exr");
  assert.deepEqual([...readFileSync(await download.path()).subarray(0, 4)], [0x76, 0x2f, 0x31, 0x01]);
  const size = await page
    .locator(".view img")
    .evaluate(async (image) => (await image.decode(), [image.naturalWidth, image.naturalHeight]));
  assert.deepEqual(size, [480, 360]);
  await page.locator(".view").getByRole("button", { name: "Luminances" }).click();
  const scale = page.getByAltText("Luminances of the room");
  assert(await scale.evaluate(async (image) => (await image.decode(), image.naturalWidth > 300)));
}

/** A long job ends when it is asked to; the better result stays. */
async function cancels(visitor) {
  const { page } = visitor;
  // the sun through a clear closure: hours to 0.1 %
  await page.getByLabel("Diffuser", { exact: true }).first().selectOption("clear");
  await visitor.current();
  const before = (await visitor.state()).job.progress.relative_error ?? Infinity;
  await page.getByRole("button", { name: /^0\.1\s%/ }).click();
  const id = await page.waitForFunction(() => seen.running?.id).then((handle) => handle.jsonValue());
  await page.waitForFunction(() => seen.passes.length > 3);
  await page.locator(".accurate").getByRole("button", { name: "Stop" }).click();
  await visitor.holds(() => !seen.running);
  const { body } = await visitor.get(`/v1/jobs/${id}`);
  assert.equal(body.status, "cancelled");
  assert(((await visitor.state()).job.progress.relative_error ?? Infinity) <= before, "a worse result took a better one's place");
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByRole("button", { name: /^1\s%/ }).click();
  await visitor.rests();
}

/** A model of a tube becomes one. */
async function bringsAModel(visitor) {
  const { page } = visitor;
  await page.locator(".drop input").setInputFiles("examples/mesh_tube.obj");
  await page.locator(".card", { hasText: "A model with 3 materials" }).waitFor();
  const { draft } = await visitor.state();
  const model = draft.tubes.at(-1);
  assert.deepEqual(
    Object.entries(model.parts)
      .map(([name, { role }]) => [name, role])
      .sort(),
    [
      ["diffuser", "diffuser"],
      ["dome", "collector"],
      ["pipe", "pipe"],
    ],
  );
  await page.getByLabel("Opening, m").fill("0.2544");
  await page.getByLabel("Opening, m").press("Enter");
  await visitor.holds(() => seen.current && seen.answer?.job.tubes.length === seen.draft.tubes.length);
  await page.locator(".section .models path.pipe:not(.edge)").waitFor();
  await page.getByRole("button", { name: `Remove tube ${draft.tubes.length}` }).click();
  await visitor.current();
}

/** A link holds the document; programs show it; the job has a page. */
async function shares(visitor) {
  const { page } = visitor;
  const programs = { Python: ["python3", "-c"], curl: ["bash", "-c"] };
  for (const [language, [command, flag]] of Object.entries(programs)) {
    await page.getByRole("button", { name: language }).click();
    const text = await page.getByLabel(`${language} program`).innerText();
    assert.match(text, /"cie_type": 11/);
    const { status, stdout, stderr } = spawnSync(command, [flag, text], { encoding: "utf8" });
    assert.equal(status, 0, stderr);
    assert.match(stdout, language === "Python" ? /^workplane [\d.]+ lx/ : /"grid_results":\{"workplane"/);
  }
  // the report judges the target of the page; a job that sharpens would take the place of the first one, and delete it
  await visitor.rests();
  const reported = await page.locator(".take").getByRole("link", { name: "report", exact: true }).getAttribute("href");
  const goal = await page.evaluate(() => seen.goal);
  const report = await (await fetch(visitor.url + reported)).text();
  assert.match(report, new RegExp(`<p class="sentence \\w+">(The|Whether the) target of ${goal.lux} lx[^:]* is `));
  await page.getByRole("button", { name: "Jobs" }).click();
  await page.locator(".jobs tbody tr").first().waitFor();
  await visitor.looksAsIn(shot("editor-wide-light"));
  await visitor.isAccessible("editor, wide, light");
  await page.getByRole("button", { name: "Share" }).click();
  await page.waitForURL(/#d=/);
  const { draft } = await visitor.state();
  const second = await Visitor.of(chromium, url.replace("127.0.0.1", "page.test"), {
    viewport: { width: 390, height: 844 },
    colorScheme: "dark",
    hasTouch: true,
  });
  const { hash } = new URL(page.url());
  await second.open(`/${hash}`);
  await second.rests();
  assert.deepEqual((await second.state()).draft, draft);
  for (const drawer of await second.page.locator(".drawer > summary, .sure > summary").all()) await drawer.click();
  await second.looksAsIn(shot("editor-narrow-dark"));
  await second.isAccessible("editor, narrow, dark");
  await second.page.getByRole("button", { name: "Jobs" }).click();
  await second.page.locator(".jobs tbody tr").first().waitFor();
  const [name, table] = await second.page.locator(".jobs tbody").evaluate((body) => [body.querySelector("td"), body].map((one) => one.clientWidth));
  assert(name > 0.95 * table, "a long name has the width of a phone");
  await second.looksAsIn(shot("jobs-narrow-dark"));
  await second.page.getByRole("button", { name: "Jobs" }).click();
  await second.page.emulateMedia({ colorScheme: "light" });
  await second.isAccessible("editor, narrow, light");
  const [path] = (await second.page.locator(".take").getByRole("link", { name: "page of this job" }).getAttribute("href")).split("?");
  await second.page.goto("about:blank");
  const gone = async () => (await visitor.get(`/v1${path}`)).status === 404;
  await until(gone, "a job that nobody refers to is left with its page");
  await second.close();
}

async function readsAJob(visitor) {
  const { page } = visitor;
  const link = page.locator(".take").getByRole("link", { name: "page of this job" });
  const [path] = (await link.getAttribute("href")).split("?");
  const judged = await page.locator(".verdict").innerText();
  await link.click();
  await page.locator(".about").waitFor();
  const same = async () => (await page.locator(".verdict").innerText()) === judged;
  await until(same, `the page of the job has another verdict than the editor: ${judged}`);
  const { body } = await visitor.get(`/v1${path}`);
  assert.equal(body.links.page, path);
  await page
    .getByRole("cell", { name: /^(met|extrapolated)$/ })
    .first()
    .waitFor();
  const looks = async (name) => {
    for (const colorScheme of ["light", "dark"]) {
      for (const width of [1280, 390]) {
        await page.setViewportSize({ width, height: 900 });
        await page.emulateMedia({ colorScheme });
        await visitor.isAccessible(`${name}, ${width} px, ${colorScheme}`);
        await visitor.looksAsIn(shot(`${name}-${width}-${colorScheme}`));
      }
    }
    await page.setViewportSize({ width: 1280, height: 900 });
  };
  await looks("job");
  await page.getByRole("link", { name: "Report", exact: true }).click();
  await page.getByRole("heading", { name: "Method" }).waitFor();
  const drawn = await page.locator("img").evaluateAll((all) => Promise.all(all.map((one) => one.decode())));
  assert.equal(drawn.length, 2);
  await looks("report");
  await page.pdf({ path: shot("report-printed").replace(/png$/, "pdf"), preferCSSPageSize: true, printBackground: true });
  await page.goBack();
  await page.getByRole("link", { name: "Edit a copy" }).click();
  await page.waitForURL(/#d=/);
  await visitor.arrived();
  await page.locator(".tube").first().waitFor();
  await visitor.rests();
  await visitor.looksAsIn(shot("editor-wide-dark"));
  await visitor.isAccessible("editor, wide, dark");
}

try {
  const visitor = await Visitor.of(chromium, url);
  for (const does of [
    opensRooms,
    opensOldLinks,
    drawsAHall,
    fills,
    dividesColumns,
    ...Object.values(jobPages),
    fillsAJob,
    drags,
    ...Object.values(modules),
    ...Object.values(outlines),
    ...Object.values(liveJob),
    ...Object.values(answers),
    ...Object.values(outside),
    ...Object.values(openings),
    ...Object.values(sensors),
    ...Object.values(view3d),
    ...Object.values(year),
    types,
    typesAPlace,
    drawsPartitions,
    predicts,
    touches,
    changesTheSky,
    errs,
    sharpens,
    seesParts,
    takesAPicture,
    cancels,
    bringsAModel,
    shares,
    readsAJob,
  ]) {
    const start = performance.now();
    await does(visitor, shot).catch(async (error) => {
      await visitor.page.screenshot({ path: shot("failed"), fullPage: true });
      console.error(visitor.faults);
      throw error;
    });
    console.log(`  ${does.name}: ${((performance.now() - start) / 1000).toFixed(1)} s`);
  }
  await visitor.close();
} finally {
  await chromium.close();
}
