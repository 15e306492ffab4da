// How full the page is: no panel of a screen is empty, and numbers do not scroll.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { deflateRawSync } from "node:zlib";
import { until } from "./visit.mjs";

/** No panel of the first screen is empty by more than a tenth, and no column of panels. */
export async function fills(visitor, shot) {
  const { page } = visitor;
  await visitor.open("/");
  await page.locator("#mean").waitFor();
  await visitor.rests();
  const before = page.viewportSize();
  for (const colorScheme of ["dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    for (const [width, height] of [[1500, 900], [1920, 1080], [390, 844]]) {
      await page.setViewportSize({ width, height });
      await visitor.holds(() => Math.abs(document.querySelector(".plan").getBoundingClientRect().width - seen.sizes.plan[0]) < 1);
      await visitor.looksAsIn(shot(`editor-${width}-${colorScheme}`));
      assert.deepEqual(await visitor.emptiness(), [], `${width} x ${height}`);
      const below = await page.evaluate(() => document.documentElement.scrollHeight - innerHeight);
      assert(width < 1200 || below <= 1, `the page ends ${below} px below the screen`);
    }
  }
  // the list of jobs changes nothing below it
  await page.setViewportSize({ width: 1500, height: 900 });
  const planHeight = async () => (await page.locator(".stage > .map").boundingBox()).height;
  await visitor.holds(() => Math.abs(document.querySelector(".plan").getBoundingClientRect().width - seen.sizes.plan[0]) < 1);
  const whole = await planHeight();
  await page.getByRole("button", { name: "Jobs" }).click();
  const list = page.getByRole("region", { name: "Jobs", exact: true });
  await list.waitFor();
  assert.equal(await planHeight(), whole);
  await list.getByRole("button", { name: "Close" }).focus();
  await page.keyboard.press("Escape");
  await list.waitFor({ state: "detached" });
  // beside and below plans of any proportions, with the light of each tube, too
  const sizes = [[1500, 900], [1920, 1080]];
  const fits = () => page.locator(".all-numbers").evaluate((panel) => panel.scrollHeight <= panel.clientHeight && panel.querySelectorAll("tr").length > 3);
  for (const name of ["corridor", "office", "attic", "thesis"]) {
    const { draft } = JSON.parse(readFileSync(`web/presets/${name}.json`, "utf8"));
    await page.locator("#preset").selectOption(name);
    await visitor.holds((of) => seen.draft.name === of && seen.answer, draft.name);
    await visitor.rests();
    const isFull = async (what) => {
      for (const [width, height] of sizes) {
        await page.setViewportSize({ width, height });
        await until(fits, `the numbers of the ${what} scroll`);
        await until(async () => !(await visitor.emptiness()).length, `${what}, ${width} x ${height}: ${await visitor.emptiness()}`);
      }
      await page.setViewportSize({ width: 1500, height: 900 });
    };
    await isFull(name);
    await page.getByRole("button", { name: "By tube" }).click();
    await visitor.holds(() => seen.current && seen.answer?.grid?.by_tube);
    await page.locator(".origins").waitFor();
    await isFull(`${name} by tube`);
    await visitor.looksAsIn(shot(`by-tube-${name}`));
  }
  // of many tubes each is folded, and what is folded takes no space; a tube below a ridge leaves no space above it
  for (const [name, tubes] of [["office_of_40_tubes", 40], ["attic", 1]]) {
    const { views, ...document } = JSON.parse(readFileSync(`examples/${name}.json`, "utf8"));
    await page.goto("about:blank");
    await visitor.open(`/#d=${deflateRawSync(JSON.stringify(document)).toString("base64url")}`);
    await visitor.holds((count) => seen.current && seen.answer?.job.tubes?.length === count, tubes);
    // a slope is seen from the side
    assert.equal(await page.evaluate(() => seen.look), name === "attic" ? "west" : "north");
    for (const [width, height] of [...sizes, [390, 844]]) {
      await page.setViewportSize({ width, height });
      await visitor.holds(() => Math.abs(document.querySelector(".plan").getBoundingClientRect().width - seen.sizes.plan[0]) < 1);
      await until(async () => !(await visitor.emptiness()).length, `${name}, ${width} x ${height}: ${await visitor.emptiness()}`);
    }
  }
  await visitor.open("/");
  await page.setViewportSize(before);
}

/** Columns of a job's page end at about the same height by their widths, where moving panels cannot make them. */
export async function dividesColumns({ page }) {
  const found = await page.evaluate(async () => {
    const { columns } = await import("/web/columns.js");
    const ends = ({ widths, of }, height) => widths.map((width, at) => of.reduce((sum, column, panel) => sum + (column === at ? height(panel, width) + 12 : 0), 0));
    const texts = [220, 380, 560, 290, 390, 240, 120];
    // a text is the lower the wider it is; in equal columns these would end at 704 and 794
    const text = (panel, width) => (texts[panel] * 481) / width;
    // drawings are the higher the wider they are
    const drawing = (panel, width) => (panel === 1 ? 1.35 : 0.9) * width;
    // with the map in the middle these would end at 630
    const mixed = (panel, width) => [(260 * 620) / width, 0.75 * width, 0.5 * width, (330 * 620) / width, (280 * 620) / width][panel];
    return [
      [columns(texts.length, 1468, text), text],
      [columns(3, 1468, drawing), drawing],
      [columns(5, 1888, mixed, { map: 1, least: 1000 }), mixed],
      [columns(2, 1248, drawing), drawing],
    ].map(([of, height]) => ({ ...of, ends: ends(of, height) }));
  });
  for (const { widths, of, ends } of found) {
    assert.equal(of[0], 0, "the first panel is the first of the page");
    assert(Math.min(...ends) > 0.93 * Math.max(...ends), `columns of ${widths} end at ${ends}`);
  }
  assert.deepEqual(found.map(({ widths }) => widths.length), [3, 3, 3, 2]);
  assert(Math.max(...found[2].ends) > 700, `a short page ends at ${found[2].ends}`);
}

/** Labels of lines stand on no partition and on no number of a tube. */
async function keepsLabelsFree(page) {
  const { labels, marks } = await page.locator(".map .plan").evaluate((plan) => {
    const boxes = (of) => [...plan.querySelectorAll(of)].map((one) => one.getBoundingClientRect()).map(({ left, right, top, bottom }) => ({ left, right, top, bottom }));
    return { labels: boxes("text.level"), marks: boxes(".partition line, text.tube-number") };
  });
  assert(labels.length > 2 && marks.length === 3, `${labels.length} labels, ${marks.length} marks`);
  const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  for (const label of labels) assert(!marks.some((mark) => meet(label, mark)), JSON.stringify(label));
}

/** Renders an example coarsely, and opens the page of its job. */
async function opensJobOf(visitor, example) {
  const answer = await fetch(`${visitor.url}/v1/jobs`, {
    method: "POST",
    headers: { "Content-Type": "application/json", Prefer: "wait=50" },
    body: JSON.stringify({ ...JSON.parse(readFileSync(`examples/${example}.json`, "utf8")), stop: { relative_error: 0.05 } }),
  });
  const { id } = await answer.json();
  await visitor.page.goto(`${visitor.url}/jobs/${id}`);
  await visitor.page.locator(".columns.beside > .view img").waitFor();
}

/** The columns of a short page end near the end of the screen, and not below it. */
async function reachesDown({ page }, what) {
  const ends = () => page.evaluate(() => {
    const bottoms = [...document.querySelectorAll(".columns > .panel")].map((panel) => panel.getBoundingClientRect().bottom);
    return { longest: Math.max(...bottoms) / innerHeight, below: document.documentElement.scrollHeight - innerHeight };
  });
  const reaches = ({ longest, below }) => longest > 0.92 && below <= 0;
  await until(async () => reaches(await ends()), what).catch(async () => assert.fail(`${what}: ${JSON.stringify(await ends())}`));
}

/** No panel of a job's page is empty by more than a tenth, and no column, before and after a panel is unfolded. */
export async function fillsAJob(visitor, shot) {
  const { page } = visitor;
  const before = page.viewportSize();
  await page.setViewportSize({ width: 1500, height: 900 });
  await opensJobOf(visitor, "office_of_40_tubes");
  for (const [width, height] of [[1500, 900], [1920, 1080]]) {
    await page.setViewportSize({ width, height });
    await reachesDown(visitor, `the office, ${width} x ${height}`);
    await until(async () => !(await visitor.emptiness()).length, `the office, ${width} x ${height}: ${await visitor.emptiness()}`);
    await visitor.looksAsIn(shot(`job-office-${width}`));
  }
  await opensJobOf(visitor, "l_hall");
  for (const [width, height] of [[1500, 900], [1920, 1080], [1280, 900], [390, 844]]) {
    await page.setViewportSize({ width, height });
    await visitor.fitsColumns();
    if (width > 1280) await reachesDown(visitor, `the hall, ${width} x ${height}`);
    await until(async () => !(await visitor.emptiness()).length, `${width} x ${height}: ${await visitor.emptiness()}`);
    await visitor.looksAsIn(shot(`job-hall-${width}`));
  }
  const tops = await page.locator(".columns > .panel").evaluateAll((all) => all.map((panel) => panel.getBoundingClientRect().top));
  assert.deepEqual(tops, tops.toSorted((a, b) => a - b), "on a phone panels stand in their order");
  const figure = await page.getByAltText("A section through the room").boundingBox();
  assert(figure.width > 650, `letters of a figure ${figure.width} px wide are too small`);
  await page.setViewportSize({ width: 1500, height: 900 });
  await keepsLabelsFree(page);
  await visitor.fitsColumns();
  const below = () => page.evaluate(() => {
    const why = document.querySelector(".columns > .why").getBoundingClientRect();
    const others = [...document.querySelectorAll(".columns > .panel")].map((panel) => panel.getBoundingClientRect());
    return others.filter(({ left, top, bottom }) => left === why.left && top < why.bottom - 1 && bottom > why.bottom + 1).length;
  });
  await page.locator(".columns > .why summary").first().click();
  await until(async () => (await below()) === 0, "an unfolded panel lies on the one below it");
  await until(async () => !(await visitor.emptiness()).length, `unfolded: ${await visitor.emptiness()}`);
  await page.setViewportSize(before);
  await visitor.open("/");
}
