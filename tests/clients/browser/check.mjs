// In headless Chromium: what pages of other origins may do, and whether the page at /docs/ sends a document that is accepted.
// Usage: check.mjs EXAMPLES, with SCRATCH naming a folder for the service's data.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { chromium } from "playwright-core";

const document = JSON.parse(readFileSync(join(process.argv[2], "thesis_room.json"), "utf8"));
document.stop = { max_passes: 2 };
document.views = [];

/** A server of an empty page; its origin is another site than the service's. */
async function pages() {
  const server = createServer((_, response) => {
    response.setHeader("content-type", "text/html");
    response.end("<!doctype html><title>elsewhere</title>");
  });
  server.listen(0, "localhost");
  await once(server, "listening");
  return { origin: `http://localhost:${server.address().port}`, close: () => server.close() };
}

async function service(cors_origins) {
  const environment = {
    SKYDUCT_LISTEN: "127.0.0.1:0",
    SKYDUCT_LOG__LEVEL: "warn",
    SKYDUCT_DATA: join(process.env.SCRATCH, "browser"),
    SKYDUCT_CORS_ORIGINS: JSON.stringify(cors_origins),
  };
  const child = spawn(process.env.CLIENTS_BINARY, ["serve"], { env: { ...process.env, ...environment }, stdio: ["ignore", "pipe", "inherit"] });
  for await (const line of createInterface({ input: child.stdout })) {
    const url = /^listening on (\S+)/.exec(line)?.[1];
    if (url) return { url, close: () => child.kill() };
  }
  throw new Error("the service did not start");
}

/** In the page: posts a job; answers what the page may see of it, or the error. */
async function post({ url, document }) {
  try {
    const headers = { "Content-Type": "application/json", "Idempotency-Key": crypto.randomUUID() };
    const response = await fetch(`${url}/v1/jobs`, { method: "POST", headers, body: JSON.stringify(document) });
    const seen = (name) => response.headers.get(name);
    const job = await response.json();
    const again = await fetch(url + job.links.self);
    return {
      status: response.status, location: seen("location"), retry: seen("retry-after"), id: seen("x-request-id"),
      etag: again.headers.get("etag"), self: job.links.self,
    };
  } catch (error) {
    return { error: String(error) };
  }
}

/** The function of docs/clients.md that follows a job. */
const follow = /```js\n([^]*?)```/.exec(readFileSync("docs/clients.md", "utf8"))[1];

/** In the page: the names of a job's events until it ends. */
const events = (address) =>
  `${follow}; (async () => { const names = []; await follow(${JSON.stringify(address)}, (name) => names.push(name)); return names; })()`;

const [listed, other] = [await pages(), await pages()];
const skyduct = await service([listed.origin]);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync"],
});
try {
  const { url } = skyduct;
  const page = await browser.newPage();
  // beside other tests of a slow machine the page at /docs/, which draws the whole description, takes a minute
  page.setDefaultTimeout(300_000);
  await page.goto(listed.origin);
  const posted = await page.evaluate(post, { url, document });
  assert.equal(posted.status, 202, JSON.stringify(posted));
  assert.equal(posted.location, posted.self);
  assert(posted.retry && posted.id && posted.etag, JSON.stringify(posted));
  const names = await page.evaluate(events(`${url}${posted.location}/events`));
  assert.deepEqual([names[0], names.at(-1)], ["queued", "succeeded"]);
  console.log(`  ${listed.origin}: posted, ${names.length} events`);

  await page.goto(other.origin);
  const blocked = await page.evaluate(post, { url, document });
  assert.match(blocked.error ?? "", /Failed to fetch/, JSON.stringify(blocked));
  await assert.rejects(page.evaluate(events(`${url}${posted.location}/events`)), /refused/);
  console.log(`  ${other.origin}: blocked`);

  await page.goto(`${url}/docs/`);
  const operation = page.locator("#operations-jobs-create_job");
  await operation.locator(".opblock-summary-control").click();
  await operation.locator(".try-out__btn").click();
  await operation.locator(".execute").click();
  const status = await operation.locator(".live-responses-table .response-col_status").last().innerText();
  assert.match(status, /^20[02]/, await operation.locator(".live-responses-table").innerText());
  console.log("  /docs/: Execute is accepted");
} finally {
  await browser.close();
  skyduct.close();
  listed.close();
  other.close();
}
