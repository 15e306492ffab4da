// What the page's modules compute of rooms above a plan, asked of them in the browser.
import assert from "node:assert/strict";

const L = [[0, 0], [8, 0], [8, 3], [4, 3], [4, 6], [0, 6]];

/** Points within outlines and holes, and their distances to the walls; outlines as paths. */
export async function knowsInsides({ page }) {
  const { inside, clear, drawn } = await page.evaluate(async (L) => {
    const { clearance, isInside, path } = await import("/web/outline.js");
    const rings = [L, [[1, 1], [2, 1], [2, 2], [1, 2]]];
    const points = [[6, 1.5], [6, 4.5], [2, 5], [1.5, 1.5], [-1, 1], [3.9, 5.9]];
    return {
      inside: points.map((point) => isInside(rings, point)),
      clear: points.map((point) => Math.round(1000 * clearance(rings, point)) / 1000),
      drawn: path([L.slice(0, 3)], (x) => 10 * x, (y) => 100 - 10 * y),
    };
  }, L);
  assert.deepEqual(inside, [true, false, true, false, false, true]);
  assert.deepEqual(clear, [1.5, -1.5, 1, -0.5, -1, 0.1]);
  assert.equal(drawn, "M0 100L80 100L80 70Z");
}

/** Corners snap to lines with their neighbours and to right angles; they are added on edges; walls at right angles move as a whole. */
export async function editsOutlines({ page }) {
  const { at, added, longer, shorter, walls, skew } = await page.evaluate(async (L) => {
    const { snapped, withCorner, withLength, withWall } = await import("/web/outline.js");
    const turned = L.map(([x, y]) => [0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y]);
    const [x, y] = turned[3];
    return {
      at: [[4.05, 3.04], [4.5, 3.04], [4.503, 3.501], [7.99, 3.02]].map((place) => snapped(L, 3, place, 0.1)),
      added: withCorner(L, 0, [3.01, 0.3]),
      longer: withLength(L, 0, 9),
      shorter: withLength(L, 1, 2),
      // the eastern wall, that of the notch beyond its end, one between leaning walls, and one that goes on straight
      walls: [
        withWall(L, 1, [1.504, 7]),
        withWall(L, 2, [0, 5]),
        withWall([[0, 0], [4, 0], [3, 2], [1, 2]], 2, [0, 1]),
        withWall([[0, 0], [2, 0], [4, 0], [4, 3], [0, 3]], 0, [0, -1]),
      ],
      skew: snapped(turned, 3, [x + 0.03, y - 0.02], 0.1).map((of, axis) => of - turned[3][axis]),
    };
  }, L);
  assert.deepEqual(at, [[4, 3], [4.5, 3], [4.5, 3.5], [7.99, 3.02]]);
  assert.deepEqual(added, L.toSpliced(1, 0, [3, 0]));
  assert.deepEqual(longer, [[0, 0], [9, 0], [9, 3], [4, 3], [4, 6], [0, 6]]);
  assert.deepEqual(shorter, [[0, 0], [8, 0], [8, 2], [4, 2], [4, 6], [0, 6]]);
  assert.deepEqual(walls, [
    [[0, 0], [9.5, 0], [9.5, 3], [4, 3], [4, 6], [0, 6]],
    [[0, 0], [8, 0], [8, 5.9], [4, 5.9], [4, 6], [0, 6]],
    [[0, 0], [4, 0], [2.5, 3], [1.5, 3]],
    [[0, -1], [2, -1], [4, 0], [4, 3], [0, 3]],
  ]);
  assert(Math.hypot(...skew) < 1e-3, `a right angle of turned walls: ${skew}`);
}

/** Shapes are known again, in either sense; a rectangle below a level ceiling is a box, with its tubes and walls. */
export async function choosesShapes({ page }) {
  const { shapes, hall, back } = await page.evaluate(async () => {
    const [{ changed }, { setCeiling, setShape }, { outlineOf, shapeOf }] = [
      await import("/web/draft.js"),
      await import("/web/draft_plan.js"),
      await import("/web/outline.js"),
    ];
    const between = { west: 1, south: 2, east: 9, north: 8 };
    const drawn = ["rectangle", "L", "U", "T"].map((shape) => outlineOf(shape, between));
    const tube = { centre_m: [7, 5], diameter_m: 0.35, segments: [{ length_m: 1 }] };
    const box = {
      room: { size_m: [8, 6, 2.7], surfaces: { wall_north: { reflectance: 0.1 } } },
      tubes: [tube],
      grids: [{ name: "desk", height_m: 0.85, cells: [32, 24] }],
    };
    const gable = changed(box, (draft) => setCeiling(draft, "gable"));
    return {
      shapes: [...drawn, ...drawn.map((outline) => outline.toReversed()), [[0, 0], [4, 0], [2, 3]]].map(shapeOf),
      hall: changed(box, (draft) => setShape(draft, "L")),
      back: [gable.tubes[0].drop_m, gable.room.surfaces, changed(gable, (draft) => setCeiling(draft, "flat"))],
    };
  });
  assert.deepEqual(shapes, ["rectangle", "L", "U", "T", "rectangle", "L", "U", "T", "free"]);
  assert.deepEqual(hall.room.plan.outline_m, [[0, 0], [8, 0], [8, 2.4], [3.2, 2.4], [3.2, 6], [0, 6]]);
  assert.deepEqual(hall.room.ceiling, { kind: "flat", height_m: 2.7 });
  assert.deepEqual(hall.grids, [{ name: "desk", height_m: 0.85, spacing_m: 0.4 }]);
  const [x, y] = hall.tubes[0].centre_m;
  assert(x < 3.2 || y < 2.4, "a tube in the notch comes in");
  // it was at (7, 5)
  assert(Math.hypot(x - 7, y - 5) < 4, `it comes to a far place: ${x}, ${y}`);
  const [drop, surfaces, box] = back;
  // 0.175 m at a rise of 1.73 m in 3 m
  assert.equal(drop, 0.11);
  assert.deepEqual(surfaces, { wall_2: { reflectance: 0.1 } });
  assert.deepEqual(box.room, { size_m: [8, 6, 2.7], surfaces: { wall_north: { reflectance: 0.1 } } });
  assert.deepEqual(box.grids[0].cells, [32, 24]);
}

/** Ceilings over a plan: their heights, and the faces that a section shows. */
export async function raisesCeilings({ page }) {
  const { heights, ends, areas } = await page.evaluate(async (L) => {
    const { ceilingAt, extent, faces } = await import("/web/room.js");
    const gable = { plan: { outline_m: L }, ceiling: { kind: "gable", eaves_m: 2, ridge_m: 5, ridge_azimuth_deg: 90 } };
    const sloped = { plan: { outline_m: L }, ceiling: { kind: "sloped", point_m: [0, 0, 2], rise_toward_deg: 0, pitch_deg: 45 } };
    const area = (ring, [a, b]) =>
      Math.abs(ring.reduce((sum, p, k) => sum + p[a] * ring[(k + 1) % ring.length][b] - p[b] * ring[(k + 1) % ring.length][a], 0)) / 2;
    return {
      heights: [gable, sloped].map((room) => [[0, 0], [2, 3], [1, 4.5]].map((point) => ceilingAt(room, point))),
      ends: [gable, sloped, { size_m: [4, 6, 2.7] }].map(extent).map(({ width, depth, lowest, height }) => [width, depth, lowest, height]),
      // the ceilings from above; the gable's end in the west
      areas: [...faces(gable).slice(6).map((face) => area(face, [0, 1])), area(faces(gable)[5], [1, 2])],
    };
  }, L);
  const close = (found, known) =>
    found.flat().forEach((value, k) => assert(Math.abs(value - known.flat()[k]) < 1e-9, `${found.flat()} for ${known.flat()}`));
  close(heights, [[2, 5, 3.5], [2, 5, 6.5]]);
  close(ends, [[8, 6, 2, 5], [8, 6, 2, 8], [4, 6, 2.7, 2.7]]);
  close(areas, [12, 24, 21]);
}

/** Isolux lines of a plan go to its walls, and no further than half a cell beyond. */
export async function reachesWalls({ page }) {
  const line = await page.evaluate(async (L) => {
    const { carriedOut, lines } = await import("/web/isolux.js");
    const grid = { x_m: Array.from({ length: 20 }, (_, i) => 0.2 + 0.4 * i), y_m: Array.from({ length: 15 }, (_, j) => 0.2 + 0.4 * j) };
    const rows = grid.y_m.map((y) => grid.x_m.map((x) => (x > 4 && y > 3 ? NaN : x + 10 * y)));
    return lines(grid, carriedOut(grid, rows, [L]), 50);
  }, L);
  assert.equal(line.length, 1);
  const ends = line[0].map(([x]) => x).sort((a, b) => a - b);
  assert(Math.abs(ends[0]) < 1e-9, `from ${ends[0]}`);
  assert(ends.at(-1) >= 4 && ends.at(-1) <= 4.2 + 1e-9, `to ${ends.at(-1)}`);
}

/** A room of faces has the plan of its floors, with their holes, and the extent of all faces. */
export async function readsRoomsOfFaces({ page }) {
  const of = await page.evaluate(async () => {
    const { extent, hasPlan, outline, rings } = await import("/web/room.js");
    const hole = [[1, 1, 0], [2, 1, 0], [2, 2, 0]];
    const faces = [
      { name: "back", kind: "wall", boundary_m: [[0, 5, 0], [4, 5, 0], [4, 5, 2.4], [0, 5, 2.4]] },
      { name: "front", kind: "floor", boundary_m: [[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], holes_m: [hole] },
      { name: "rear", kind: "floor", boundary_m: [[0, 3, 0], [4, 3, 0], [4, 5, 0], [0, 5, 0]] },
      { name: "roof", kind: "ceiling", boundary_m: [[0, 0, 3.1], [4, 0, 3.1], [4, 5, 2.4], [0, 5, 2.4]] },
    ];
    const room = { faces };
    return { extent: extent(room), hasPlan: hasPlan(room), first: outline(room), rings: rings(room).map((ring) => ring.length) };
  });
  assert.deepEqual(of.extent, { west: 0, south: 0, east: 4, north: 5, width: 4, depth: 5, lowest: 2.4, height: 3.1 });
  assert.deepEqual([of.hasPlan, of.first[2], of.rings], [true, [4, 3], [4, 3, 4]]);
}

/** Lengths of walls that are near each other do not lie over each other. */
export async function tellsLengthsApart({ page }) {
  const boxes = await page.evaluate(async () => {
    const [{ walls }, { layout }, { render, svg }] = [await import("/web/plan_walls.js"), await import("/web/room_plan.js"), await import("/web/vendor/lit-html.js")];
    const room = { plan: { outline_m: [[0, 0], [4, 0], [4, 6], [2.6, 6], [2.6, 2.4], [1.4, 2.4], [1.4, 6], [0, 6]] }, ceiling: { kind: "flat", height_m: 2.7 } };
    const host = document.body.appendChild(document.createElement("div"));
    render(svg`<svg>${walls(room, layout(room, [340, 400]))}</svg>`, host);
    const found = [...host.querySelectorAll(".length")].map((text) => [text.textContent, text.getBBox()].map((of) => (typeof of === "string" ? of : [of.x, of.y, of.x + of.width, of.y + of.height])));
    host.remove();
    return found;
  });
  assert.deepEqual(boxes.map(([text]) => text).sort(), ["1.2 m", "1.4 m", "1.4 m", "3.6 m", "3.6 m"]);
  for (const [i, [a, [left, top, right, bottom]]] of boxes.entries())
    for (const [b, [toLeft, toTop, toRight, toBottom]] of boxes.slice(i + 1))
      assert(right <= toLeft || toRight <= left || bottom <= toTop + 2 || toBottom <= top + 2, `${a} lies over ${b}`);
}
