// Single sensors: the directions that they face, and their place on the plan, in the form and among the numbers.
import assert from "node:assert/strict";
import { middle } from "./visit.mjs";

/** Directions with a name, and those by two angles, come back from their vectors. */
export async function knowsDirections({ page }) {
  const { named, typed, steep } = await page.evaluate(async () => {
    const { NAMED, angles, facing, faces, vector } = await import("/web/sensor.js");
    const sensor = (direction) => [1, 2, 1.2, ...direction];
    return {
      named: Object.entries(NAMED).map(([name, of]) => [name, facing(sensor(vector(...of))), vector(...of).join()]),
      typed: [[30, 20], [200, -45], [359, 0]].map((of) => angles(sensor(vector(...of)))),
      steep: [faces(sensor([0, 0, -3])), faces(sensor([0, 4, 0])), faces(sensor([1, 0, 1]))],
    };
  });
  for (const [name, found] of named) assert.equal(found, name);
  assert.deepEqual(named.map(([, , direction]) => direction), ["0,0,1", "0,1,0", "1,0,0", "0,-1,0", "-1,0,0"]);
  assert.deepEqual(typed, [[30, 20], [200, -45], [359, 0]]);
  assert.deepEqual(steep, ["down", "north", "east, 45° up"]);
}

/** A sensor is added and turned: level it has the light of the work plane at its place, vertical it has that of a job with its normal; it is moved, and removed. */
export async function placesSensors(visitor) {
  const { page } = visitor;
  await visitor.open("/");
  await page.locator("#mean").waitFor();
  const enter = async (label, value) => {
    const field = page.getByLabel(label, { exact: true });
    await field.fill(String(value));
    await field.press("Enter");
  };
  const sensors = () => page.evaluate(() => seen.draft.grids.at(-1).points_m ?? []);
  const lux = async () => {
    await visitor.rests();
    const row = page.locator(".at-sensors tbody tr").first();
    await row.waitFor();
    return Number(/([\d.]+) ±/.exec(await row.innerText())?.[1]);
  };
  await page.getByRole("button", { name: "Add a sensor" }).click();
  assert.deepEqual((await sensors()).map((sensor) => sensor.slice(2)), [[1.2, 0, 1, 0]], "eyes that look north");
  const { grid } = await visitor.state();
  const [column, row] = [3, 5];
  await enter("Sensor x, m", grid.x_m[column]);
  await enter("Sensor y, m", grid.y_m[row]);
  await enter("Sensor height, m", 0.85);
  const facing = page.getByLabel("Faces (north is up on the plan)");
  await facing.selectOption("up");
  const level = await lux();
  const map = (await visitor.state()).grid;
  const [value, error] = [map.illuminance_lux[row][column], map.standard_error_lux[row][column]];
  assert(Math.abs(level - value) < 6 * error + 1, `${level} lx at a sensor, ${value} on the map`);
  await facing.selectOption("east");
  const east = await lux();
  assert.deepEqual((await sensors())[0].slice(3), [1, 0, 0]);
  const { job } = await visitor.state();
  assert.equal(job.document.grids.at(-1).points_m[0][3], 1);
  const { body } = await visitor.get(job.links.grids.sensors);
  assert(Math.abs(east - body.illuminance_lux[0][0]) <= 0.5 && east < 0.9 * level, `${east} lx on a vertical plane, ${level} on a level one`);
  await facing.selectOption("other");
  await enter("Azimuth from north, °", 45);
  await enter("Up from level, °", 30);
  assert.deepEqual((await sensors())[0].slice(3), [0.612372, 0.612372, 0.5]);
  await page.locator(".at-sensors", { hasText: "north-east, 30° up" }).waitFor();
  await visitor.isAccessible("a sensor");
  const [x, y] = await middle(page.locator(".plan .sensor circle.seen"));
  const before = (await sensors())[0];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 30, y - 30, { steps: 4 });
  await page.mouse.up();
  const moved = (await sensors())[0];
  assert(moved[0] > before[0] + 0.1 && moved[1] > before[1] + 0.1, `${before} to ${moved}`);
  await page.keyboard.press("ArrowLeft");
  assert.equal(Math.round(100 * ((await sensors())[0][0] - moved[0])), -5);
  await page.locator(".plan .sensor").focus();
  await page.keyboard.press("Delete");
  await visitor.rests();
  assert.equal((await visitor.state()).draft.grids.length, 1);
  assert.equal(await page.locator(".at-sensors").count(), 0);
}
