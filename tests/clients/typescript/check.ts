// Sends every example by the generated types, and reads what comes back by them.
// Usage: node built/check.js URL EXAMPLES
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import createClient from "openapi-fetch";
import { examples } from "./examples.js";
import type { components, paths } from "./schema.js";

type Schemas = components["schemas"];

/** What each event carries, as `x-events` of the description says. */
interface Events {
  queued: Schemas["QueuedEvent"];
  planned: Schemas["PlannedEvent"];
  started: Schemas["StartedEvent"];
  pass: Schemas["PassEvent"];
  image: Schemas["ImageEvent"];
  phase: Schemas["PhaseEvent"];
  succeeded: Schemas["SucceededEvent"];
  failed: Schemas["FailedEvent"];
  cancelled: Schemas["CancelledEvent"];
}
type Event = { [Name in keyof Events]: { name: Name; data: Events[Name] } }[keyof Events];

const [url = "", folder = ""] = process.argv.slice(2);
const client = createClient<paths>({ baseUrl: url });

/** The events of a job until its end. */
async function* events(path: string): AsyncGenerator<Event> {
  const response = await fetch(url + path);
  let text = "";
  for await (const chunk of response.body!.pipeThrough(new TextDecoderStream()) as unknown as AsyncIterable<string>) {
    text += chunk;
    const blocks = text.split("\n\n");
    text = blocks.pop() ?? "";
    for (const block of blocks) {
      const field = (name: string) => block.split("\n").find((line) => line.startsWith(`${name}:`))?.slice(name.length + 1).trim();
      const [name, data] = [field("event"), field("data")];
      if (name && data) yield { name, data: JSON.parse(data) } as Event;
    }
  }
}

async function upload(kind: "/v1/meshes" | "/v1/models" | "/v1/weather", file: string): Promise<string> {
  const bytes = await readFile(file);
  const { data, error } = await client.POST(kind, {
    body: bytes.toString(),
    headers: { "Content-Type": "application/octet-stream" },
    bodySerializer: (body) => body,
  });
  assert(data, JSON.stringify(error));
  return data.id;
}

async function check(name: string, document: Schemas["JobDocument"]) {
  document.stop = { ...document.stop, max_passes: 2, max_seconds: 20 };
  for (const view of document.views ?? []) view.size_px = [32, 24];
  for (const tube of document.tubes ?? []) if ("mesh" in tube) tube.mesh = await upload("/v1/meshes", join(folder, tube.mesh));
  if (typeof document.room.hbjson === "string") document.room.hbjson = await upload("/v1/models", join(folder, document.room.hbjson));
  if (document.annual) {
    const files = [document.annual.weather].flat();
    document.annual.weather = await Promise.all(files.map((file) => upload("/v1/weather", join(folder, file))));
  }
  const planned = await client.POST("/v1/plan", { body: document });
  assert(planned.data, JSON.stringify(planned.error));
  const posted = await client.POST("/v1/jobs", { body: document });
  assert(posted.data, JSON.stringify(posted.error));
  assert.deepEqual(posted.data.provenance, planned.data.provenance);
  let passes = 0;
  let last: Event | undefined;
  for await (const event of events(posted.data.links.events)) {
    if (event.name === "pass") passes = event.data.passes;
    last = event;
  }
  assert(last?.name === "succeeded", JSON.stringify(last));
  assert.equal(last.data.progress.passes, passes);
  const path = { id: posted.data.id };
  for (const grid of document.grids ?? []) {
    const { data } = await client.GET("/v1/jobs/{id}/grids/{name}.json", { params: { path: { ...path, name: grid.name } } });
    assert(data && data.statistics && data.statistics.mean_lux > 0);
    assert(data.cells);
    assert.equal(data.illuminance_lux.length, data.cells[1]);
    const table = await client.GET("/v1/jobs/{id}/grids/{name}.csv", { params: { path: { ...path, name: grid.name } }, parseAs: "text" });
    assert(table.data && table.data.includes(","));
  }
  for (const tube of (document.tubes ?? []).keys()) {
    const { data } = await client.GET("/v1/jobs/{id}/tubes/{tube}.json", { params: { path: { ...path, tube: `${tube}` } } });
    assert(data);
  }
  const convergence = await client.GET("/v1/jobs/{id}/convergence", { params: { path } });
  assert(convergence.data);
  console.log(`  ${name}: ${passes} passes`);
}

for (const [name, document] of Object.entries(examples)) await check(name, document);
const { error, response } = await client.POST("/v1/jobs", { body: { room: { size_m: [1, 1] } } });
assert.equal(response.status, 422);
assert(error && error.errors && error.errors.length > 0);
