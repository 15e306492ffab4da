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

/** Milliseconds until what comes soon is taken to come never: beside other tests of a slow machine that may be many seconds. */
const PATIENCE = 120_000;

/** Until what comes soon is there. */
export async function until(there, otherwise) {
  for (const end = performance.now() + PATIENCE; performance.now() < end; ) {
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
    visitor.page.setDefaultTimeout(PATIENCE);
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

  /** Until the page's state is as it should be, and is drawn. */
  async holds(is, of = null) {
    await this.page.waitForFunction(is, of);
    await this.drawn();
  }

  /** Until what has been set is drawn, which is before the next frame. */
  drawn() {
    return this.page.evaluate(() => new Promise((drawn) => requestAnimationFrame(drawn)));
  }

  /** Until the result is the draft's, and nothing is computed any more. */
  rests() {
    return this.holds(() => seen.current && !seen.running && (seen.answer?.job.accuracy?.relative_error ?? 1) <= seen.target);
  }

  /** Opens a part of the page that is folded. */
  async opens(title) {
    const folded = this.page.locator("details:not([open]) > summary", { hasText: title });
    if (await folded.count()) await folded.first().click();
  }

  /** Until the result is the draft's. */
  current() {
    return this.holds(() => seen.current);
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

  /** Panels, and the columns of a wide page, that are empty by more than a tenth of what is seen of them. */
  emptiness() {
    return this.page.evaluate(() => {
      const wide = innerWidth >= 1200;
      const seenOf = (element) => {
        const { left, right, top, bottom } = element.getBoundingClientRect();
        return wide ? { left, right, top, bottom: Math.min(bottom, innerHeight) } : { left, right, top, bottom };
      };
      // share of a length that intervals cover; what is near belongs together
      const covered = (from, to, intervals, near) => {
        let [sum, end] = [0, from];
        for (const [a, b] of intervals.sort((one, other) => one[0] - other[0])) {
          if (a - end <= near) sum += Math.max(0, Math.min(b, to) - end);
          else sum += Math.max(0, Math.min(b, to) - a);
          end = Math.max(end, Math.min(b, to));
        }
        return (sum + (to - end <= near ? to - end : 0)) / (to - from);
      };
      const hasText = (element) => [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
      const leaves = (panel) =>
        [...panel.querySelectorAll("*")].filter((one) => (!one.children.length || hasText(one) || one.matches("select, summary")) && !one.matches(".hold, .unseen, svg") && one.checkVisibility());
      const found = [];
      for (const panel of document.querySelectorAll(".panel")) {
        const of = seenOf(panel);
        if (of.bottom - of.top < 60) continue;
        const rects = leaves(panel).map((one) => one.getBoundingClientRect());
        const down = covered(of.top, of.bottom, rects.map(({ top, bottom }) => [top, bottom]), 36);
        const across = covered(of.left, of.right, rects.map(({ left, right }) => [left, right]), 36);
        const label = panel.getAttribute("aria-label") ?? panel.className;
        if (Math.min(down, across) < 0.9) found.push(`${label}: ${down.toFixed(2)} of its height, ${across.toFixed(2)} of its width`);
      }
      for (const column of wide ? document.querySelectorAll(".column") : []) {
        const { top, bottom } = seenOf(column);
        const end = Math.max(...[...column.querySelectorAll(".panel")].map((panel) => panel.getBoundingClientRect().bottom));
        if (end - top < 0.9 * (bottom - top)) found.push(`${column.className} ends at ${end} of ${bottom}`);
      }
      // panels of a job's page that begin at one place are a column
      for (const host of document.querySelectorAll(".columns.beside")) {
        const ends = new Map();
        for (const panel of host.querySelectorAll(":scope > .panel")) {
          const { left, bottom } = panel.getBoundingClientRect();
          ends.set(left, Math.max(ends.get(left) ?? 0, bottom));
        }
        const { top, bottom } = host.getBoundingClientRect();
        for (const end of ends.values()) if (end - top < 0.9 * (bottom - top)) found.push(`a column ends at ${end} of ${bottom}`);
      }
      return found;
    });
  }

  /** Waits until the panels of a job's page are as wide as the page. */
  async fitsColumns() {
    await this.holds(() => {
      const panels = [...document.querySelectorAll(".columns > .panel")].map((panel) => panel.getBoundingClientRect());
      return Math.abs(Math.max(...panels.map(({ right }) => right)) - document.querySelector(".columns").getBoundingClientRect().right) < 4;
    });
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
