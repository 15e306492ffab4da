// What visitors do on the plan: tubes, walls and corners, by hand, by finger and by keys.
import assert from "node:assert/strict";
import { middle } from "./visit.mjs";

/** Keys move tubes and walls. */
export async function types(visitor) {
  const { page } = visitor;
  const tube = page.locator(".tube").nth(1);
  await tube.focus();
  const [x, y] = (await visitor.state()).draft.tubes[1].centre_m;
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Shift+ArrowUp");
  let { draft } = await visitor.state();
  assert.deepEqual(
    draft.tubes[1].centre_m.map((metres) => Math.round(100 * metres)),
    [Math.round(100 * x) + 5, Math.round(100 * y) + 1],
  );
  await page.locator(".wall.east").focus();
  await page.keyboard.press("ArrowLeft");
  ({ draft } = await visitor.state());
  assert.equal(draft.room.size_m[0], 3.95);
  const [wallX, wallY] = await middle(page.locator(".wall.north .seen"));
  await page.mouse.move(wallX + 60, wallY);
  await page.mouse.down();
  await page.mouse.move(wallX + 60, wallY + 35, { steps: 4 });
  await page.mouse.up();
  ({ draft } = await visitor.state());
  assert(draft.room.size_m[1] < 5.8 && draft.room.size_m[1] > 5, `the room is ${draft.room.size_m[1]} m deep`);
  await page.getByRole("button", { name: "Add a tube" }).click();
  await page.locator(".tube").nth(2).focus();
  await page.keyboard.press("Delete");
  assert.equal((await visitor.state()).draft.tubes.length, 2);
  await page.keyboard.press("Control+z");
  assert.equal((await visitor.state()).draft.tubes.length, 3, "a step back");
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByLabel("Change all tubes together").check();
  await page.getByRole("slider", { name: "Diameter" }).first().fill("0.3");
  ({ draft } = await visitor.state());
  assert.deepEqual(
    draft.tubes.map(({ diameter_m }) => diameter_m),
    [0.3, 0.3],
  );
  await page.getByLabel("Change all tubes together").uncheck();
  await visitor.rests();
}

/** A finger moves a tube; a slider the hour. */
export async function touches(visitor) {
  const { page, context } = visitor;
  const session = await context.newCDPSession(page);
  const [x, y] = await middle(page.locator(".tube .ring").nth(1));
  const touch = (type, touchPoints) => session.send("Input.dispatchTouchEvent", { type, touchPoints });
  const before = (await visitor.state()).draft.tubes[1].centre_m;
  await touch("touchStart", [{ x, y }]);
  for (let step = 1; step <= 5; step++) await touch("touchMove", [{ x: x - 8 * step, y: y + 8 * step }]);
  await touch("touchEnd", []);
  await page.waitForFunction(([x, y]) => {
    const [nowX, nowY] = seen.draft.tubes[1].centre_m;
    return nowX < x - 0.3 && nowY < y - 0.3;
  }, before);
  const high = async () => Number(/stands ([\d.]+)°/.exec(await page.locator(".note", { hasText: "The sun" }).innerText())?.[1]);
  await visitor.rests();
  const noon = await high();
  await page.getByRole("slider", { name: "Hour" }).fill("16");
  await visitor.rests();
  assert((await high()) < noon - 10, "the sun sinks in the afternoon");
}

/** A partition is drawn on the plan, moved by its end, by keys and by numbers, and removed; the answer has it. */
export async function drawsPartitions(visitor) {
  const { page } = visitor;
  const of = () => page.evaluate(() => seen.draft.room.partitions ?? []);
  await page.getByRole("button", { name: "Draw one" }).click();
  const box = await page.locator(".plan rect.floor").boundingBox();
  const [width, depth] = (await visitor.state()).draft.room.size_m;
  const at = (x, y) => [box.x + (x / width) * box.width, box.y + (1 - y / depth) * box.height];
  await page.mouse.move(...at(1, 2));
  await page.mouse.down();
  await page.mouse.move(...at(3, 2.02), { steps: 5 });
  await page.mouse.up();
  const [{ from_m, to_m, height_m }] = await of();
  const off = [from_m[0] - 1, from_m[1] - 2, to_m[0] - 3].map(Math.abs);
  assert(Math.max(...off) < 0.05 && to_m[1] === from_m[1] && height_m === 1.4, JSON.stringify([from_m, to_m, height_m]));
  await page.getByRole("button", { name: "End of partition 1" }).focus();
  await page.keyboard.press("ArrowUp");
  assert.equal(Math.round(100 * ((await of())[0].to_m[1] - to_m[1])), 5);
  await page.getByLabel("To x, m").fill("2.5");
  await page.getByLabel("To x, m").press("Enter");
  await page.getByLabel("Height of it, m").fill("2");
  await page.getByLabel("Height of it, m").press("Enter");
  await visitor.rests();
  const { job } = await visitor.state();
  assert.deepEqual(job.document.room.partitions.map(({ to_m, height_m }) => [to_m[0], height_m]), [[2.5, 2]]);
  await visitor.isAccessible("a partition");
  await page.getByRole("button", { name: "End of partition 1" }).focus();
  await page.keyboard.press("Delete");
  assert.deepEqual(await of(), []);
  await page.keyboard.press("Control+z");
  assert.equal((await of()).length, 1, "a step back");
  for (let step = 0; step < 4; step++) await page.getByRole("button", { name: "Undo" }).click();
  assert.deepEqual(await of(), [], "a stroke of the hand is one step");
  await visitor.rests();
}

/** A tube goes where its coordinates are typed. */
export async function typesAPlace(visitor) {
  const { page } = visitor;
  await page.getByRole("button", { name: "Tube 2", exact: true }).and(page.locator("button")).click();
  const before = (await visitor.state()).draft.tubes[1].centre_m;
  await page.getByLabel("x, m", { exact: true }).fill("1.25");
  await page.getByLabel("x, m", { exact: true }).press("Enter");
  assert.deepEqual((await visitor.state()).draft.tubes[1].centre_m, [1.25, before[1]]);
  await page.getByLabel("Diameter, m").fill("0.33");
  await page.getByLabel("Diameter, m").press("Enter");
  assert.equal((await visitor.state()).draft.tubes[1].diameter_m, 0.33);
  for (let step = 0; step < 2; step++) await page.getByRole("button", { name: "Undo" }).click();
  await page.locator(".tube").first().focus();
  await page.getByRole("button", { name: "Remove tube 1" }).waitFor();
  await visitor.rests();
}

/** The colour of a place of the page. */
async function colour(page, x, y) {
  const png = (await page.screenshot({ clip: { x: x - 1, y: y - 1, width: 2, height: 2 } })).toString("base64");
  return page.evaluate(async (png) => {
    const image = new Image();
    image.src = `data:image/png;base64,${png}`;
    await image.decode();
    const context = Object.assign(document.createElement("canvas"), { width: 2, height: 2 }).getContext("2d");
    context.drawImage(image, 0, 0);
    return [...context.getImageData(0, 0, 1, 1).data].slice(0, 3);
  }, png);
}

/** A visitor draws an L-shaped hall with two tubes: its map has no colour in the notch; then a corner and a ridge. */
export async function drawsAHall(visitor, shot) {
  const { page } = visitor;
  const begun = performance.now();
  await visitor.open("/");
  await page.locator("#mean").waitFor();
  await page.getByLabel("Shape", { exact: true }).selectOption("L");
  await visitor.drawn();
  const name = page.getByLabel("Name", { exact: true });
  assert.equal(await name.inputValue(), "L-shaped hall", "a room to begin with is called after its shape");
  const type = async (label, value) => {
    // a field that is drawn again for another corner loses what was typed before
    await visitor.drawn();
    await page.getByLabel(label, { exact: true }).first().fill(value);
    await page.getByLabel(label, { exact: true }).first().press("Enter");
  };
  await type("Width, m", "8");
  await type("Depth, m", "6");
  const outline = () => page.evaluate(() => seen.draft.room.plan.outline_m);
  assert.deepEqual(await outline(), [[0, 0], [8, 0], [8, 2.4], [3.2, 2.4], [3.2, 6], [0, 6]]);
  await visitor.drawn();
  const lengths = (await page.locator(".plan .length").allTextContents()).sort();
  assert.deepEqual(lengths, ["3.2 m", "3.6 m", "4.8 m"], "walls that are no side of the whole tell their lengths");
  // where a place of the room is on the page
  const at = async ([x, y]) => {
    await page.evaluate(() => scrollTo(0, 0));
    const box = await page.locator(".plan path.floor").boundingBox();
    return [box.x + (x / 8) * box.width, box.y + (1 - y / 6) * box.height];
  };
  const drag = async (from, to) => {
    await page.mouse.move(...from);
    await page.mouse.down();
    await page.mouse.move(...to, { steps: 6 });
    await page.mouse.up();
  };
  for (const [tube, to] of [[0, [6, 1.2]], [1, [1.6, 4.2]]])
    await drag(await at((await visitor.state()).draft.tubes[tube].centre_m), await at(to));
  await visitor.rests();
  const { draft, grid } = await visitor.state();
  for (const [tube, [x, y]] of [[0, [6, 1.2]], [1, [1.6, 4.2]]]) {
    const [ofX, ofY] = draft.tubes[tube].centre_m;
    assert(Math.hypot(ofX - x, ofY - y) < 0.1, `tube ${tube} at ${ofX}, ${ofY}`);
  }
  assert.equal(draft.grids[0].spacing_m, 0.4);
  assert(!("cells" in draft.grids[0]) && !("size_m" in draft.room));
  for (const [j, y] of grid.y_m.entries())
    for (const [i, x] of grid.x_m.entries()) assert.equal(grid.illuminance_lux[j][i] === null, x > 3.2 && y > 2.4, `${x}, ${y}`);
  const panel = await page.locator(".panel.map").evaluate((panel) => getComputedStyle(panel).backgroundColor.match(/\d+/g).map(Number));
  for (const [x, y] of [[3.5, 2.7], [6, 4.5], [7.7, 5.7], [3.5, 5.8]]) assert.deepEqual(await colour(page, ...(await at([x, y]))), panel, `${x}, ${y}`);
  assert.notDeepEqual(await colour(page, ...(await at([7, 1]))), panel);
  const seconds = (performance.now() - begun) / 1000;
  assert(seconds < 180, `${seconds} s`);
  await visitor.isAccessible("an L-shaped hall");
  await looks(visitor, shot, "hall");

  // a partition to begin with lies in the room
  await page.getByRole("button", { name: "Add one" }).click();
  const clear = await page.evaluate(async () => {
    const { clearance } = await import("/web/outline.js");
    const [{ from_m, to_m }] = seen.draft.room.partitions;
    const middle = [(from_m[0] + to_m[0]) / 2, (from_m[1] + to_m[1]) / 2];
    return [from_m, middle, to_m].map((place) => clearance([seen.draft.room.plan.outline_m], place));
  });
  assert(Math.min(...clear) > 0.2, `${clear}`);
  await page.getByRole("button", { name: "Undo" }).click();

  // a wall is moved as a whole, by hand and by keys, and those beside it stay upright
  await drag(await at([5.6, 2.4]), await at([5.6, 2.9]));
  const high = (await outline())[2][1];
  assert(Math.abs(high - 2.9) < 0.05, `${high}`);
  assert.deepEqual(await outline(), [[0, 0], [8, 0], [8, high], [3.2, high], [3.2, 6], [0, 6]]);
  await page.getByRole("button", { name: "Undo" }).click();
  await page.locator(".edge.held").nth(3).focus();
  await page.keyboard.press("ArrowRight");
  assert.deepEqual((await outline()).slice(3, 5), [[3.25, 2.4], [3.25, 6]]);
  await page.getByRole("button", { name: "Undo" }).click();

  // a double click adds a corner, which is in line with its neighbours where it is near; Delete removes it
  await page.mouse.dblclick(...(await at([0, 3])));
  assert.deepEqual((await outline())[6], [0, 3]);
  await drag(await at([0, 3]), await at([1, 2.95]));
  const [x, y] = (await outline())[6];
  assert(Math.abs(x - 1) < 0.06 && Math.abs(y - 2.95) < 0.06, `${x}, ${y}`);
  await type("Corner x, m", "0.7");
  assert.equal((await outline())[6][0], 0.7);
  await page.locator(".corner").nth(6).focus();
  await page.keyboard.press("Delete");
  assert.equal((await outline()).length, 6);
  await page.locator(".corner").nth(3).focus();
  await drag(await at([3.2, 2.4]), await at([3.24, 1.9]));
  const [onLine, low] = (await outline())[3];
  assert(onLine === 3.2 && Math.abs(low - 1.9) < 0.05, `${onLine}, ${low}`);
  await page.getByRole("button", { name: "Undo" }).click();
  await page.locator(".corner").nth(1).focus();
  await type("Wall before it, m", "7");
  assert.deepEqual((await outline()).slice(0, 3), [[0, 0], [7, 0], [7, 2.4]]);
  await page.getByRole("button", { name: "Undo" }).click();

  await page.getByLabel("Ceiling shape").selectOption("gable");
  await type("Ridge, m", "4");
  await visitor.rests();
  const { draft: under } = await visitor.state();
  assert(under.tubes.every(({ drop_m }) => drop_m > 0), "openings hang below the slope");
  assert.equal(await page.getByRole("button", { name: "looking west" }).getAttribute("aria-pressed"), "true", "the section shows the ridge");
  await visitor.isAccessible("a hall below a gable");
  await looks(visitor, shot, "gable");
  await page.getByRole("button", { name: "looking north" }).click();
  await page.getByLabel("Ceiling shape").selectOption("flat");
  await type("Name", "Foyer");
  await page.getByLabel("Shape", { exact: true }).selectOption("rectangle");
  await visitor.rests();
  assert.equal(await name.inputValue(), "Foyer", "a name that was typed stays");
  assert.deepEqual((await visitor.state()).draft.room.size_m.slice(0, 2), [8, 6]);
  console.log(`  an L-shaped hall of one's own with two tubes: ${seconds.toFixed(1)} s`);
}

/** Keeps how the page looks at two widths, light and dark. */
async function looks(visitor, shot, name) {
  const { page } = visitor;
  const before = page.viewportSize();
  for (const colorScheme of ["dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    for (const [width, height] of [[1500, 900], [390, 844]]) {
      await page.setViewportSize({ width, height });
      await visitor.looksAsIn(shot(`${name}-${width}-${colorScheme}`));
    }
  }
  await page.setViewportSize(before);
}
