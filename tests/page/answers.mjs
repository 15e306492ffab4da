// What the page's modules find and draw: verdicts, the sun's ray, numbers of tubes, the stage; asked of them in the browser.
import assert from "node:assert/strict";

/** A verdict is by the interval of 95 %: of the mean, or of each cell for a share of the area. */
export async function judges({ page }) {
  const told = await page.evaluate(async () => {
    const { verdict, sentence } = await import("/web/verdict.js");
    const answer = (error) => ({
      job: { progress: { passes: 9 }, document: { time: "2026-12-21T12:00:00+01:00", sky: { cie_type: 1 } } },
      grid: {
        statistics: { mean_lux: 100, mean_lux_standard_error: error, coverage_factor: 2 },
        coverage_factor: 2,
        illuminance_lux: [[90, 110], [130, null]],
        standard_error_lux: [[1, 1], [6, null]],
        area_m2: [[1, 1], [2, 0]],
      },
    });
    const of = (lux, of, error = 1) => verdict(answer(error), { lux, of }).is;
    const { asked, is, found } = sentence(answer(1), { lux: 150, of: "mean" });
    return {
      mean: [of(98, "mean"), of(102.1, "mean"), of(101, "mean"), of(50, "mean", null)],
      // 3 of 4 m2 have 111 lx at most if the one of 110 lx counts, and 2 at least
      share: [of(100, "half"), of(111, "most"), of(120, "half"), of(88, "most")],
      shares: (({ value, from, to }) => [value, from, to])(verdict(answer(1), { lux: 111, of: "half" }).share),
      sentence: `${asked}: ${is}. ${found}`.replaceAll("\u202f", " "),
    };
  });
  assert.deepEqual(told.mean, ["yes", "no", "not sure", "not sure"]);
  assert.deepEqual(told.share, ["yes", "no", "not sure", "yes"]);
  assert.deepEqual(told.shares, [50, 50, 75]);
  assert.equal(told.sentence, "150 lx: no. 100 lx at noon on 21 December, overcast.");
}

/** A ray in a plane through the axis folds at the walls; it keeps its slope, also behind a bend, where each point lies on a wall. */
export async function followsTheSun({ page }) {
  const { straight, bent, along, behind } = await page.evaluate(async () => {
    const { joints, skyward, throughPipe } = await import("/web/ray.js");
    const pieces = [{ length_m: 0.6 }, { length_m: 0.9, tilt_deg: 30, azimuth_deg: 180 }];
    return {
      straight: throughPipe(joints([{ length_m: 1.2 }]), 0.175, skyward(90, 30)),
      bent: { axis: joints(pieces), ...throughPipe(joints(pieces), 0.2, skyward(200, 40)) },
      along: throughPipe(joints([{ length_m: 1, tilt_deg: 45, azimuth_deg: 180 }]), 0.2, skyward(180, 45)),
      behind: throughPipe(joints([{ length_m: 1, tilt_deg: 60, azimuth_deg: 180 }]), 0.2, skyward(0, 10)),
    };
  });
  // sideways as far as without walls, folded between -r and r
  const [r, sideways] = [0.175, 1.2 / Math.tan(Math.PI / 6)];
  const folds = Math.floor((sideways + r) / (2 * r));
  assert.equal(straight.points.length, folds + 2);
  const rest = sideways + r - 2 * r * folds;
  assert(Math.abs(straight.points.at(-1)[0] - (folds % 2 ? rest - r : r - rest)) < 1e-9, `${straight.points.at(-1)}`);
  assert(Math.abs(straight.direction[2] + 0.5) < 1e-12 && straight.end === "room");
  assert.equal(bent.end, "room");
  assert(Math.abs(Math.hypot(...bent.direction) - 1) < 1e-12);
  const distance = (point, from, to) => {
    const [a, b] = [to.map((of, i) => of - from[i]), point.map((of, i) => of - from[i])];
    const share = a.reduce((sum, of, i) => sum + of * b[i], 0) / a.reduce((sum, of) => sum + of * of, 0);
    return Math.hypot(...b.map((of, i) => of - share * a[i]));
  };
  for (const point of bent.points.slice(1, -1)) {
    const apart = [0, 1].map((piece) => Math.abs(distance(point, bent.axis[piece], bent.axis[piece + 1]) - 0.2));
    assert(Math.min(...apart) < 1e-9, `${point}: ${apart}`);
  }
  assert.equal(along.points.length, 2, "along the axis there is no wall");
  assert.equal(behind, null, "a collector that faces away");
}

/** Numbers of tubes that crowd lie neither over each other nor over another tube's ring. */
export async function numbersTubes({ page }) {
  const rings = Array.from({ length: 30 }, (_, i) => ({ x: 100 + 22 * (i % 6), y: 100 + 24 * Math.floor(i / 6), radius: i % 7 ? 6 : 11 }));
  const places = await page.evaluate(async (rings) => (await import("/web/plan_labels.js")).places(rings), rings);
  const found = places.flatMap((place, index) => (place ? [{ ...place, index }] : []));
  assert(found.length >= 25, `${found.length} of 30 numbers have a place`);
  const wide = (index) => 7.5 * String(index + 1).length;
  for (const a of found) {
    for (const b of found)
      if (a !== b) assert(Math.abs(a.x - b.x) >= (wide(a.index) + wide(b.index)) / 2 || Math.abs(a.y - b.y) >= 11, `${a.index}, ${b.index}`);
    for (const [index, ring] of rings.entries())
      if (index !== a.index) assert(Math.hypot(a.x - ring.x, a.y - ring.y) > ring.radius, `${a.index} on ${index}`);
  }
}

/** Plan, section and numbers fit into the middle of the page, in rooms of any proportion: numbers have the height that they need, and the plan is no small part. */
export async function sharesTheMiddle({ page }) {
  const rooms = [[4, 6], [2, 12], [12, 2], [2, 2], [30, 20]];
  const stages = await page.evaluate(async (rooms) => {
    const { stage } = await import("/web/stage.js");
    const ways = [[0, 1, 480], [0, 2, 420], [530, 1, 270], [530, 2, 240], [790, 1, 200]].map(([from, tight, height], k) => ({ from, columns: [1, 1, 2, 2, 3][k], tight, height, filled: 1 }));
    return [[804, 827], [1096, 990]].flatMap(([width, height]) =>
      rooms.map(([wide, deep]) => {
        const found = stage({ width: wide, height: deep }, { width: wide, height: 4.4 }, { width, height }, false, (at) => ways.filter(({ from }) => at >= from));
        return { ...found, space: height, needed: ways.find((way) => way.columns === found.columns && way.tight === found.tight).height };
      }),
    );
  }, rooms);
  for (const { template, height, most, needed, space } of stages) {
    assert(height <= space + 1 && most >= needed - 1, `${template}, ${height} of ${space}: ${most} for numbers of ${needed}`);
    assert(/^("plan section"|"plan plan"|"plan numbers")/.test(template), template);
  }
}

/** Of many tubes the sum, the least and the most are told at once, and each is folded; of few each has a row. */
export async function foldsManyTubes({ page }) {
  const rows = await page.evaluate(async () => {
    const [{ numbers }, { render }] = [await import("/web/results.js"), await import("/web/vendor/lit-html.js")];
    const grid = seen.answer.grid;
    const flux = (flux_lm) => ({ flux_lm });
    return [8, 40].map((count) => {
      const tubes = Array.from({ length: count }, (_, i) => ({ at_collector: flux(1000), at_diffuser: flux(800), into_room: flux(500 + ((7 * i) % count)), transmission_efficiency: 0.5 }));
      const host = document.createElement("div");
      render(numbers({ job: { ...seen.answer.job, tubes, grids: [] }, grid }), host);
      const told = (table) => [...table.querySelectorAll("tbody tr")].map((row) => row.textContent.replaceAll(/[\s\u202f]+/g, " ").trim());
      return { shown: told(host.querySelector(".fluxes")), folded: [...host.querySelectorAll("details.each")].map((details) => [details.querySelectorAll("tbody tr").length, details.open]) };
    });
  });
  assert.deepEqual([rows[0].shown.length, rows[0].folded], [8, []]);
  // 500 to 539 lm into the room, the last one for the tube before the one that 7 i brings round to 0
  assert.deepEqual(rows[1].folded, [[40, false]]);
  assert.deepEqual(rows[1].shown.map((row) => row.replaceAll(" ", "")), ["all40000320002078051.9%", "least:1100080050050.0%", "most:18100080053950.0%"]);
}

/** A target is typed, judged, and kept in the address; an address without one opens, too. */
export async function keepsATarget(visitor) {
  const { page } = visitor;
  const says = (word) => page.locator("#verdict", { hasText: word }).waitFor();
  const enter = async (lux) => {
    await page.getByLabel("Target, lx").fill(String(lux));
    await page.getByLabel("Target, lx").press("Enter");
  };
  await enter(1);
  await says("yes.");
  await enter(5000);
  await says("no.");
  await page.getByLabel("To be met").selectOption("half");
  await page.waitForURL(/&lux=5000&of=half$/);
  assert.match(await page.locator(".verdict").innerText(), /^5000\s?lx on half of the area: no\. 0\s?% of the area has it at /);
  await page.reload();
  await visitor.arrived();
  await page.locator("#verdict").waitFor();
  assert.deepEqual(await page.evaluate(() => seen.goal), { lux: 5000, of: "half" });
  const { hash } = new URL(page.url());
  await page.goto("about:blank");
  await visitor.open(`/${hash.replace(/&.*/, "")}`);
  await page.locator("#verdict").waitFor();
  assert.deepEqual(await page.evaluate(() => seen.goal), { lux: 300, of: "mean" });
  await visitor.rests();
}
