// Looks at every page below a folder and prints size and times as a table; fails on a console message, a request, or a serious
// finding of axe.
// Usage: node table.mjs FOLDER_OF_NODE_MODULES CHROMIUM FOLDER
import { spawnSync } from "node:child_process";
import { readdirSync } from "node:fs";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";

const [modules, chromium, folder] = process.argv.slice(2);
const script = join(dirname(fileURLToPath(import.meta.url)), "look.mjs");
const pages = readdirSync(folder, { recursive: true }).filter((name) => name.endsWith(".html")).sort();
const faults = [];
console.log("| report | size / MB | usable after / s | of the processor / s | complete after / s | of the processor / s |\n| --- | --- | --- | --- | --- | --- |");
for (const name of pages) {
  const { status, stdout, stderr } = spawnSync("node", [script, modules, chromium, join(folder, name)], { encoding: "utf8", maxBuffer: 1 << 28 });
  if (status !== 0) {
    faults.push(`${name}: ${stderr.trim()}`);
    continue;
  }
  const found = JSON.parse(stdout);
  const seconds = ["usable_ms", "usable_cpu_ms", "complete_ms", "complete_cpu_ms"].map((key) => (found[key] / 1e3).toFixed(2));
  console.log(`| ${relative(folder, join(folder, name))} | ${(found.bytes / 1e6).toFixed(1)} | ${seconds.join(" | ")} |`);
  for (const said of [...found.console, ...found.requests]) faults.push(`${name}: ${said}`);
  for (const { id, impact, help } of found.axe) if (impact === "serious" || impact === "critical") faults.push(`${name}: ${id}: ${help}`);
}
for (const fault of faults) console.error(fault);
process.exit(faults.length ? 1 : 0);
