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
  // of many tubes each is folded, and what is folded takes no space
  const { views, ...office } = JSON.parse(readFileSync("examples/office_of_40_tubes.json", "utf8"));
  await page.goto("about:blank");
  await visitor.open(`/#d=${deflateRawSync(JSON.stringify(office)).toString("base64url")}`);
  await visitor.holds(() => seen.current && seen.answer?.job.tubes?.length === 40);
  for (const [width, height] of sizes) {
    await page.setViewportSize({ width, height });
    await until(async () => !(await visitor.emptiness()).length, `40 tubes, ${width} x ${height}: ${await visitor.emptiness()}`);
  }
  await visitor.open("/");
  await page.setViewportSize(before);
}
