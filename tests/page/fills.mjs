// How full the page is: no panel of a screen is empty, and numbers do not scroll.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
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
      await page.waitForFunction(() => Math.abs(document.querySelector(".plan").getBoundingClientRect().width - seen.sizes.plan[0]) < 1);
      await visitor.looksAsIn(shot(`editor-${width}-${colorScheme}`));
      assert.deepEqual(await visitor.emptiness(), [], `${width} x ${height}`);
      const below = await page.evaluate(() => document.documentElement.scrollHeight - innerHeight);
      assert(width < 1200 || below <= 1, `the page ends ${below} px below the screen`);
    }
  }
  // beside and below plans of any proportions, with the light of each tube, too
  const fits = () => page.locator(".all-numbers").evaluate((panel) => panel.scrollHeight <= panel.clientHeight && panel.querySelectorAll("tr").length > 3);
  for (const name of ["corridor", "office", "attic", "thesis"]) {
    const { draft } = JSON.parse(readFileSync(`web/presets/${name}.json`, "utf8"));
    await page.locator("#preset").selectOption(name);
    await page.waitForFunction((of) => seen.draft.name === of && seen.answer, draft.name);
    await visitor.rests();
    for (const [width, height] of [[1500, 900], [1920, 1080]]) {
      await page.setViewportSize({ width, height });
      await until(fits, `the numbers of the ${name} scroll`);
      await until(async () => !(await visitor.emptiness()).length, `${name}, ${width} x ${height}: ${await visitor.emptiness()}`);
    }
    await page.setViewportSize({ width: 1500, height: 900 });
    await page.getByRole("button", { name: "By tube" }).click();
    await page.waitForFunction(() => seen.current && seen.answer?.grid?.by_tube);
    await page.locator(".origins").waitFor();
    await until(fits, `the numbers of the ${name} scroll by tube`);
    await visitor.looksAsIn(shot(`by-tube-${name}`));
  }
  await page.setViewportSize(before);
}
