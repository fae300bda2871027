// Opens a report in Chromium and prints what is there, as JSON.
// Usage: node look.mjs FOLDER_OF_NODE_MODULES CHROMIUM REPORT [FOLDER_FOR_SCREENSHOTS]
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { statSync } from "node:fs";

const [modules, chromium, report, pictures] = process.argv.slice(2);
const load = createRequire(join(resolve(modules), "_"));
const puppeteer = load("puppeteer-core");
const found = { bytes: statSync(report).size, console: [], requests: [], plots: {}, axe: [] };
const browser = await puppeteer.launch({
  executablePath: chromium,
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  protocolTimeout: 240000,
});
const page = await browser.newPage();
page.setDefaultTimeout(180000);
page.on("console", (message) => found.console.push(`${message.type()}: ${message.text()}`));
// An error of the page ends the look: what waits for its effect would wait in vain.
page.on("pageerror", (error) => { console.error(`error of the page: ${error.message}`); process.exit(1); });
const address = pathToFileURL(resolve(report)).href;
page.on("request", (request) => {
  const url = request.url();
  if (url !== address && !url.startsWith("data:") && !url.startsWith("blob:")) found.requests.push(url);
});
const ready = () => page.waitForFunction(() => document.documentElement.dataset.ready === "true");
const drawn = () => page.waitForFunction(() => document.documentElement.dataset.complete === "true");
await page.setViewport({ width: 1440, height: 900 });
// Time of the processor, which other programs at work do not change, beside that of the clock.
const timing = await browser.target().createCDPSession();
const processor = async () => {
  const { processInfo } = await timing.send("SystemInfo.getProcessInfo");
  return Math.round(1e3 * Math.max(...processInfo.filter(({ type }) => type === "renderer").map(({ cpuTime }) => cpuTime)));
};
await page.goto(address, { waitUntil: "load" });
await ready();
found.usable_ms = Math.round(await page.evaluate(() => performance.now()));
found.usable_cpu_ms = await processor();
await drawn();
found.complete_ms = Math.round(await page.evaluate(() => performance.now()));
found.complete_cpu_ms = await processor();

// What is drawn, from the charts themselves: sums of all values, and how many there are.
const plots = () => page.evaluate(() => {
  const sum = (list) => list.flat(2).filter(Number.isFinite).reduce((total, one) => total + one, 0);
  const count = (list) => list.flat(2).filter(Number.isFinite).length;
  const of = (trace) => {
    const values = trace.surfacecolor ?? trace.z ?? trace.r ?? trace.y;
    return { name: trace.name ?? "", type: trace.type, meta: trace.meta ?? null, count: count([...values].map((one) => (one.length === undefined ? one : [...one]))), sum: sum([...values].map((one) => (one.length === undefined ? one : [...one]))) };
  };
  return Object.fromEntries([...document.querySelectorAll(".plot")].filter((plot) => plot.data).map((plot) => [plot.id, plot.data.map(of)]));
});
found.plots = await plots();

// The controls: another panel, a filter, the slider, a ring.
found.controls = await page.evaluate(async () => {
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const of = (plot) => JSON.stringify(plot.data.map((trace) => [trace.x, trace.z, trace.r, trace.y].map((list) => (list ? [...list].slice(0, 3).map((one) => (one?.slice ? one.slice(0, 3) : one)) : null))));
  // Until the plot is another one, and what else is drawn with it is drawn; what does not change is waited for.
  const changes = async (plot, act) => {
    const before = of(plot);
    act();
    for (let waited = 0; waited < 300 && of(plot) === before; waited += 20) await wait(20);
    await wait(40);
    return of(plot) !== before;
  };
  const result = {};
  for (const box of document.querySelectorAll("[data-figure]")) {
    const plot = box.querySelector(".plot[id^=plot-]");
    if (!plot) continue;
    const said = (result[plot.id] = {});
    const next = [...box.querySelectorAll("button")].find((button) => button.textContent === "›");
    if (next) said.panel = await changes(plot, () => next.click());
    const filter = [...box.querySelectorAll("label")].find((label) => label.textContent.startsWith("Filter"))?.querySelector("select");
    if (filter) said.filter = await changes(plot, () => { filter.value = "15"; filter.dispatchEvent(new Event("change")); });
    if (filter) await changes(plot, () => { filter.value = "0"; filter.dispatchEvent(new Event("change")); });
    const choose = async (text, value) => {
      const select = [...box.querySelectorAll("label")].find((label) => label.textContent.startsWith(text))?.querySelector("select");
      if (!select) return undefined;
      return changes(plot, () => { select.value = value; select.dispatchEvent(new Event("change")); });
    };
    const sheet = () => [...box.querySelectorAll(".sheet tr")].map((row) => [...row.children].map((cell) => cell.textContent));
    said.sheet = sheet();
    said.circle = await choose("Circle", "MZCI");
    said.about = box.querySelector(".sheet caption")?.textContent;
    said.zone = sheet();
    said.plane = await choose("Plane", "2");
  }
  const slider = document.querySelector("#surface input[type=range]");
  if (slider) {
    result.slider = await changes(document.getElementById("solid-surface"), () => { slider.value = 80; slider.dispatchEvent(new Event("input")); });
    await changes(document.getElementById("solid-surface"), () => { slider.value = 50; slider.dispatchEvent(new Event("input")); });
  }
  return result;
});
const map = await page.$("#map-surface .nsewdrag");
if (map) {
  await map.scrollIntoView();
  const box = await map.boundingBox();
  await page.mouse.move(box.x + box.width / 3, box.y + box.height / 2);
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2, { steps: 4 });
  await page.waitForFunction(() => /: .* -?[0-9]/.test(document.querySelector("#map-surface ~ .readout").textContent.replace("−", "-")));
  found.pointed = await page.$eval("#map-surface ~ .readout", (one) => one.textContent);
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await page.waitForFunction(() => document.getElementById("ring-surface").data);
  found.ring = (await plots())["ring-surface"];
}

const axe = load.resolve("axe-core/axe.min.js");
const audit = await page.browserContext().newPage?.() ?? null;
if (audit) await audit.close();
// The page's policy allows no other script: the audit runs in a world of its own.
const client = await page.createCDPSession();
const { readFileSync } = await import("node:fs");
const { frameTree } = await client.send("Page.getFrameTree");
const { executionContextId } = await client.send("Page.createIsolatedWorld", { frameId: frameTree.frame.id, worldName: "audit" });
const source = (rules) => `${readFileSync(axe, "utf8")}; axe.run(document, { resultTypes: ["violations"], ...${JSON.stringify(rules)} }).then((result) => JSON.stringify(result.violations.map((one) => ({ id: one.id, impact: one.impact, help: one.help, nodes: one.nodes.slice(0, 3).map((node) => node.html.slice(0, 160)) }))))`;
// By day, by night, which has other colours and nothing else, and on a phone.
const colours = { runOnly: { type: "rule", values: ["color-contrast", "link-in-text-block"] } };
for (const [scheme, width, rules] of [["light", 1440, {}], ["dark", 1440, colours], ["light", 390, {}]]) {
  await page.setViewport({ width, height: 900 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
  await new Promise((done) => setTimeout(done, 500));
  const audited = await client.send("Runtime.evaluate", { expression: source(rules), contextId: executionContextId, awaitPromise: true, returnByValue: true });
  const of = audited.exceptionDetails ? [{ id: "axe", impact: "serious", help: JSON.stringify(audited.exceptionDetails).slice(0, 400), nodes: [] }] : JSON.parse(audited.result.value);
  found.axe.push(...of.map((one) => ({ ...one, where: `${scheme}, ${width} px` })));
  const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  if (overflow > 0) found.axe.push({ id: "overflow", impact: "serious", help: `the page is ${overflow} px wider than the window`, nodes: [], where: `${scheme}, ${width} px` });
}
await page.setViewport({ width: 1440, height: 900 });
await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "light" }]);

if (pictures) {
  const shot = async (name, width, height, scheme) => {
    await page.setViewport({ width, height });
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
    await page.evaluate(() => scrollTo(0, 0));
    await new Promise((done) => setTimeout(done, 2500));
    await page.screenshot({ path: join(pictures, `${name}.png`), fullPage: true });
  };
  await shot("wide", 1440, 900, "light");
  await shot("dark", 1440, 900, "dark");
  await shot("phone", 390, 844, "light");
  await page.setViewport({ width: 1440, height: 900 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "light" }]);
  await page.pdf({ path: join(pictures, "print.pdf"), format: "A4", preferCSSPageSize: true, timeout: 180000 });
}
await browser.close();
console.log(JSON.stringify(found));
