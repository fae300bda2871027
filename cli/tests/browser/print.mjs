// Prints a report on A4 and says, as JSON, how many pages it has, and how high each station's sheet is.
// Usage: node print.mjs FOLDER_OF_NODE_MODULES CHROMIUM REPORT
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [modules, chromium, report] = process.argv.slice(2);
const puppeteer = createRequire(join(resolve(modules), "_"))("puppeteer-core");
const browser = await puppeteer.launch({
  executablePath: chromium,
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  protocolTimeout: 240000,
});
const page = await browser.newPage();
page.on("pageerror", (error) => { console.error(`error of the page: ${error.message}`); process.exit(1); });
await page.goto(pathToFileURL(resolve(report)).href, { waitUntil: "load" });
await page.waitForFunction(() => document.documentElement.dataset.complete === "true", { timeout: 180000 });
const pdf = Buffer.from(await page.pdf({ preferCSSPageSize: true, timeout: 180000 })).toString("latin1");
// After print everything is as it was.
const left = await page.evaluate(() => document.querySelectorAll(".sheet-of-station, .names").length);
// As wide as A4 between its margins.
await page.setViewport({ width: 688, height: 1000 });
await page.emulateMediaType("print");
const sheets = await page.evaluate(() => {
  dispatchEvent(new Event("beforeprint"));
  const of = (sheet) => ({ name: sheet.querySelector("h2").textContent, height: sheet.scrollHeight, width: sheet.scrollWidth, charts: sheet.querySelectorAll(".plot svg").length, rows: sheet.querySelectorAll(".columns tbody tr").length });
  const found = [...document.querySelectorAll(".sheet-of-station")].map(of);
  const controls = [...document.querySelectorAll(".controls")].filter((one) => one.offsetParent).length;
  return { found, controls, wide: document.documentElement.scrollWidth };
});
await browser.close();
console.log(JSON.stringify({ pages: pdf.match(/\/Type\s*\/Page\b(?!s)/g).length, left, ...sheets }));
