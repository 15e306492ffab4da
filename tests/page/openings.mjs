// Openings in slopes and walls: their geometry, and the control that turns them.
import assert from "node:assert/strict";
import { Visitor } from "./visit.mjs";

const OUTLINE = [[0, 0], [5, 0], [5, 4], [0, 4]];
const near = (value, expected, what) => assert(Math.abs(value - expected) < 1e-9, `${what}: ${value}, not ${expected}`);

/** A rim lies in the plane of its face, a radius around its centre; a pipe leaves the room, whatever the sense of the outline. */
export async function rimsLieInTheirFaces({ page }) {
  const seen = await page.evaluate(async (outline) => {
    const { opening, rim } = await import("/web/opening.js");
    const of = (corners, centre_m) => {
      const room = { plan: { outline_m: corners }, ceiling: { kind: "sloped", point_m: [0, 0, 2.2], rise_toward_deg: 0, pitch_deg: 35 } };
      const tube = { centre_m, normal: "face", diameter_m: 0.4, segments: [{ length_m: 1 }] };
      return { ...opening(room, tube), rim: rim(room, tube, 24) };
    };
    return {
      slope: of(outline, [2, 1.5]),
      walls: [outline, outline.toReversed()].map((corners) => of(corners, [5, 1, 1.4])),
    };
  }, OUTLINE);
  const pitch = (35 * Math.PI) / 180;
  const { centre, outward, rim } = seen.slope;
  near(centre[2], 2.2 + 1.5 * Math.tan(pitch), "height");
  [0, -Math.sin(pitch), Math.cos(pitch)].forEach((part, k) => near(outward[k], part, "normal"));
  for (const corner of rim) {
    near(corner[2], 2.2 + corner[1] * Math.tan(pitch), "a rim in the slope");
    near(Math.hypot(...corner.map((part, k) => part - centre[k])), 0.2, "radius");
  }
  for (const { outward, rim } of seen.walls) {
    assert.deepEqual(outward.map(Math.round), [1, 0, 0]);
    for (const [x, y, z] of rim) {
      near(x, 5, "a rim in the wall");
      near(Math.hypot(y - 1, z - 1.4), 0.2, "radius");
    }
  }
}

/** The opening of a tube is turned into the slope and into a wall, where keys move it along; plan, section and link follow. */
export async function turnsOpenings(visitor) {
  const { page } = visitor;
  await visitor.open("/");
  await visitor.rests();
  const lies = page.getByLabel("Opening lies");
  assert.deepEqual(await lies.locator("option").evaluateAll((all) => all.map(({ value }) => value)), ["level", "wall"]);
  await page.getByLabel("Ceiling shape").selectOption("sloped");
  await visitor.current();
  const tube = async () => (await visitor.state()).draft.tubes[0];
  const level = await tube();
  assert(level.drop_m > 0 && level.normal === undefined);
  await page.locator(".tube").first().focus();
  await lies.selectOption("slope");
  await visitor.current();
  let now = await tube();
  assert.deepEqual([now.normal, now.drop_m, now.centre_m], ["face", undefined, level.centre_m]);
  // a circle seen at an angle is lower than wide
  const { width, height } = await page.locator(".plan .tube path.ring").first().boundingBox();
  assert(height < 0.95 * width || width < 0.95 * height, `${width} x ${height}`);
  assert.equal(await page.getByLabel("Drop, m").count(), 0);
  await lies.selectOption("wall");
  await visitor.current();
  now = await tube();
  assert.equal(now.centre_m.length, 3);
  assert((await visitor.state()).grid.statistics.mean_lux > 0);
  assert.equal(Number(await page.getByLabel("Height, m").inputValue()), now.centre_m[2]);
  await page.locator(".tube").first().focus();
  const onWall = async () => {
    const { metres } = await page.evaluate(async () => {
      const { nearestWall } = await import("/web/opening.js");
      return nearestWall(seen.draft.room, seen.draft.tubes[0].centre_m);
    });
    return metres;
  };
  for (const key of ["ArrowUp", "ArrowLeft", "ArrowRight", "ArrowRight"]) {
    await page.keyboard.press(key);
    assert((await onWall()) < 1e-3);
  }
  assert.notDeepEqual((await tube()).centre_m, now.centre_m);
  assert.equal((await tube()).centre_m[2], now.centre_m[2]);
  await visitor.current();
  await visitor.isAccessible("an opening in a wall");
  // the link has it
  const kept = await tube();
  await page.waitForTimeout(600);
  const { hash } = new URL(page.url());
  const second = await Visitor.of(visitor.context.browser(), visitor.url);
  await second.open(`/${hash}`);
  await second.current();
  assert.deepEqual((await second.state()).draft.tubes[0], kept);
  await second.close();
  // back below the ceiling, beside the wall
  await lies.selectOption("level");
  await visitor.current();
  now = await tube();
  assert.deepEqual([now.normal, now.centre_m.length], [undefined, 2]);
  assert((await onWall()) >= now.diameter_m / 2 - 0.01);
}
