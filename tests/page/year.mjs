// The year: what its modules compute, its job against a service in the test's hand, and a visitor who drops a weather file.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { until } from "./visit.mjs";

/** A file of NumPy: float32 by rows. */
function npy(rows, columns, values, descr = "<f4") {
  const header = `{'descr': '${descr}', 'fortran_order': False, 'shape': (${rows}, ${columns}), }`.padEnd(117) + "\n";
  const bytes = Buffer.alloc(128 + 4 * values.length);
  bytes.write("\x93NUMPY\x01\x00\x76\x00" + header, "latin1");
  values.forEach((value, i) => bytes.writeFloatLE(value, 128 + 4 * i));
  return bytes;
}

/** Arrays of NumPy are read; others, and those that are cut, are refused. */
export async function readsArrays({ page }) {
  const whole = npy(2, 3, [1, 2, 3, 4, 5.5, NaN]);
  const cases = [whole, npy(2, 3, [1, 2, 3, 4, 5, 6], "<f8"), whole.subarray(0, 140), Buffer.from("month,day,hour\n")];
  const read = await page.evaluate(async (cases) => {
    const { readNpy } = await import("/web/npy.js");
    return cases.map((bytes) => {
      try {
        const { rows, columns, values } = readNpy(new Uint8Array(bytes).buffer);
        return [rows, columns, ...values].map(String);
      } catch {
        return "refused";
      }
    });
  }, cases.map((bytes) => [...bytes]));
  assert.deepEqual(read, [["2", "3", "1", "2", "3", "4", "5.5", "NaN"], "refused", "refused", "refused"]);
}

/** Hours are found by day and hour, and their mean is over the area that has values. */
export async function arrangesHours({ page }) {
  const of = await page.evaluate(async () => {
    const { hoursOf, byHour, dayOf, lightNeeded, luxAt, months, recordAt, rowsAt } = await import("/web/year.js");
    // two days from 31 January on, with records of half an hour: the number of the record times 1, 2 and 3; one sensor without a value
    const columns = 96;
    const values = new Float32Array(4 * columns);
    for (let record = 0; record < columns; record++) [1, 2, NaN, 3].forEach((times, sensor) => (values[sensor * columns + record] = times * record));
    const grid = { x_m: [0, 1], area_m2: [[1, 1], [0, 2]] };
    const hours = hoursOf({ rows: 4, columns, values }, grid, 2, { year: 2017, day: 31 });
    const strip = byHour(hours);
    const { pinned } = await import("/web/year_plan.js");
    // five columns of three rows, of which the middle has no value, nor what is left of it and above
    const areas = [1, 1, 1, 1, 1, 1, 0, 0, 1, 1, 1, 0, 0, 1, 1];
    return {
      followed: pinned({ grid: { x_m: [0, 1, 2, 3, 4], y_m: [0, 1, 2] }, hours: { areas, across: 5 } }),
      days: hours.days,
      largest: hours.largest,
      // (1 + 2 + 2 * 3) / 4 of the record
      mean: [hours.mean[0], hours.mean[1], hours.mean[95]],
      records: [recordAt(hours, 1, 0), recordAt(hours, 1, 23.5), recordAt(hours, 2, 12), recordAt(hours, 9, 0)],
      lux: luxAt(hours, 1, recordAt(hours, 2, 12)),
      rows: rowsAt(hours, 10).map((row) => row.map(String)),
      strip: [strip.length, strip[0].length, strip[0][0], strip[12][1]],
      day: [dayOf(hours, 3, 2).length, dayOf(hours, 3, 2)[0], dayOf(hours, null, 1)[2]],
      months: months(hours),
      // records 16..35 and 64..83 count from 8 to 18 h; half of them have 64 or more: 1, 2 and 3 times that, and all of the area needs the least
      needed: [["most", 95], ["half", 50]].map(([, part]) => lightNeeded(hours, "lm83", 640, part)),
      daylight: lightNeeded(hours, "daylight_hours", 720, 100),
    };
  });
  assert.deepEqual(of, {
    followed: [2, 0],
    ...{ days: 2, largest: 285, mean: [0, 2.25, 95 * 2.25], records: [0, 47, 72, 95], lux: 144, rows: [["10", "20"], ["NaN", "30"]] },
    // the mean of records 0 and 1, and of 72 and 73
    ...{ strip: [24, 2, 1.125, 72.5 * 2.25], day: [48, 144, 4.5] },
    months: [{ month: 0, from: 1, to: 2 }, { month: 1, from: 2, to: 3 }],
    needed: [10, 10 / 3],
    daylight: 10,
  });
}

/** A year is judged by the interval of its share, in words that tell it from the limit. */
export async function judgesYears({ page }) {
  const told = await page.evaluate(async () => {
    const { bracketed, criterion, judge, yearSentence } = await import("/web/year_sentence.js");
    const grid = {
      autonomies: [{ lux: 300, da_percent: { value: 51, low: 50, high: 52 } }],
      sda_percent: { value: 71, low: 69, high: 73 },
    };
    const plain = (text) => text.replaceAll("\u202f", " ");
    const of = (goal, schedule, sda) => {
      const { asked, is, found } = yearSentence(grid, { lux: 300, of: goal }, schedule, sda);
      return plain(`${asked}: ${is}, ${found}`);
    };
    return [
      of("most", "daylight_hours"),
      of("half", "weekdays"),
      of("mean", "lm83"),
      of("mean", "hours", { threshold_lux: 500, time_percent: 60 }),
      // no number of the year is on these targets
      String(judge(grid, { lux: 300, of: "half" }, { threshold_lux: 500 }).value),
      String(judge(grid, { lux: 400, of: "mean" }).value),
      plain(yearSentence({ ...grid, sda_percent: { value: 95, low: 94, high: 96 } }, { lux: 300, of: "most" }, "lm83").is),
      plain(bracketed({ value: 94.96, low: 94.9, high: 94.99, limit: 95 }, "%")),
      plain(criterion({ scheme: "BREEAM", clause: "hours", value: 1200, low: 1190, high: 1210, limit: 2000, unit: "h", verdict: "fail" }).found),
    ];
  });
  assert.deepEqual(told, [
    "300 lx on 95 % of the area for half of the daylight hours: fails, 71 % [69, 73].",
    "300 lx on half of the area for half of the hours from 8 to 18 on weekdays: passes, 71 % [69, 73].",
    "300 lx for half of the hours from 8 to 18, in the mean over the area: passes, 51 % of the hours [50, 52].",
    "300 lx for 60 % of the hours that count, in the mean over the area: fails, 51 % of the hours [50, 52].",
    "NaN",
    "NaN",
    "undecided",
    "94.96 % [94.90, 94.99]",
    "1200 h [1190, 1210]",
  ]);
}

/** The search for more tubes finds the least number that passes in few trials, and says what it tried. */
export async function searchesTubes({ page }) {
  const found = await page.evaluate(async () => {
    const { inWords, search } = await import("/web/year_search.js");
    const most = { count: 24, trials: 6 };
    /** Passes from `least` on; more than `room` have none. */
    const of = async (least, room, guess) => {
      let last;
      const trial = async (count) => (count > room ? null : { count, value: (50 * count) / least, passes: count >= least });
      await search(trial, guess, most, (told) => (last = told));
      return [last.count, last.isLeast, last.tried.length, inWords(last, 0.35, 4.26).replaceAll("\u202f", " ")];
    };
    return [await of(2, 24, 2), await of(9, 24, 8), await of(1, 24, 7), await of(30, 24, 20), await of(12, 5, 12), await of(1, 0, 1), await of(3, 4, 24)];
  });
  const counts = found.map(([count, isLeast]) => [count, isLeast]);
  assert.deepEqual(counts, [[2, true], [9, true], [1, true], [null, false], [null, false], [null, false], [3, true]]);
  assert(found.every(([, , trials]) => trials <= 6), JSON.stringify(found));
  assert.equal(found[0][3], "It takes about 4.3 times the light. About 2 more tubes of 0.35 m would do (not surely enough: 1 with 25 %; enough: 2 with 50 %).");
  assert.match(found[3][3], /No number of more tubes of 0.35 m that was tried would do \(not surely enough: 20 with 33 %, 24 with 40 %\)\.$/);
  assert.match(found[5][3], /No more tubes of 0.35 m have room\.$/);
}

/** A change ends the year that is on its way, and deletes its job; outside the tab nothing is computed; a year that passes is not searched for. */
export async function dropsOldYears({ page }) {
  const told = await page.evaluate(async () => {
    const { YearJob } = await import("/web/year_job.js");
    const { state: shared } = await import("/web/state.js");
    const [posts, deleted] = [[], []];
    const state = { tab: "moment", target: 0.02, draft: { room: { size_m: [2, 2, 2] }, tubes: [] }, goal: { lux: 300, of: "half" }, year: { ...shared.year, weather: { id: "w", report: { from: "01-01" } }, answer: null } };
    const set = (values) => Object.assign(state, values);
    const service = {
      postJob: (document) => new Promise((resolve) => posts.push({ document, answers: () => resolve({ id: String(posts.length) }) })),
      follow: (id, heard, signal) => new Promise((_, reject) => signal.addEventListener("abort", () => reject(signal.reason))),
      deleteJob: async (id) => void deleted.push(id),
    };
    const job = new YearJob(service, { state, set });
    const rest = () => new Promise((resolve) => setTimeout(resolve, 700));
    const told = [];
    job.follow();
    await rest();
    told.push(posts.length);
    set({ tab: "year" });
    job.follow();
    await rest();
    told.push(posts.length, posts[0].document.annual.sda.threshold_lux, posts[0].document.stop.relative_error);
    set({ draft: { ...state.draft } });
    job.follow();
    posts[0].answers();
    await rest();
    told.push(posts.length, deleted.join());
    posts[1].answers();
    await rest();
    set({ target: 0.001 });
    job.follow();
    await rest();
    told.push(posts[2].document.stop.relative_error);
    set({ tab: "moment" });
    job.follow();
    posts[2].answers();
    await rest();
    return [...told, deleted.join(), state.year.running];
  });
  assert.deepEqual(told, [0, 1, 300, 0.01, 2, "1", 0.001, "1,2,3", null]);
}

/** Enters the target. */
async function aims(page, lux, of) {
  await page.getByLabel("Target, lx").fill(String(lux));
  await page.getByLabel("Target, lx").press("Enter");
  await page.getByLabel("To be met").selectOption(of);
}

const yearRests = (visitor) => visitor.holds(() => seen.year.current && (!seen.year.search || seen.year.search.ended));

/** A weather file is dropped; the year is judged, more tubes are found and added; the hours are those of the service's array; a link holds it all. */
export async function readsAYear(visitor, shot) {
  const { page } = visitor;
  await visitor.open("/");
  await page.getByRole("button", { name: "A year" }).click();
  await page.locator("#synthetic").waitFor();
  await visitor.rests();
  await looks(visitor, (name) => shot(`year-none-${name}`));
  await page.locator("#preset").selectOption("thesis");
  await page.waitForFunction(() => seen.draft.name === "Test room");
  await aims(page, 160, "half");
  const file = await page.evaluateHandle(
    (text) => {
      const all = new DataTransfer();
      all.items.add(new File([text], "synthetic.epw"));
      return all;
    },
    readFileSync("examples/synthetic.epw", "utf8"),
  );
  await page.getByRole("button", { name: "A moment" }).click();
  await page.dispatchEvent("main", "drop", { dataTransfer: file });
  await page.getByText("−30 min from the stamps, as taken").waitFor();
  await visitor.holds(() => seen.year.current);
  const answer = await page.evaluate(() => ({ id: seen.year.answer.job.id, sda: seen.year.answer.of.sda_percent, across: seen.year.answer.hours.across }));
  const { body: summary } = await visitor.get(`/v1/jobs/${answer.id}/annual`);
  assert.deepEqual(summary.grids[0].sda_percent, answer.sda);
  const sentence = (await page.locator(".verdict").innerText()).replaceAll(/\s+/g, " ");
  assert.match(sentence, /^160 lx on half of the area for half of the daylight hours: fails, [\d.]+ % \[[\d.]+, [\d.]+\]\.$/);
  await yearRests(visitor);
  assert.match((await page.locator("#would-do").innerText()).replaceAll("\u202f", " "), /About \d more tubes? of 0.254 m would do \((not surely )?enough: /);
  await looks(visitor, (name) => shot(`year-${name}`));
  await readsHours(visitor, answer);
  await page.locator("#would-do button").click();
  await visitor.holds(() => seen.draft.tubes.length > 1 && !seen.year.current);
  await yearRests(visitor);
  assert.equal(await page.locator("#verdict").innerText(), "passes,");
  assert.equal(await page.locator("#would-do").count(), 0);
  await until(async () => (await visitor.get(`/v1/jobs/${answer.id}`)).status === 404, "the year before is left in the service");
  await followsALink(visitor);
  await readsItsJob(visitor, shot);
  await visitor.open("/");
  await page.locator("#mean").waitFor();
  await visitor.rests();
}

/** Day, hour and point are moved: what is shown is what the service's array has, and nothing is asked of it. */
async function readsHours({ page, url }, { id, across }) {
  const bytes = Buffer.from(await (await fetch(`${url}/v1/jobs/${id}/annual/points.workplane.npy`)).arrayBuffer());
  const start = 10 + bytes.readUInt16LE(8);
  assert.match(bytes.subarray(10, start).toString(), /'<f4'.*\(64, 8760\)/);
  const lux = (column, row, day, hour) => bytes.readFloatLE(start + 4 * ((row * across + column) * 8760 + (day - 1) * 24 + hour));
  const asked = [];
  const heard = (request) => /annual|weather/.test(request.url()) && asked.push(request.url());
  page.on("request", heard);
  const shows = async (expected) => {
    const text = expected.toFixed(1);
    await page.waitForFunction((text) => document.querySelector("#at-point")?.textContent.startsWith(text), text);
  };
  await shows(lux(4, 4, 172, 12));
  await page.getByRole("slider", { name: "Hour" }).fill("9");
  await shows(lux(4, 4, 172, 9));
  await page.getByRole("slider", { name: "Day" }).fill("80");
  await shows(lux(4, 4, 80, 9));
  await page.locator(".readout", { hasText: /on 21 March, 09:00 to 10:00; 160\slx in [\d.]+ ±\s[\d.]+\s% of the hours/ }).waitFor();
  await page.locator(".pin").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowDown");
  await shows(lux(5, 3, 80, 9));
  assert.match(await page.locator(".pin").getAttribute("aria-label"), /^Point 1\.40 m from west, 0\.89 m from south: /);
  await page.getByRole("button", { name: "Lux", exact: true }).click();
  const drawn = await page.evaluate(async () => {
    const { mapOf } = await import("/web/year_plan.js");
    return mapOf(seen.year.answer).rows;
  });
  for (const [row, column] of [[0, 0], [7, 3]]) assert.equal(drawn[row][column], lux(column, row, 80, 9));
  await page.locator(".strip .sheet").click({ position: { x: 1, y: 1 } });
  await page.waitForFunction(() => seen.year.day === 1 && seen.year.hour === 23);
  page.off("request", heard);
  assert.deepEqual(asked, []);
}

/** An address has weather, hours, day, hour, point and map. */
async function followsALink(visitor) {
  const { page } = visitor;
  await page.waitForURL(/&hours=daylight_hours&day=1&hour=23&map=lux&at=5\.3&weather=/);
  const view = () => page.evaluate(() => (({ schedule, day, hour, layer, pin, weather }) => ({ schedule, day, hour, layer, pin, weather }))(seen.year));
  const before = await view();
  await page.reload();
  await visitor.arrived();
  await visitor.holds(() => seen.tab === "year" && seen.year.weather);
  assert.deepEqual(await view(), before);
  await yearRests(visitor);
  // equal weather is the same: nothing is computed anew
  const { id } = await page.evaluate(() => seen.year.answer.job);
  await page.locator("#synthetic").click();
  await page.waitForURL(/&weather=synthetic$/);
  assert.equal(await page.evaluate(() => seen.year.current && seen.year.answer.job.id), id);
}

/** The job of a year has a page with its verdict on the target, as the report has it, its numbers, criteria and figures. */
async function readsItsJob(visitor, shot) {
  const { page } = visitor;
  const link = page.locator(".take").getByRole("link", { name: "page of this job" });
  const [path, query] = (await link.getAttribute("href")).split("?");
  const judged = await page.locator(".verdict").innerText();
  await link.click();
  await page.locator(".year .verdict").waitFor();
  assert.equal(await page.locator(".year .verdict").innerText(), judged);
  // the map is that of the target
  const map = await page.getByAltText("Daylight autonomy").getAttribute("src");
  assert(map.endsWith(`.svg?${query}`), `${map} without ${query}`);
  const report = await page.getByRole("link", { name: "Report", exact: true }).getAttribute("href");
  assert.equal(report, `${path}/report?${query}`);
  const told = await (await fetch(visitor.url + report)).text();
  assert.match(told, /<p class="sentence good">The target of 160 lx on half of the area in 50 % of the occupied hours is met over the year at /);
  await isCopied(visitor, path);
  // without a target the part of the area is told
  await page.goto(visitor.url + path);
  await page.locator(".year .verdict", { hasText: "of the area has 160" }).waitFor();
  const { body } = await visitor.get(`/v1${path}/annual`);
  const share = await page.locator(".year .verdict strong").innerText();
  const { value, low, high } = body.grids[0].sda_percent;
  const numbers = share.match(/[\d.]+/g).map(Number);
  [value, low, high].forEach((of, i) => assert(Math.abs(of - numbers[i]) <= 0.5, `${share} is not ${of}`));
  await page.locator(".year summary").click();
  assert.equal(await page.locator(".year tbody tr").count(), body.grids[0].verdicts.length);
  for (const words of ["Daylight autonomy", "Useful daylight", "Mean by day and hour", "Light of the tubes by day and hour"])
    assert(await page.getByAltText(words).evaluate(async (image) => (await image.decode(), image.naturalWidth > 100)), words);
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme });
    await visitor.isAccessible(`job with a year, ${colorScheme}`);
    await visitor.looksAsIn(shot(`job-year-${colorScheme}`));
  }
  const before = page.viewportSize();
  for (const [width, height] of [[1500, 900], [1920, 1080]]) {
    await page.setViewportSize({ width, height });
    for (const what of ["unfolded", "folded"]) {
      await visitor.fitsColumns();
      await until(async () => !(await visitor.emptiness()).length, `the page of a year, ${what}, ${width} px: ${await visitor.emptiness()}`);
      await page.locator(".year summary").click();
    }
  }
  await page.setViewportSize({ width: 390, height: 844 });
  await visitor.fitsColumns();
  await visitor.looksAsIn(shot("job-year-390"));
  await page.setViewportSize(before);
}

/** A year's job has the name of its weather, and a copy of it opens as a year, with its target, weather and hours. */
async function isCopied(visitor, path) {
  const { page } = visitor;
  const { body } = await visitor.get(`/v1${path}`);
  await page.locator(".about .numbers div", { hasText: /^weather\s*Synthetic$/ }).waitFor();
  const edit = await page.getByRole("link", { name: "Edit a copy" }).getAttribute("href");
  const { draft, goal, year } = await page.evaluate(async (hash) => (await import("/web/share.js")).unpacked(hash), edit.slice(1));
  const { site } = (await visitor.get(`/v1${path}/annual`)).body;
  assert.deepEqual(goal, { lux: 160, of: "half" });
  assert.deepEqual([year.weather, year.schedule], [body.document.annual.weather, "daylight_hours"]);
  assert.deepEqual(draft.location, { latitude_deg: site.latitude_deg, longitude_deg: site.longitude_deg });
  assert(draft.sky && !("annual" in draft));
}

/** Screens of both sizes, light and dark, are full and accessible. */
async function looks(visitor, shot) {
  const { page } = visitor;
  const before = page.viewportSize();
  for (const colorScheme of ["dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    for (const [width, height] of [[390, 844], [1500, 900]]) {
      await page.setViewportSize({ width, height });
      await page.waitForFunction(() => Math.abs(document.querySelector(".plan").getBoundingClientRect().width - seen.sizes.plan[0]) < 1);
      await visitor.looksAsIn(shot(`${width}-${colorScheme}`));
      assert.deepEqual(await visitor.emptiness(), [], `${width} x ${height}`);
      await visitor.isAccessible(`year, ${width} px, ${colorScheme}`);
    }
  }
  await page.setViewportSize(before);
}
