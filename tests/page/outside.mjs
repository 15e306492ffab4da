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
      read: texts.map(parsed),
      none: ["", "no hills", "12"].map(parsed),
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
  const typed = page.getByLabel("Azimuth: height");
  assert.equal(await typed.inputValue(), "0: 60\n90: 60\n180: 60\n270: 60");
  await typed.fill("0: 30\n120: 120");
  await typed.blur();
  await page.locator(".field.wrong", { hasText: "Azimuth: height" }).locator(".fault").waitFor();
  visitor.faults = visitor.faults.filter((text) => !text.includes("422"));
  await typed.fill("-180.0 5\n-90.0 10\n0.0 20\n90.0 10");
  await typed.blur();
  await page.getByLabel("Ground reflects").fill("0.5");
  await page.getByLabel("Ground reflects").press("Enter");
  await visitor.rests();
  const surroundings = { horizon_pvgis: [[-180, 5], [-90, 10], [0, 20], [90, 10]], ground_reflectance: 0.5 };
  assert.deepEqual(sent.at(-1).surroundings, surroundings);
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
