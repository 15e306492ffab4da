// A browser that keeps what a page says and asks for, and what visitors do often.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { chromium } from "playwright-core";

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Starts the browser. */
export const browser = () =>
  chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: [
      "--no-sandbox",
      // a name beyond loopback, over plain HTTP
      "--host-resolver-rules=MAP page.test 127.0.0.1",
      "--disable-gpu",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
    ],
  });

/** The middle of what a locator finds. */
export async function middle(locator) {
  await locator.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await locator.boundingBox();
  return [x + width / 2, y + height / 2];
}

/** Until what comes soon is there. */
export async function until(there, otherwise) {
  for (let look = 0; look < 50; look++) {
    if (await there()) return;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  assert.fail(otherwise);
}

export class Visitor {
  /** Requests to other hosts, and what the console has of errors. @type {string[]} */
  faults = [];

  static async of(browser, url, options = {}) {
    const visitor = new Visitor();
    visitor.url = url;
    visitor.context = await browser.newContext({
      viewport: { width: 1280, height: 900 },
      colorScheme: "light",
      acceptDownloads: true,
      ...options,
    });
    visitor.page = await visitor.context.newPage();
    visitor.page.setDefaultTimeout(15_000);
    visitor.page.on("console", (message) => {
      if (message.type() === "error") visitor.faults.push(`${message.text()} ${message.location().url}`);
    });
    visitor.page.on("pageerror", (error) => visitor.faults.push(String(error.stack)));
    visitor.page.on("request", (request) => {
      const of = request.url();
      if (!of.startsWith(url) && !of.startsWith("data:") && !of.startsWith("blob:")) visitor.faults.push(`asks for ${of}`);
    });
    return visitor;
  }

  async open(path) {
    await this.page.goto(this.url + path);
    await this.arrived();
  }

  /** Waits and looks read the page's state, which its modules share. */
  arrived() {
    return this.page.evaluate(async () => (globalThis.seen = (await import("/web/state.js")).state));
  }

  /** The number that the page shows as the mean. */
  async mean() {
    return Number((await this.page.locator("#mean").innerText()).replace(/[^\d.]/g, ""));
  }

  /** Until the result is the draft's, and nothing is computed any more. */
  async rests() {
    await this.page.waitForFunction(
      () => seen.current && !seen.running && (seen.answer?.job.accuracy?.relative_error ?? 1) <= seen.target,
    );
  }

  /** Until the result is the draft's. */
  current() {
    return this.page.waitForFunction(() => seen.current, null, { polling: "raf" });
  }

  /** What the page holds: draft, job and grid. */
  state() {
    return this.page.evaluate(() => {
      const { draft, answer, problem } = seen;
      return { draft, job: answer?.job, grid: answer?.grid, problem };
    });
  }

  /** The service's answer. */
  async get(path) {
    const response = await fetch(this.url + path);
    return { status: response.status, body: await response.json().catch(() => null) };
  }

  /** No rule of axe is broken. */
  async isAccessible(what) {
    // an answer of its own world: the page's policy lets no script be added
    const { violations } = await this.page.evaluate(`(globalThis.axe ?? (() => { ${axe} })(), axe.run())`);
    const found = violations.map(
      ({ id, help, nodes }) =>
        `${id}: ${help}: ${nodes.map(({ html, failureSummary }) => `${html}\n    ${failureSummary}`).join("\n  ")}`,
    );
    assert.deepEqual(found, [], `${what}: ${found.join("\n")}`);
  }

  /** Keeps what is to be looked at, and finds nothing that is wider than the window. */
  async looksAsIn(file) {
    const wide = await this.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert(wide <= 0, `${file}: ${wide} px wider than the window`);
    await this.page.screenshot({ path: file, fullPage: true });
  }

  async close() {
    await this.context.close();
    assert.deepEqual(this.faults, []);
  }
}
