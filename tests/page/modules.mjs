// What the page's modules compute, asked of them in the browser.
import assert from "node:assert/strict";

/** Isolux lines of a paraboloid are circles; of a plane, straight lines to the walls. */
export async function drawsIsoluxLines({ page }) {
  const [circles, straight] = await page.evaluate(async () => {
    const { lines } = await import("/web/isolux.js");
    const centres = Array.from({ length: 40 }, (_, i) => (i + 0.5) / 10);
    const grid = { x_m: centres, y_m: centres };
    const bowl = centres.map((y) => centres.map((x) => (x - 2) ** 2 + (y - 2) ** 2));
    const slope = centres.map((y) => centres.map((x) => x + 2 * y));
    return [[0.5, 1, 2].map((level) => lines(grid, bowl, level)), lines(grid, slope, 6)];
  });
  for (const [index, level] of [0.5, 1, 2].entries()) {
    const [line, ...others] = circles[index];
    assert.equal(others.length, 0, "one line");
    assert.deepEqual(line[0], line.at(-1), "a ring");
    // a chord of a parabola over h is wrong by up to h * h / 4 in the level: by half of that over the radius in the radius
    const bound = 0.1 ** 2 / 4 / (2 * Math.sqrt(level));
    for (const [x, y] of line)
      assert(Math.abs(Math.hypot(x - 2, y - 2) - Math.sqrt(level)) <= bound + 1e-12, `${level} at ${x}, ${y}`);
  }
  assert.equal(straight.length, 1);
  for (const [x, y] of straight[0]) assert(Math.abs(x + 2 * y - 6) < 1e-9);
  const ends = [straight[0][0], straight[0].at(-1)].map(([, y]) => y).sort();
  assert.deepEqual(
    ends.map((y) => Math.round(y * 1e9) / 1e9),
    [1, 3],
    "from wall to wall",
  );
}

/** A map is smooth between the centres of cells: planes stay planes up to the walls, peaks keep their height, lines of a coarse bowl are nearly circles. */
export async function smoothsMaps({ page }) {
  const { plane, peak, ring, hole } = await page.evaluate(async () => {
    const [{ lines }, { refined }] = [await import("/web/isolux.js"), await import("/web/refined.js")];
    const centres = Array.from({ length: 8 }, (_, i) => i / 2 + 0.25);
    const grid = { x_m: centres, y_m: centres };
    const of = (value) => refined(grid, centres.map((y) => centres.map((x) => value(x, y))));
    const plane = of((x, y) => 3 * x - y);
    const bowl = of((x, y) => (x - 2) ** 2 + (y - 2) ** 2);
    const peak = of((x, y) => (x === 2.25 && y === 2.25 ? 100 : 0));
    const hole = of((x, y) => (x > 3.5 && y > 3.5 ? NaN : x));
    return {
      plane: plane.rows.flatMap((row, j) => row.map((value, i) => value - 3 * plane.grid.x_m[i] + plane.grid.y_m[j])),
      peak: [Math.min(...peak.rows.flat()), Math.max(...peak.rows.flat())],
      ring: lines(bowl.grid, bowl.rows, 1)[0].map(([x, y]) => Math.hypot(x - 2, y - 2)),
      hole: hole.rows.flat().filter(Number.isNaN).length,
    };
  });
  assert(Math.max(...plane.map(Math.abs)) < 1e-9, "a plane");
  assert(peak[0] >= 0 && peak[1] <= 100 && peak[1] > 85, `a peak from ${peak}`);
  assert(ring.every((radius) => Math.abs(radius - 1) < 2e-3), `radii from ${Math.min(...ring)} to ${Math.max(...ring)}`);
  // one of 64 cells, in 6 x 6 parts
  assert.equal(hole, 36);
}

/** Long numbers have no room beside a map: from 10 000 lx on its scale is in klx. */
export async function shortensScales({ page }) {
  const told = await page.evaluate(async () => {
    const [{ bar }, { render, svg }] = [await import("/web/map.js"), await import("/web/vendor/lit-html.js")];
    const texts = (end, unit) => {
      const host = document.createElement("div");
      render(svg`<svg>${bar(end, [0, end / 4, end], unit, 0, 0, 100)}</svg>`, host);
      return [...host.querySelectorAll("text")].map((text) => text.textContent.replaceAll("\u202f", " "));
    };
    return [texts(8000, "lx"), texts(10_000, "lx"), texts(20, "%")];
  });
  assert.deepEqual(told, [["0", "2000", "8000 lx"], ["0", "2.5", "10 klx"], ["0", "5", "20 %"]]);
}

/** Lines of a map are labelled in the unit of its scale. */
export async function labelsLinesAsItsScale({ page }) {
  const told = await page.evaluate(async () => {
    const [{ isolines }, { layout }, { render, svg }] = [await import("/web/map.js"), await import("/web/room_plan.js"), await import("/web/vendor/lit-html.js")];
    const centres = Array.from({ length: 20 }, (_, i) => (i + 0.5) / 4);
    const room = { size_m: [5, 5, 3] };
    const of = (most, unit, end) => {
      const host = document.createElement("div");
      const rows = centres.map((y) => centres.map((x) => most * Math.max(0.1, 1 - Math.hypot(x - 2.5, y - 2.5) / 3)));
      render(svg`<svg>${isolines({ x_m: centres, y_m: centres }, rows, layout(room, [560, 560]), room, [], unit, end)}</svg>`, host);
      return [...host.querySelectorAll(".level")].map((text) => Number(text.textContent));
    };
    return [of(18_000, "lx", 20_000), of(1800, "lx", 2000), of(1800, "lx", 20_000)];
  });
  // a variant beside it may have a greater scale
  assert.deepEqual(told, [[5, 10, 15], [500, 1000, 1500], [0.5, 1, 1.5]]);
}

/** Errors of any size have their place beside the chart of errors. */
export async function chartsAnyError({ page }) {
  const lefts = await page.evaluate(async () => {
    const [{ chart }, { render }] = [await import("/web/accuracy.js"), await import("/web/vendor/lit-html.js")];
    const host = document.body.appendChild(document.createElement("div"));
    const of = (errors) => {
      render(chart(errors.map((relative_error, i) => ({ passes: i + 1, seconds: i + 1, relative_error })), null), host);
      return Math.min(...[...host.querySelectorAll("text.end")].map((text) => text.getBBox().x));
    };
    const found = [of([300, 2, 0.02]), of([0.04, 0.01])];
    host.remove();
    return found;
  });
  assert(Math.min(...lefts) >= 0 && Math.max(...lefts) < 12, `labels begin at ${lefts}`);
}

/** Scales have ticks that people would write, and values the digits that their intervals leave. */
export async function writesNumbers({ page }) {
  const of = await page.evaluate(async () => {
    const { scale, digits, halfWidth } = await import("/web/scale.js");
    return {
      scales: [600, 484, 31, 1114, 0.968].map((value) => scale(value).ticks),
      numbers: [
        [210.68, 0.34],
        [210.68, 14],
        [0.6394, 0.011],
        [43210.9, 120],
        [0, 3],
      ].map(([value, half]) => `${digits(value, half)} ± ${halfWidth(half)}`),
    };
  });
  assert.deepEqual(of.scales, [
    [0, 100, 200, 300, 400, 500, 600],
    [0, 100, 200, 300, 400, 500],
    [0, 5, 10, 15, 20, 25, 30, 35],
    [0, 200, 400, 600, 800, 1000, 1200],
    [0, 0.2, 0.4, 0.6, 0.8, 1],
  ]);
  assert.deepEqual(of.numbers, ["210.7 ± 0.3", "211 ± 14", "0.639 ± 0.011", "43\u202f211 ± 120", "0 ± 3"]);
}

/** A comparison says what stands in the documents: entries of lists are counted from 1, values are as they are. */
export async function namesChanges({ page }) {
  const told = await page.evaluate(async () => {
    const { changes } = await import("/web/compare.js");
    const tube = (more) => ({ centre_m: [1, 2], segments: [{ length_m: 1 }, { length_m: 3 }], ...more });
    const a = { sky: { cie_type: 12 }, tubes: [tube({}), tube({ diameter_m: 1 })], room: { rotation_deg: 0 } };
    const b = {
      sky: { cie_type: 1 },
      tubes: [tube({ segments: [{ length_m: 2 }, { length_m: 3 }] }), tube({ diameter_m: 2, centre_m: [1, 3] })],
      room: { rotation_deg: 5 },
    };
    return changes(a, b);
  });
  assert.deepEqual(told, [
    "sky, CIE type: 12 → 1",
    "tube 1, segment 1, length in m: 1 → 2",
    "tube 2, place: 1, 2 → 1, 3",
    "tube 2, diameter in m: 1 → 2",
    "rotation in °: 0 → 5",
  ]);
}

/** Times that are foretold end with the hour. */
export async function foretellsNoNonsense({ page }) {
  const told = await page.evaluate(async () => {
    const { foretold, timeLeft } = await import("/web/accuracy.js");
    return [...[0.5, 42, 3600, 3601, 5.16e82, Infinity].map(foretold), timeLeft(9e9), timeLeft(30), timeLeft(null)];
  });
  const [hour, space] = [">\u202f1\u202fh", "\u202f"];
  assert.deepEqual(told, [`500${space}ms`, `42${space}s`, `60${space}min`, hour, hour, hour, `, ${hour} left`, `, about 30${space}s left`, ""]);
}

/** Cities have the zones of the service's borders; they are found by what people type; the clock of a document is read as it was written. */
export async function knowsPlaces({ page }) {
  const { count, names, odd, found, times } = await page.evaluate(async () => {
    const [{ timeZone }, { called, listed, named }, { isoDay, time, read, offset, local }] = [
      await import("/web/api.js"),
      await import("/web/cities.js"),
      await import("/web/clock.js"),
    ];
    const cities = await listed();
    const told = async ({ latitude_deg, longitude_deg }) =>
      (await timeZone({ latitude_deg, longitude_deg, local_time: "2026-01-15T12:00" })).time_zone;
    const odd = [];
    for (const city of cities) if ((await told(city)) !== city.time_zone) odd.push(city);
    const found = ["aarhus", "Zurich", "sao pa", "London", "London, Can", "tromso", "Atlantis", " "].map((text) => {
      const city = named(cities, text);
      return city && called(city);
    });
    const at = time(2026, 172, 12.5, "+02:00");
    const times = [at, read(at), offset(at), offset("2026-01-01T00:00Z"), local(at), isoDay(2026, 172)];
    return { count: cities.length, names: new Set(cities.map(called)).size, odd, found, times };
  });
  assert(count >= 1000 && names === count, `${count} cities with ${names} names`);
  assert.deepEqual(odd, []);
  const cities = ["Aarhus, Denmark", "Zürich, Switzerland", "São Paulo, Brazil", "London, United Kingdom", "London, Canada", "Tromsø, Norway"];
  assert.deepEqual(found, [...cities, null, null]);
  assert.deepEqual(times, ["2026-06-21T12:30:00+02:00", { year: 2026, day: 172, hour: 12.5 }, "+02:00", "+00:00", "2026-06-21T12:30:00", "2026-06-21"]);
}

/** The clock is that of the place in summer and winter, of a zone that is chosen, or of the document; hours that clocks do not have. */
export async function setsClocks(visitor) {
  const { page } = visitor;
  const time = (of) => page.waitForFunction((of) => seen.draft.time === of, of);
  const slide = (name, to) => page.getByRole("slider", { name, exact: true }).fill(String(to));
  const zone = page.getByLabel("Time zone");
  const shown = () => zone.evaluate((select) => select.selectedOptions[0].textContent);
  const before = (await visitor.state()).draft;
  for (const [name, degrees] of [
    ["Latitude", "55.69"],
    ["Longitude", "12.9"],
  ]) {
    await page.getByLabel(name).fill(degrees);
    await page.getByLabel(name).press("Enter");
  }
  await slide("Hour", 12);
  await slide("Day", 172);
  await time("2026-06-21T12:00:00+02:00");
  await page.locator("output", { hasText: "UTC+02:00, that of the place" }).waitFor();
  await page.getByLabel("Day", { exact: true }).and(page.locator(".typed")).fill("2027-06-21");
  await page.getByLabel("Day", { exact: true }).and(page.locator(".typed")).blur();
  await time("2027-06-21T12:00:00+02:00");
  await page.getByLabel("Hour", { exact: true }).and(page.locator(".typed")).fill("09:20");
  await page.getByLabel("Hour", { exact: true }).and(page.locator(".typed")).blur();
  await time("2027-06-21T09:20:00+02:00");
  await page.getByLabel("Day", { exact: true }).and(page.locator(".typed")).fill("2026-06-21");
  await page.getByLabel("Day", { exact: true }).and(page.locator(".typed")).blur();
  await time("2026-06-21T09:20:00+02:00");
  await slide("Hour", 12);
  assert.equal(await shown(), "Europe/Stockholm");
  await slide("Day", 15);
  await time("2026-01-15T12:00:00+01:00");
  await page.locator("#city").fill("Kathmandu");
  await page.locator("#city").press("Enter");
  await time("2026-01-15T12:00:00+05:45");
  await page.locator("#city").fill("Copenhagen");
  await page.locator("#city").press("Enter");
  await time("2026-01-15T12:00:00+01:00");
  // set forward on 29 March, back on 25 October
  await slide("Hour", 2.5);
  await slide("Day", 88);
  await time("2026-03-29T03:30:00+02:00");
  await page.getByRole("status").getByText("leap over 02:30").waitFor();
  await slide("Day", 298);
  await slide("Hour", 2.5);
  await time("2026-10-25T02:30:00+02:00");
  await page.getByRole("button", { name: "Take the second" }).click();
  await time("2026-10-25T02:30:00+01:00");
  await page.getByText("the second is meant").waitFor();
  await zone.selectOption("America/St_Johns");
  await time("2026-10-25T02:30:00-02:30");
  await slide("Day", 15);
  await time("2026-01-15T02:30:00-03:30");
  await zone.selectOption("");
  await time("2026-01-15T02:30:00+01:00");
  // an answer to a clock that was changed since, but not drawn, judges the new one in nothing
  await page.evaluate(async () => {
    const [{ setClock }, { fetch }] = [await import("/web/zone.js"), window];
    const at = (time) => setClock((next) => void (next.time = time));
    window.fetch = async (...of) => {
      const answer = await fetch(...of);
      if (!String(of[0].url ?? of[0]).includes("/v1/time_zone")) return answer;
      window.fetch = fetch;
      const json = await answer.json();
      at("2026-10-25T02:30:00+01:00");
      return new Response(JSON.stringify(json), answer);
    };
    at("2026-10-25T03:30:00+02:00");
  });
  await page.getByText("the first is meant").waitFor();
  await time("2026-10-25T02:30:00+02:00");
  await slide("Day", 15);
  await slide("Hour", 2.5);
  await time("2026-01-15T02:30:00+01:00");
  // an offset of no zone here stays with its document
  await page.evaluate(async () => {
    const { use } = await import("/web/live.js");
    use({ ...seen.draft, time: "2026-06-21T12:00:00Z" });
  });
  await page.getByText("that of the document").waitFor();
  await slide("Hour", 13);
  await time("2026-06-21T13:00:00+00:00");
  await page.evaluate(async (draft) => (await import("/web/live.js")).use(draft), before);
  await visitor.rests();
  assert.equal((await visitor.state()).draft.time, before.time);
}

/** A typed size stands in the document as it is, for the service to judge; a dragged wall stops before the tubes. */
export async function takesSizesAsTyped({ page }) {
  const { sizes, slip } = await page.evaluate(async () => {
    const { moveEdge, resize } = await import("/web/draft.js");
    const draft = () => ({ room: { size_m: [4, 6, 2.7] }, tubes: [{ centre_m: [2, 3], diameter_m: 0.35, segments: [{ length_m: 1 }] }] });
    const after = (change) => {
      const next = draft();
      change(next);
      return next.room.size_m;
    };
    const slip = draft();
    [-3, 0.3, 4].forEach((metres) => resize(slip, 0, metres));
    return { sizes: [after((next) => resize(next, 0, 0.3)), after((next) => resize(next, 1, 60)), after((next) => moveEdge(next, "east", -9))], slip };
  });
  assert.deepEqual(slip.tubes[0].centre_m, [2, 3], "a width in which the tube has no place does not move it");
  assert.deepEqual(sizes, [
    [0.3, 6, 2.7],
    [4, 60, 2.7],
    [0.8, 6, 2.7],
  ]);
}

/** A room that is refused leaves the section as it was. */
export async function keepsTheSection({ page }) {
  const drawn = await page.evaluate(async () => {
    const [{ section }, { set, state }, { render }] = [
      await import("/web/section.js"),
      await import("/web/state.js"),
      await import("/web/vendor/lit-html.js"),
    ];
    const { draft, problem, current } = state;
    const shown = (height, current, errors) => {
      set({ current, draft: { ...draft, room: { ...draft.room, size_m: [4, 6, height] } }, problem: errors && { errors } });
      const host = document.createElement("div");
      render(section(), host);
      return host.querySelector(".shell").getAttribute("d");
    };
    const drawn = [
      shown(2.7, true),
      // drawn once before the service has refused it
      shown(25000, false),
      shown(25000, false, [{ pointer: "/room/size_m/2", detail: "too high" }]),
      shown(3.5, false),
    ];
    set({ draft, problem, current });
    return drawn;
  });
  assert.equal(drawn[2], drawn[0]);
  assert.notEqual(drawn[3], drawn[0]);
}
