// Openings in slopes and walls: their geometry, and the control that turns them.
import assert from "node:assert/strict";
import { Visitor, until } from "./visit.mjs";

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

/** The attic of `rimsLieInTheirFaces` by its faces, every other one of which runs the other way. */
function faces() {
  const ridge = 2.2 + 4 * Math.tan((35 * Math.PI) / 180);
  const all = [
    ["floor", "floor", [[0, 0, 0], [5, 0, 0], [5, 4, 0], [0, 4, 0]]],
    ["south", "wall", [[0, 0, 0], [5, 0, 0], [5, 0, 2.2], [0, 0, 2.2]]],
    ["east", "wall", [[5, 0, 0], [5, 4, 0], [5, 4, ridge], [5, 0, 2.2]]],
    ["north", "wall", [[0, 4, 0], [5, 4, 0], [5, 4, ridge], [0, 4, ridge]]],
    ["west", "wall", [[0, 0, 0], [0, 4, 0], [0, 4, ridge], [0, 0, 2.2]]],
    ["roof", "ceiling", [[0, 0, 2.2], [5, 0, 2.2], [5, 4, ridge], [0, 4, ridge]]],
  ];
  return all.map(([name, kind, boundary_m], k) => ({ name, kind, boundary_m: k % 2 ? boundary_m.toReversed() : boundary_m }));
}

/** Openings have the same places in a room of faces as in the same room above a plan. */
export async function opensFaces({ page }) {
  const tubes = [
    { centre_m: [2, 1.5], normal: "face" },
    { centre_m: [2, 1.5], normal: "face", face: "roof" },
    { centre_m: [5, 1, 1.4], normal: "face" },
    { centre_m: [0, 1, 1.4], normal: "face" },
    { centre_m: [2, 0, 1.4], normal: "face" },
    { centre_m: [2, 4, 1.4], normal: "face" },
    { centre_m: [3, 2.5], drop_m: 0.4 },
  ];
  const places = await page.evaluate(
    async ([outline_m, faces, tubes]) => {
      const { opening } = await import("/web/opening.js");
      const above = { plan: { outline_m }, ceiling: { kind: "sloped", point_m: [0, 0, 2.2], rise_toward_deg: 0, pitch_deg: 35 } };
      return tubes.map((tube) => [opening({ faces }, tube), opening(above, tube)]);
    },
    [OUTLINE, faces(), tubes],
  );
  for (const [number, [found, expected]] of places.entries())
    for (const of of ["centre", "outward"]) expected[of].forEach((part, k) => near(found[of][k], part, `${of} of tube ${number}`));
}

/** The page of a job draws furniture, and openings as they are seen from above: in a slope lower than wide, in a wall a line. */
export async function seesOpeningsOfAJob(visitor) {
  const { page } = visitor;
  const table = [[1, 1], [2, 1], [2, 1.6], [1, 1.6]].map(([x, y]) => `v ${x} ${y} 0.72`);
  const obj = [...table, "usemtl top", "f 1 2 3 4"].join("\n");
  const posted = await fetch(`${visitor.url}/v1/meshes`, { method: "POST", headers: { "Content-Type": "model/obj" }, body: obj });
  const { id: mesh } = await posted.json();
  const tube = {
    normal: "face",
    diameter_m: 0.5,
    reflectance: 0.98,
    segments: [{ length_m: 0.8 }],
    collector: { kind: "dome", transmittance: 0.9 },
    diffuser: { kind: "lambertian", transmittance: 0.6 },
  };
  const surface = { reflectance: 0.5 };
  const document = {
    name: "An attic by its faces",
    sky: { cie_type: 16, diffuse_horizontal_illuminance_lux: 10000 },
    room: {
      faces: faces(),
      objects: [
        { kind: "box", size_m: [1.4, 0.7, 0.74], position_m: [3.6, 2.6, 0], rotation_deg: 20, surface },
        { kind: "mesh", mesh, unit: "m", position_m: [0, 0, 0], surfaces: { top: surface } },
      ],
      partitions: [],
    },
    tubes: [{ ...tube, centre_m: [2.5, 2.2] }, { ...tube, centre_m: [5, 1.2, 1.4], segments: [{ length_m: 0.4 }, { length_m: 0.8 }] }],
    grids: [{ name: "desk", height_m: 0.85, spacing_m: 0.25 }],
    stop: { relative_error: 0.05 },
  };
  const headers = { "Content-Type": "application/json", Prefer: "wait=50" };
  const { id, ...job } = await (await fetch(`${visitor.url}/v1/jobs`, { method: "POST", headers, body: JSON.stringify(document) })).json();
  assert(id, JSON.stringify(job));
  await visitor.open(`/jobs/${id}`);
  const plan = page.locator(".map .plan");
  await plan.locator(".models path.object").waitFor();
  assert.equal(await plan.locator("rect.object").count(), 1);
  const [slope, wall] = await plan.locator("path.ring").evaluateAll((rings) => rings.map((ring) => ring.getBBox()).map(({ width, height }) => ({ width, height })));
  assert(Math.abs(slope.height / slope.width - Math.cos((35 * Math.PI) / 180)) < 0.01, JSON.stringify(slope));
  assert(wall.width < 0.01 * wall.height, JSON.stringify(wall));
  await visitor.isAccessible("the job of a room of faces");
}

/** The opening of a tube is turned into the slope and into a wall, where keys move it along; plan, section and link follow. */
export async function turnsOpenings(visitor) {
  const { page } = visitor;
  await visitor.open("/");
  await visitor.rests();
  const shape = page.getByLabel("Diffuser is");
  await shape.selectOption("square");
  await visitor.current();
  assert.equal((await visitor.state()).job.document.tubes[0].closure_shape.side_m, 0.6);
  await shape.selectOption("round");
  await visitor.current();
  assert(!("closure_shape" in (await visitor.state()).draft.tubes[0]));
  const lies = page.getByLabel("Opening lies");
  assert.deepEqual(await lies.locator("option").evaluateAll((all) => all.map(({ value }) => value)), ["level", "wall"]);
  await page.getByLabel("Ceiling shape").selectOption("sloped");
  await visitor.current();
  const tube = async () => (await visitor.state()).draft.tubes[0];
  const level = await tube();
  assert(level.drop_m > 0 && level.normal === undefined);
  await page.locator(".tube").first().focus();
  await visitor.drawn();
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
  await visitor.drawn();
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
  const isInLink = () =>
    page.evaluate(async () => {
      const { unpacked } = await import("/web/share.js");
      const linked = await unpacked(location.hash);
      return JSON.stringify(linked?.draft.tubes) === JSON.stringify(seen.draft.tubes);
    });
  await until(isInLink, "the link has another room");
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
