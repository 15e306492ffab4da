// The room in three dimensions: what its modules compute, and what is drawn once it is opened.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { until } from "./visit.mjs";

const L = [[0, 0], [8, 0], [8, 3], [4, 3], [4, 6], [0, 6]];

/** Faces have the room's areas and are seen from inside: their normals close, and span its volume (the divergence theorem). */
export async function buildsClosedRooms({ page }) {
  const rooms = await page.evaluate(async (L) => {
    const [{ shapes, trapezoids }, { normal }, { rings }] = [await import("/web/view3d_shapes.js"), await import("/web/ray.js"), await import("/web/room.js")];
    const hole = [[1, 1], [2, 1], [2, 2], [1, 2]];
    const plan = { outline_m: L, holes_m: [hole] };
    const all = {
      box: { size_m: [4, 6, 2.7] },
      flat: { plan, ceiling: { kind: "flat", height_m: 2.7 } },
      turned: { plan: { outline_m: L.toReversed(), holes_m: [hole.toReversed()] }, ceiling: { kind: "flat", height_m: 2.7 } },
      sloped: { plan, ceiling: { kind: "sloped", point_m: [0, 0, 2], rise_toward_deg: 90, pitch_deg: 20 } },
      gable: { plan: { outline_m: [[0, 0], [8, 0], [8, 6], [0, 6]], holes_m: [[[3, 2], [4, 2], [4, 4], [3, 4]]] }, ceiling: { kind: "gable", eaves_m: 2, ridge_m: 3.5, ridge_azimuth_deg: 90 } },
    };
    const told = (room) => {
      const { polygons } = shapes({ room, tubes: [] }, null);
      const faces = polygons.filter(({ part }) => ["floor", "wall", "ceiling"].includes(part)).map(({ part, ring }) => ({ part, ring, across: normal(ring) }));
      const sum = (of) => faces.reduce((all, face) => all + of(face), 0);
      return {
        closes: [0, 1, 2].map((k) => sum(({ across }) => across[k] / 2)),
        // the normals point into the room
        volume: -sum(({ ring, across }) => (ring[0][0] * across[0] + ring[0][1] * across[1] + ring[0][2] * across[2]) / 6),
        floor: sum(({ part, across }) => (part === "floor" ? across[2] / 2 : 0)),
        pieces: trapezoids(rings(room).map((ring) => ring.map(([x, y]) => [x, y, 0]))).length,
      };
    };
    return Object.fromEntries(Object.entries(all).map(([name, room]) => [name, told(room)]));
  }, L);
  const slope = Math.tan((20 * Math.PI) / 180);
  // mean height of a plane is that over the centroid; the L is two boxes, less the column
  const under = (area, x) => area * (2 + slope * x);
  const expected = {
    box: [24, 64.8],
    flat: [35, 35 * 2.7],
    turned: [35, 35 * 2.7],
    sloped: [35, under(24, 4) + under(12, 2) - under(1, 1.5)],
    // the column stands below the ridge, from 1 m before it to 1 m behind it
    gable: [46, 48 * 2.75 - 2 * 3.25],
  };
  for (const [name, [floor, volume]] of Object.entries(expected)) {
    const of = rooms[name];
    assert(Math.abs(of.floor - floor) < 1e-9, `${name}: a floor of ${of.floor} m2`);
    assert(Math.abs(of.volume - volume) < 1e-9, `${name}: ${of.volume} m3, not ${volume}`);
    assert(Math.hypot(...of.closes) < 1e-9, `${name}: ${of.closes}`);
  }
  assert.equal(rooms.box.pieces, 1);
}

/** Pipes keep their width in every piece and around their mitres; domes close them; hanging openings hang. */
export async function buildsPipes({ page }) {
  const { wall, radius, closure, top, square } = await page.evaluate(async () => {
    const [{ normal }, { shapes }] = [await import("/web/ray.js"), await import("/web/view3d_shapes.js")];
    const segments = [{ length_m: 1 }, { length_m: 2, tilt_deg: 40, azimuth_deg: 90 }];
    const tube = { centre_m: [2, 3], diameter_m: 0.4, drop_m: 0.2, segments, reflectance: 0.98, collector: { kind: "dome", transmittance: 0.9 }, diffuser: { kind: "lambertian", transmittance: 0.6 } };
    const of = (tube) => shapes({ room: { size_m: [4, 6, 2.7] }, tubes: [tube] }, null).polygons;
    const polygons = of(tube);
    const pipe = polygons.filter(({ part }) => part === "pipe").map(({ ring }) => ring);
    const u = [Math.sin((40 * Math.PI) / 180), 0, Math.cos((40 * Math.PI) / 180)];
    // distances to the axis of the upper piece, of its corners
    const upper = pipe.slice(pipe.length / 2).flat();
    const radius = upper.map(([x, y, z]) => {
      const p = [x - 2, y - 3, z - 3.5];
      const along = p[0] * u[0] + p[1] * u[1] + p[2] * u[2];
      return Math.hypot(...p.map((value, k) => value - along * u[k]));
    });
    return {
      wall: pipe.reduce((sum, ring) => sum + Math.hypot(...normal(ring)) / 2, 0),
      radius: [Math.min(...radius), Math.max(...radius)],
      closure: polygons.find(({ part }) => part === "closure").ring.map(([, , z]) => z),
      top: Math.max(...polygons.filter(({ part }) => part === "cover").flatMap(({ ring }) => ring.map(([, , z]) => z))),
      square: of({ ...tube, closure_shape: { kind: "square", side_m: 0.6, rotation_deg: 30 } }).find(({ part }) => part === "closure").ring,
    };
  });
  // a prism of 24 sides around a circle is narrower by a share of (pi / 24)^2 / 6; mitres leave the mean length as it is
  const around = 24 * 2 * 0.2 * Math.sin(Math.PI / 24);
  assert(Math.abs(wall - around * 3) < 2e-3 * wall, `${wall} m2 of pipe, not ${around * 3}`);
  for (const metres of radius) assert(Math.abs(metres - 0.2) < 1e-9, `${radius}`);
  assert(closure.every((z) => Math.abs(z - 2.5) < 1e-9));
  const end = 3.5 + 2 * Math.cos((40 * Math.PI) / 180);
  assert(top > end && top <= end + 0.2 + 1e-9, `a dome of ${top} m over an end at ${end} m`);
  const [[x1, y1], [x2, y2]] = square;
  assert(Math.abs(Math.hypot(x2 - x1, y2 - y1) - 0.6) < 1e-9 && Math.abs(Math.atan2(y2 - y1, x2 - x1) + Math.PI / 6) < 1e-9, "30 degrees clockwise");
}

/** The room fills the picture across or down from all sides, in the middle of it; east is to the right from the south; keys move the camera within bounds. */
export async function turnsACamera({ page }) {
  const of = await page.evaluate(async () => {
    const { FILLED, STARTS, byKey, projection, turned, zoomed } = await import("/web/view3d_camera.js");
    const middle = [2, 3, 1];
    const points = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 1 ? 4 : -4, k & 2 ? 3 : -3, k & 4 ? 1.5 : -1]);
    const south = { azimuth_deg: 180, altitude_deg: 20, zoom: 1 };
    const seen = (orbit, aspect, [x, y, z]) => {
      const m = projection(orbit, { middle, radius: 5.3, points }, aspect);
      const [a, b, c, w] = [0, 1, 2, 3].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
      return [a / w, b / w, c / w];
    };
    // least and greatest place of the corners in the picture, across and down
    const extents = (orbit, aspect) => {
      const places = points.map((point) => seen(orbit, aspect, point.map((value, k) => value + middle[k])));
      return { ends: [0, 1].map((k) => [Math.min, Math.max].map((of) => of(...places.map((place) => place[k])))), inside: places.every(([, , depth]) => Math.abs(depth) < 1) };
    };
    const orbits = [south, STARTS.corner, STARTS.above, { azimuth_deg: 70, altitude_deg: -40, zoom: 1 }];
    return {
      filled: FILLED,
      extents: orbits.flatMap((orbit) => [2, 1, 0.5].map((aspect) => extents(orbit, aspect))),
      nearer: extents({ ...south, zoom: 2 }, 1).ends[0][1],
      centre: seen(south, 1.5, middle),
      east: seen(south, 1.5, [3, 3, 1]),
      up: seen(south, 1.5, [2, 3, 2]),
      near: seen(south, 1.5, [2, 2, 1])[2] < seen(south, 1.5, [2, 4, 1])[2],
      keys: ["ArrowLeft", "ArrowUp", "+", "Home", "a"].map((key) => byKey(south, key)),
      bounds: [turned(south, 0, 500).altitude_deg, turned(south, 0, -500).altitude_deg, turned(south, 200, 0).azimuth_deg, zoomed(south, 1e6).zoom],
      corner: STARTS.corner,
    };
  });
  assert(Math.abs(of.centre[0]) < 1e-12);
  assert(of.east[0] > 0 && of.up[1] > of.centre[1] && Math.abs(of.up[0]) < 1e-12 && of.near);
  for (const { ends, inside } of of.extents) {
    assert(inside && ends.flat().every((end) => Math.abs(end) < of.filled + 1e-9), JSON.stringify(ends));
    assert(ends.some(([least, greatest]) => Math.abs(least + of.filled) < 1e-9 && Math.abs(greatest - of.filled) < 1e-9), JSON.stringify(ends));
  }
  assert(of.nearer > 1.5, `${of.nearer}`);
  assert.deepEqual(of.keys.map((orbit) => orbit && [orbit.azimuth_deg, orbit.altitude_deg, orbit.zoom]), [[185, 20, 1], [180, 25, 1], [180, 20, 1.15], Object.values(of.corner), null]);
  assert.deepEqual(of.bounds, [89, -40, 20, 8]);
}

/** Colours of the view, as the browser has them once it is drawn. */
const pixels = (page, key) =>
  page.locator(".space canvas").evaluate(
    (canvas, key) =>
      new Promise((resolve) => {
        canvas.dispatchEvent(new KeyboardEvent("keydown", { key }));
        // after the frame that the key asked for
        requestAnimationFrame(() => {
          const gl = canvas.getContext("webgl2");
          const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
          const data = new Uint8Array(4 * width * height);
          gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
          const counts = {};
          const [columns, rows] = [new Set(), new Set()];
          for (let i = 0; i < data.length; i += 4) {
            const colour = data.slice(i, i + 4).join();
            counts[colour] = (counts[colour] ?? 0) + 1;
            if (!data[i + 3]) continue;
            columns.add((i / 4) % width);
            rows.add(Math.floor(i / 4 / width));
          }
          resolve({ counts, all: width * height, reached: [columns.size / width, rows.size / height] });
        });
      }),
    key,
  );

/** Nothing of the view is loaded before it is opened; then it has the plan's colours, follows room and pointer, and ends when it is closed. */
export async function opensTheView(visitor, shot) {
  const { page } = visitor;
  const asked = [];
  page.on("request", (request) => request.url().includes("view3d_") && asked.push(request.url()));
  await visitor.open("/");
  await visitor.rests();
  // the modules of the tests before are not the page's
  assert.deepEqual(asked, []);
  await visitor.opens("In three dimensions");
  await page.waitForFunction(() => document.querySelector(".space canvas").width !== 300);
  assert(asked.length >= 4, `${asked}`);
  const first = await pixels(page, "Home");
  const drawn = first.all - (first.counts["0,0,0,0"] ?? 0);
  assert(drawn > 0.2 * first.all, `${drawn} of ${first.all} pixels are drawn`);
  assert(Math.max(...first.reached) > 0.85, `the drawing reaches over ${first.reached}`);
  // one of the cells of the plan is seen in its very colour
  const cells = await page.evaluate(async () => {
    const [{ shown }, { rising }] = [await import("/web/plan.js"), await import("/web/scale.js")];
    const { rows, end } = shown();
    return rows.flat().map((value) => `${rising(value / end)},255`);
  });
  const seen = cells.filter((colour) => first.counts[colour] > 20).length;
  assert(seen > cells.length / 2, `${seen} of ${cells.length} cells have their colour`);
  const turned = await pixels(page, "ArrowLeft");
  assert.notDeepEqual(turned.counts, first.counts);
  await page.locator(".space canvas").scrollIntoViewIfNeeded();
  const { x, y, width, height } = await page.locator(".space canvas").boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(x + width / 2 + 60, y + height / 2 + 20);
  await page.mouse.up();
  const dragged = await pixels(page, "Shift");
  assert.notDeepEqual(dragged.counts, turned.counts);
  const before = page.viewportSize();
  for (const colorScheme of ["dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    for (const [width, height] of [[1500, 900], [390, 844]]) {
      await page.setViewportSize({ width, height });
      await page.locator(".space canvas").scrollIntoViewIfNeeded();
      await visitor.isAccessible(`the view, ${width} px, ${colorScheme}`);
      await visitor.looksAsIn(shot(`view3d-${width}-${colorScheme}`));
    }
  }
  await page.setViewportSize(before);
  // closed, it gives back what it took; open again, it is drawn anew
  for (const times of ["once", "again"]) {
    await page.evaluate(() => (globalThis.before = document.querySelector(".space canvas")));
    await page.locator(".space > summary").click();
    await page.waitForFunction(() => before.getContext("webgl2").isContextLost() && !before.isConnected);
    await visitor.opens("In three dimensions");
    await page.waitForFunction(() => document.querySelector(".space canvas").getContext("webgl2"));
    const { counts } = await pixels(page, "Home");
    assert(Object.keys(counts).length > 20, `${Object.keys(counts).length} colours when it is opened ${times}`);
  }
  await page.getByLabel("Light on all faces").check();
  const link = page.locator(".space").getByRole("link", { name: "scene.glb" });
  await link.waitFor();
  // walls have the colours of their light in the scale of the plan
  await visitor.rests();
  const walls = await page.evaluate(async () => {
    const [{ shown }, { rising }] = [await import("/web/plan.js"), await import("/web/scale.js")];
    const { faces } = await (await fetch(seen.answer.job.links.surfaces)).json();
    const lit = faces.filter(({ name }) => name.startsWith("wall")).flatMap(({ patches }) => patches);
    return lit.map(({ illuminance_lux: lux }) => `${rising(lux / shown().end)},255`);
  });
  const litWalls = async () => {
    const { counts } = await pixels(page, "Home");
    return new Set(walls.filter((colour) => counts[colour] > 20)).size > 20;
  };
  await until(litWalls, "walls have no light");
  const [download] = await Promise.all([page.waitForEvent("download"), link.click()]);
  assert.equal(readFileSync(await download.path()).subarray(0, 4).toString(), "glTF");
  await page.getByLabel("Light on all faces").uncheck();
  await page.locator(".space > summary").click();
  await visitor.rests();
}

/** A red table from an OBJ file stands where the service has put it, in both of its copies, and is seen from both sides. */
export async function drawsModels(visitor) {
  const { page } = visitor;
  const body = "v -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0.5 0.5 0\nv -0.5 0.5 0\nusemtl red\nf 1 2 3 4\n";
  const { id } = await (await fetch(`${visitor.url}/v1/meshes`, { method: "POST", headers: { "Content-Type": "model/obj" }, body })).json();
  await visitor.open("/");
  await visitor.rests();
  await visitor.opens("In three dimensions");
  await page.waitForFunction(() => document.querySelector(".space canvas").width !== 300);
  const red = async () => {
    const { counts } = await pixels(page, "Home");
    const of = (colour) => colour.split(",").map(Number);
    return Object.entries(counts).reduce((sum, [colour, count]) => sum + (of(colour)[0] > 3 * of(colour)[1] && of(colour)[0] > 3 * of(colour)[2] ? count : 0), 0);
  };
  assert.equal(await red(), 0);
  await page.evaluate(async (id) => {
    const { edit } = await import("/web/live.js");
    const instances = [1, 3].map((y) => ({ position_m: [1, y, 1.5], rotation_deg: 20 }));
    edit(({ room }) => (room.objects = [{ kind: "mesh", mesh: id, unit: "m", instances, surfaces: { red: { reflectance: [0.8, 0.02, 0.02] } } }]));
  }, id);
  await until(async () => (await red()) > 1000, "the tables are not drawn");
  // plan and section have their outlines: squares of one metre, turned by 20 degrees, and lines
  const outlines = (of) => page.locator(`${of} .models .object`).evaluateAll((all) => all.map((path) => path.getAttribute("d").match(/-?[\d.]+/g).map(Number)));
  const reach = 0.5 * (Math.cos(Math.PI / 9) + Math.sin(Math.PI / 9));
  const [plan, section] = [await outlines(".plan"), await outlines(".section")];
  assert.deepEqual([plan.length, section.length], [2, 2]);
  const ends = (numbers, axis) => [Math.min, Math.max].map((of) => of(...numbers.filter((_, k) => k % 2 === axis)));
  plan.forEach((numbers, copy) => {
    [[0, 1], [1, 1 + 2 * copy]].forEach(([axis, middle]) => ends(numbers, axis).forEach((end, side) => assert(Math.abs(end - middle - (side ? reach : -reach)) < 1e-3, `${numbers}`)));
  });
  for (const numbers of section) assert.deepEqual(ends(numbers, 1), [1.5, 1.5]);
  await page.evaluate(async () => (await import("/web/live.js")).undo());
  await until(async () => (await red()) === 0, "the tables stay");
  assert.deepEqual(await outlines(".plan"), []);
  await page.locator(".space > summary").click();
  await visitor.rests();
}
