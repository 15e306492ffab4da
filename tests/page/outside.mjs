// What stands around the building: horizons as people write them, and as the form sends them.
import assert from "node:assert/strict";

/** Lines, pairs, tables, JSON and lists of PVGIS become points; altitudes between them are linear, all round. */
export async function readsHorizons({ page }) {
  const { read, none, between, even, points } = await page.evaluate(async () => {
    const { altitudeAt, evenAltitude, parsed, pointsOf, written } = await import("/web/horizon.js");
    const table = "Latitude (decimal degrees):\t45.0\nA\tH_hor\n-180.0\t3.1\n-90.0\t12\n90.0\t0.4\n180.0\t3.1\n\nPVGIS (c) European Union, 2001-2025";
    const json = '{"outputs": {"horizon_profile": [{"A": -180.0, "H_hor": 3.1}, {"A": 0, "H_hor": 7.5}]}}';
    const texts = ["90: 12\n0: 5\n270°: 8.5", "0 5, 90 12\n", "0:5, 90:12, 180:3", "10,20,30,40", "0, 5\n90, 12", "90: 1\n90: 2", table, json];
    const square = [[0, 0], [90, 10], [180, 20], [270, 10]];
    return {
      read: texts.map((text) => parsed(text)),
      none: ["", "no hills", "12"].map((text) => parsed(text)),
      between: [0, 45, 180, 315, 360].map((azimuth) => altitudeAt(square, azimuth)).concat(altitudeAt([[100, 7]], 20), altitudeAt([], 3)),
      even: [evenAltitude([[0, 5]]), evenAltitude([[0, 5], [90, 5]]), evenAltitude(square), evenAltitude([])],
      points: [pointsOf({ horizon_pvgis: [[-180, 1], [-90, 2], [0, 3], [90, 4]] }), written(square), parsed(written(square))],
    };
  });
  assert.deepEqual(read, [
    { horizon: [[0, 5], [90, 12], [270, 8.5]] },
    { horizon: [[0, 5], [90, 12]] },
    { horizon: [[0, 5], [90, 12], [180, 3]] },
    { horizon: [[0, 10], [90, 20], [180, 30], [270, 40]] },
    { horizon: [[0, 5], [90, 12]] },
    { horizon: [[90, 2]] },
    { horizon_pvgis: [[-180, 3.1], [-90, 12], [90, 0.4], [180, 3.1]] },
    { horizon_pvgis: [[-180, 3.1], [0, 7.5]] },
  ]);
  assert.deepEqual(none, [null, null, null]);
  assert.deepEqual(between, [0, 5, 20, 5, 0, 7, 0]);
  assert.deepEqual(even, [5, 5, null, null]);
  assert.deepEqual(points, [[[0, 1], [90, 2], [180, 3], [270, 4]], "0: 0\n90: 10\n180: 20\n270: 10", { horizon: [[0, 0], [90, 10], [180, 20], [270, 10]] }]);
}

/** What a text leaves open is not guessed: azimuths stay in the document's frame, and what has anything left over is refused. */
export async function refusesUnclearHorizons({ page }) {
  const { kept, read, none } = await page.evaluate(async () => {
    const { parsed } = await import("/web/horizon.js");
    const table = "A\tH_hor\tA_sun(w)\tH_sun(w)\n0.0\t3.1\t-1.0\t-67\n90.0\t12\t90\t4\n";
    const json = '{"A": 0.0, "H_hor": 3.1}, {"A": 90.0, "H_hor": 12}';
    return {
      kept: ["0: 20\n90: 10", "0: 20\n270: 10", "-90: 1", "10\n20", "[[0, 20], [90, 10]]", '{"horizon": [[0, 20]]}'].map((text) => parsed(text, true)),
      read: [
        table, json, "0: 1e1", "[[0,5],[90,12]]", "[0, 5], [90, 12],", '"horizon": [[0, 5]],', '"horizon_pvgis": [[0, 5]]', "[10, 20]", "10\n20\n30\n40\n",
        "10 20 30", "10; 20; 30", "0:5 90:12", "0;5\n90;12", "azimuth, altitude\n0, 5\n90, .5", "90\u00a012",
      ].map((text) => parsed(text)),
      none: [
        "0,5 30,5", "0,5 1,5\n90,5 12,5", "90: 12,5", "0;5,5", "1:2:3", "0: 5 m", "0 5\n90 12 7", "10 20 30\n40 50 60", "0: 5\nninety: 12", "10\n20: 5", "27°5'", "0: 1e", "[]",
        "[[0, 5], [90]]", "[[0, null]]", '[["0", 5]]', "{}", "[0, 5", table.replace("\t4\n", "\n"), table.replace("12", "12,5"), json.replace("12", "12x"), "A\tH_hor\n",
      ].filter((text) => parsed(text)),
    };
  });
  const [pvgis, pair] = [[[0, 3.1], [90, 12]], { horizon: [[0, 5], [90, 12]] }];
  const steps = (...altitudes) => ({ horizon: altitudes.map((altitude, k) => [(k * 360) / altitudes.length, altitude]) });
  assert.deepEqual(kept, [
    { horizon_pvgis: [[0, 20], [90, 10]] },
    { horizon: [[0, 20], [270, 10]] },
    { horizon_pvgis: [[-90, 1]] },
    steps(10, 20),
    { horizon_pvgis: [[0, 20], [90, 10]] },
    { horizon: [[0, 20]] },
  ]);
  assert.deepEqual(read, [
    { horizon_pvgis: pvgis },
    { horizon_pvgis: pvgis },
    { horizon: [[0, 10]] },
    pair,
    pair,
    { horizon: [[0, 5]] },
    { horizon_pvgis: [[0, 5]] },
    steps(10, 20),
    steps(10, 20, 30, 40),
    steps(10, 20, 30),
    steps(10, 20, 30),
    pair,
    pair,
    { horizon: [[0, 5], [90, 0.5]] },
    { horizon: [[90, 12]] },
  ]);
  assert.deepEqual(none, []);
}

/** A horizon and irradiances come into the document, into what is sent, and into the link; a fault stands at the field. */
export async function setsSurroundings(visitor, shot) {
  const { page } = visitor;
  const sent = [];
  page.on("request", (request) => request.method() === "POST" && request.url().endsWith("/v1/jobs") && sent.push(request.postDataJSON()));
  await visitor.open("/");
  await visitor.rests();
  const before = await visitor.mean();
  await visitor.opens("Outside");
  const kind = page.getByLabel("Horizon", { exact: true });
  await kind.selectOption("even");
  await page.getByRole("slider", { name: "Height of the horizon" }).fill("60");
  await visitor.rests();
  assert.deepEqual(sent.at(-1).surroundings, { horizon: [[0, 60]] });
  const after = await visitor.mean();
  assert(after < before / 2, `${before} lx below an open sky, ${after} below a horizon of 60 degrees`);
  await page.locator(".horizon circle.hidden").waitFor();
  await kind.selectOption("points");
  const typed = page.getByLabel(/^Azimuth from (north|south): height/);
  const field = page.locator(".field", { has: typed });
  assert.match(await field.innerText(), /from north/);
  assert.equal(await typed.inputValue(), "0: 60\n90: 60\n180: 60\n270: 60");
  await typed.fill("0: 30\n120: 120");
  await typed.blur();
  await field.locator(".fault").waitFor();
  visitor.faults = visitor.faults.filter((text) => !text.includes("422"));
  await typed.fill("-180.0 5\n-90.0 10\n0.0 20\n90.0 10");
  await typed.blur();
  // a text that cannot be read stays where it is, with why; the document is as it was
  await visitor.rests();
  const { draft: asked } = await visitor.state();
  await typed.fill("90,5 12,5");
  await typed.blur();
  await field.locator(".fault", { hasText: "not read" }).waitFor();
  assert.deepEqual([await typed.inputValue(), await typed.getAttribute("aria-invalid")], ["90,5 12,5", "true"]);
  assert.deepEqual((await visitor.state()).draft, asked);
  await visitor.isAccessible("a horizon that is not read");
  // without the line below zero azimuths still count from south
  await typed.fill("0.0 20\n90.0 10");
  await typed.blur();
  await field.locator(".fault").waitFor({ state: "detached" });
  assert.deepEqual((await visitor.state()).draft.surroundings, { horizon_pvgis: [[0, 20], [90, 10]] });
  assert.match(await field.innerText(), /from south/);
  await typed.fill("-180 5\n-90 10\n0 20\n90 10");
  await typed.blur();
  // a fault of the ground is none of the horizon
  const reflects = page.getByLabel("Ground reflects");
  await reflects.fill("1.5");
  await reflects.press("Enter");
  await page.locator(".field.wrong", { has: reflects }).waitFor();
  assert.equal(await page.locator(".field.wrong").count(), 1);
  visitor.faults = visitor.faults.filter((text) => !text.includes("422"));
  await reflects.fill("0.5");
  await page.getByLabel("Ground reflects").press("Enter");
  await visitor.rests();
  const surroundings = { horizon_pvgis: [[-180, 5], [-90, 10], [0, 20], [90, 10]], ground_reflectance: 0.5 };
  assert.deepEqual(sent.at(-1).surroundings, surroundings);
  // a box is added, made high and near, and removed again
  const unhidden = await visitor.mean();
  await page.getByRole("button", { name: "Add a box" }).click();
  await page.getByLabel("Height of the box, m").fill("30");
  await page.getByLabel("Height of the box, m").press("Enter");
  await page.getByLabel("Width of the box, m").fill("40");
  await page.getByLabel("Width of the box, m").press("Enter");
  await page.getByLabel("What hides the sky, in its luminance").fill("0");
  await page.getByLabel("What hides the sky, in its luminance").press("Enter");
  await visitor.rests();
  const { obstructions, luminance_ratio } = sent.at(-1).surroundings;
  assert.deepEqual([luminance_ratio, obstructions.length, obstructions[0].kind, obstructions[0].size_m], [0, 1, "box", [40, 0.8, 30]]);
  assert((await visitor.mean()) < unhidden, "a wall of 30 m takes no light");
  await visitor.isAccessible("an obstruction");
  await visitor.looksAsIn(shot("obstruction"));
  await page.getByLabel("What hides the sky, in its luminance").fill("0.1");
  await page.getByLabel("What hides the sky, in its luminance").press("Enter");
  await page.getByRole("button", { name: "Remove obstruction 1" }).click();
  await page.waitForFunction(() => !seen.draft.surroundings.obstructions);
  await visitor.rests();
  await page.getByRole("radio", { name: "by irradiances" }).check();
  await page.getByLabel("Direct normal, W/m²").fill("0");
  await page.getByLabel("Direct normal, W/m²").press("Enter");
  await visitor.rests();
  const perez = { direct_normal_irradiance_w_m2: 0, diffuse_horizontal_irradiance_w_m2: 100 };
  assert.deepEqual(sent.at(-1).sky, { perez });
  await visitor.isAccessible("surroundings");
  const size = page.viewportSize();
  for (const colorScheme of ["dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    for (const [width, height] of [[1500, 900], [390, 844]]) {
      await page.setViewportSize({ width, height });
      await page.locator("svg.horizon").scrollIntoViewIfNeeded();
      await visitor.looksAsIn(shot(`outside-${width}-${colorScheme}`));
    }
  }
  await page.setViewportSize(size);
  await page.getByRole("button", { name: "Share" }).click();
  await page.waitForURL(/#d=/);
  const linked = await page.evaluate(async () => (await import("/web/share.js")).unpacked(location.hash));
  assert.deepEqual([linked.draft.surroundings, linked.draft.sky], [surroundings, { perez }]);
  await page.getByRole("radio", { name: "clear with sun (12)" }).check();
  await kind.selectOption("open");
  await visitor.rests();
  assert.deepEqual(sent.at(-1).surroundings, { ground_reflectance: 0.5 });
  assert.deepEqual(sent.at(-1).sky, { cie_type: 12 });
  await visitor.open("/");
  await visitor.rests();
}
