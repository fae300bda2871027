// The page: where charts are drawn, what their controls do, and the table of values.
"use strict";

(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const CONFIG = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  const redraws = [];

  function element(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) key in made ? (made[key] = value) : made.setAttribute(key, value);
    made.append(...children);
    return made;
  }

  function labelled(text, control) {
    return element("label", {}, text, control);
  }

  let printing = false;

  // Draws into a place of the chart's own height, and as wide as there is room.
  function put(place, { traces, layout }) {
    const { height, ...shape } = printing ? Paper.layout(place, traces, layout) : { ...layout, autosize: true };
    place.style.height = `${height}px`;
    place.parentNode.querySelector(":scope > .names")?.remove();
    if (printing) {
      const names = Paper.legend(traces, layout).map(([name, colour, mark]) => element("span", {}, element("span", { textContent: `${mark} `, style: `color: ${colour}` }), name));
      if (names.length) place.after(element("p", { className: "names" }, ...names.flatMap((name) => [name, " "])));
    }
    return Plotly.react(place, printing ? Paper.traces(traces) : traces, { ...shape, ...(printing ? { height } : {}) }, CONFIG);
  }

  // Charts are drawn one after the other, those in view first, so that the page can be used before the last one is there.
  const waiting = [];
  const inView = (place) => {
    const { top, bottom } = place.getBoundingClientRect();
    return bottom > 0 && top < innerHeight;
  };
  async function drawAll() {
    while (waiting.length) {
      await new Promise((go) => (window.requestIdleCallback ?? setTimeout)(go, { timeout: 100 }));
      const next = Math.max(0, waiting.findIndex(({ place }) => inView(place)));
      await waiting.splice(next, 1)[0].draw();
    }
    document.documentElement.dataset.complete = "true";
  }

  // Figures with panels of the same names show the same one.
  const followers = new Map();

  function chooser(figure, show) {
    const names = figure.panels.map((panel) => panel.name);
    const key = JSON.stringify(names);
    const select = element("select", {}, ...names.map((name, index) => element("option", { value: index, textContent: name, dir: "auto" })));
    const follow = (index) => { select.value = index; show(index); };
    followers.set(key, [...(followers.get(key) ?? []), follow]);
    const choose = (index) => followers.get(key).forEach((one) => one(Math.min(names.length - 1, Math.max(0, index))));
    select.addEventListener("change", () => choose(Number(select.value)));
    const step = (by, text, name) => element("button", { type: "button", textContent: text, ariaLabel: name, onclick: () => choose(Number(select.value) + by) });
    return [step(-1, "‹", "previous"), labelled("of", select), step(1, "›", "next"), element("span", { textContent: `${names.length} in all` })];
  }

  // Selects of what can be chosen of a figure's panel; one choice may change what others there are.
  function offer(figure, state, holder, draw) {
    const selects = Draw.choices[figure.kind](figure, figure.panels[state.panel], state).map(({ key, text, options, usual }) => {
      const select = element("select", {}, ...options.map(([value, textContent]) => element("option", { value, textContent })));
      select.value = state[key] ?? usual ?? options[0][0];
      select.addEventListener("change", () => {
        state[key] = Number.isFinite(Number(select.value)) && select.value !== "" ? Number(select.value) : select.value;
        if (key === "plane") delete state.layer;
        draw();
        offer(figure, state, holder, draw);
        holder.querySelectorAll("select")[selects.findIndex((label) => label.contains(select))]?.focus();
      });
      return labelled(text, select);
    });
    holder.replaceChildren(...selects);
  }

  // A small table with a caption.
  function written({ caption, head, rows }) {
    const cells = (kind, row) => row.map((text, column) => element(kind, { textContent: text, className: column ? "number" : "", ...(kind === "th" ? { scope: "col" } : {}) }));
    const body = element("tbody", {}, ...rows.map((row) => element("tr", {}, ...cells("td", row))));
    const table = element("table", {}, element("caption", { textContent: caption }), element("thead", {}, element("tr", {}, ...cells("th", head))), body);
    return element("div", { className: "scroll", tabIndex: 0, role: "region", ariaLabel: caption }, table);
  }

  function chart(figure, box) {
    const controls = element("p", { className: "controls" });
    const readout = element("p", { className: "readout" });
    const sheet = element("div", { className: "sheet" });
    const state = { panel: 0 };
    if (figure.kind === "map") {
      box.append(controls);
      const holder = element("div", { className: "map" });
      box.append(holder);
      const show = (index) => { holder.replaceChildren(); surface(figure.panels[index].map, holder, figure.id); };
      if (figure.panels.length > 1) controls.append(...chooser(figure, show));
      show(0);
      return;
    }
    const plot = element("div", { className: "plot", id: `plot-${figure.id}` });
    const draw = () => {
      const drawn = Draw[figure.kind](figure, figure.panels[state.panel], state);
      sheet.replaceChildren(...(drawn.table ? [written(drawn.table)] : []));
      return put(plot, drawn).then(() => {
        readout.textContent = [drawn.said, drawn.magnification?.(plot)].filter(Boolean).join("; ");
      });
    };
    if (figure.panels.length > 1) controls.append(...chooser(figure, (index) => { state.panel = index; draw(); }));
    if (Draw.choices[figure.kind]) {
      const chosen = element("span", { className: "controls" });
      controls.append(chosen);
      offer(figure, state, chosen, draw);
    }
    if (controls.childNodes.length) box.append(controls);
    box.append(plot, readout, sheet);
    waiting.push({ place: plot, draw });
    redraws.push(draw);
  }

  // A map beside its body in space; a click on either opens the ring below.
  function surface(of, box, id) {
    const grid = Draw.grid(of);
    const flat = element("div", { className: "plot", id: `map-${id}` });
    const readout = element("p", { className: "readout hint", textContent: `Point at the map for a value; click for the ${of.radius_mm ? "ring" : "profile along " + of.x.name}.` });
    const space = element("div", { className: "plot", id: `solid-${id}` });
    const slider = element("input", { type: "range", min: 0, max: 100, value: 50, ariaLabel: "exaggeration of the deviation" });
    const times = element("output", {});
    const ring = element("div", { className: "plot", id: `ring-${id}` });
    const title = element("h3", { textContent: "" });
    const opened = element("div", { hidden: true }, title, ring);
    const chosen = { row: null };
    box.append(
      element("div", {}, flat, readout, opened),
      element("div", {}, element("p", { className: "controls" }, labelled("Exaggeration", slider), times), space),
    );
    const heights = grid.rows.flat().filter(Number.isFinite);
    const span = heights.reduce((most, one) => Math.max(most, Math.abs(one)), 0) || 1;
    // At the slider's middle, the largest deviation is a sixth of the radius.
    const middle = of.radius_mm ? (1e3 * of.radius_mm) / (6 * span) : 1;
    const magnified = () => Number((middle * 10 ** ((Number(slider.value) - 50) / 50)).toPrecision(2));
    const value = (row, column) => {
      const place = `${of.x.name} ${Number(grid.x[column].toPrecision(6))} ${of.x.unit}, ${of.y.name} ${Number(grid.y[row].toPrecision(6))} ${of.y.unit}`;
      readout.textContent = `${place}: ${of.height.name} ${Draw.shown(grid.rows[row][column])} ${of.height.unit}`;
    };
    const open = (row) => {
      chosen.row = row;
      opened.hidden = false;
      const drawn = Draw.ring(of, grid, row);
      title.textContent = drawn.title;
      put(ring, drawn);
    };
    const solid = () => {
      const drawn = Draw.solid(of, grid, magnified());
      times.textContent = [`${magnified().toLocaleString("en")} times`, drawn.said].filter(Boolean).join("; ");
      return put(space, { ...drawn, layout: { ...drawn.layout, uirevision: "turned" } }).then(() => drawn);
    };
    const map = () => put(flat, Draw.map(of, grid));
    const beginFlat = () => map().then(() => {
      flat.on("plotly_hover", ({ points: [{ pointIndex: [row, column] }] }) => value(row, column));
      flat.on("plotly_click", ({ points: [{ pointIndex: [row] }] }) => open(row));
    });
    const beginSolid = () => solid().then(({ rings, angles }) => {
      const of = ({ points: [{ pointNumber: [column, row] }] }) => [rings[row], angles[column % angles.length]];
      space.on("plotly_hover", (event) => value(...of(event)));
      space.on("plotly_click", (event) => open(of(event)[0]));
      slider.addEventListener("input", solid);
      // It is drawn too late for print, which takes it as it is, and smaller.
      redraws.push(() => {
        space.style.zoom = printing ? Paper.widthOf(space) / space.offsetWidth : "";
        return printing || solid();
      });
    });
    // Later than at first, when another panel was chosen.
    if (document.documentElement.dataset.complete) beginFlat().then(beginSolid);
    else waiting.push({ place: flat, draw: beginFlat }, { place: space, draw: beginSolid });
    redraws.push(map, () => chosen.row !== null && open(chosen.row));
  }

  const columns = Object.fromEntries(Object.entries(data.values).map(([key, column]) => [key, column.texts ? column.rows.map((row) => column.texts[row]) : column]));
  const values = columns.shown.map((_, row) => Object.fromEntries(Object.entries(columns).map(([key, column]) => [key, column[row]])));

  function table() {
    const body = document.querySelector("#rows tbody");
    if (!body) return () => {};
    let most = 50;
    const [filter, count, all] = ["filter", "shown", "all"].map((id) => document.getElementById(id));
    const keys = ["place", "symbol", "low", "shown", "high", "unit", "interval", "kind", "refers", "note"];
    const numeric = new Set(["low", "shown", "high", "interval"]);
    // What a value is by its standard is a footnote of the rows that are shown: its number is in the row, its text below.
    function footnoted(rows) {
      const texts = [...new Set(rows.map((row) => row.about))];
      const many = printing && texts.length > Paper.MOST_NOTES;
      rows.forEach((row) => { row.note = [row.remark.replace(/; $/, ""), many ? "" : `${texts.indexOf(row.about) + 1})`].filter(Boolean).join(" "); });
      document.getElementById("footnotes").replaceChildren(...(many ? [] : texts).map((text) => element("li", { textContent: text })));
      const standards = [...new Set(texts.map((text) => /^ISO[ /A-Z]* [0-9-]+:[0-9]+/.exec(text)?.[0]).filter(Boolean))];
      document.getElementById("standards").textContent = many ? `By ${standards.join(", ")}; the page has the definition of each value.` : "";
      return rows;
    }
    // Values of one quantity at several stations are one row, which opens.
    const groups = new Map();
    values.forEach((row) => {
      const key = row.group ? JSON.stringify([row.group, row.symbol, row.refers, row.unit]) : row;
      groups.set(key, [...(groups.get(key) ?? []), row]);
    });
    const open = new Set();
    let [rows, sorted, down] = [values, null, false];
    const matches = (words) => (row) => { const text = [...keys.map((key) => row[key] ?? ""), row.remark, row.about].join(" ").toLowerCase(); return words.every((word) => text.includes(word)); };
    // Lowest, median and highest, each as it is shown with its own uncertainty.
    function gathered(key, group) {
      const known = group.filter((row) => row.value !== null).sort((a, b) => a.value - b.value);
      if (group.length < 2 || !known.length) return group;
      const [first] = group;
      const [low, middle, high] = [0, (known.length - 1) >> 1, known.length - 1].map((place) => known[place]);
      const remark = group.some((row) => row.remark.includes("! ")) ? "! refuted at some" : "";
      const places = new Set(group.map((row) => row.place)).size;
      const many = places < group.length ? `, ${group.length} values` : "";
      const several = ["stations", "sections"].includes(first.group) ? `${places} ${first.group}${many}` : `${first.group}, ${places} stations${many}`;
      const head = { ...first, key, place: several, low: low.shown, shown: middle.shown, high: high.shown, interval: "", kind: "", remark, value: middle.value };
      return open.has(key) ? [head, ...group] : [head];
    }
    const show = (kept = () => true) => {
      const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
      rows = values.filter(matches(words)).filter(kept);
      const listed = words.length || sorted ? [...rows] : [...groups].filter(([, group]) => kept(group[0])).flatMap(([key, group]) => gathered(key, group));
      if (sorted) {
        const [key, sign] = [sorted, down ? -1 : 1];
        listed.sort((a, b) => sign * (key === "value" ? (a.value ?? Infinity) - (b.value ?? Infinity) : String(a[key] ?? "").localeCompare(String(b[key] ?? ""), "en", { numeric: true })));
      }
      const cell = (row, key) => {
        const names = [numeric.has(key) ? "number" : "", key === "low" || key === "high" ? "several" : "", key === "note" && row.remark ? "remark" : ""];
        const made = element("td", { className: names.join(" ").trim() });
        if (key === "place" && row.key) {
          const toggle = () => { open.has(row.key) ? open.delete(row.key) : open.add(row.key); show(); };
          made.append(element("button", { type: "button", className: "opens", textContent: row.place, ariaExpanded: String(open.has(row.key)), onclick: toggle }));
        } else made.append(key === "place" ? element("bdi", { textContent: row[key] }) : row[key] ?? "");
        return made;
      };
      body.replaceChildren(...footnoted(listed.slice(0, most)).map((row) => element("tr", {}, ...keys.map((key) => cell(row, key)))));
      document.getElementById("rows").classList.toggle("single", listed.every((row) => row.low === undefined));
      all.hidden = listed.length <= most;
      document.getElementById("left").textContent = listed.length > most ? `${listed.length - most} of ${listed.length} rows are left out on paper: the page and the result's table "values" have them.` : "";
      count.textContent = listed.length > most ? `the first ${most} of ${listed.length} rows` : `${rows.length} values`;
    };
    filter.addEventListener("input", () => show());
    all.addEventListener("click", () => { most = Infinity; show(); });
    document.querySelectorAll("#rows th button").forEach((button) => button.addEventListener("click", () => {
      down = sorted === button.dataset.key && !down;
      sorted = button.dataset.key;
      document.querySelectorAll("#rows th").forEach((head) => head.removeAttribute("aria-sort"));
      button.parentElement.setAttribute("aria-sort", down ? "descending" : "ascending");
      show();
    }));
    document.getElementById("copy").addEventListener("click", async () => {
      const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
      const copied = ["place", "symbol", "value", "std", "unit", "refers", "about"];
      const csv = [copied, ...rows.map((row) => copied.map((key) => row[key] ?? ""))].map((row) => row.map((one) => quoted(String(one))).join(",")).join("\n");
      const area = element("textarea", { value: csv });
      document.body.append(area);
      area.select();
      // A page opened as a file may have no other clipboard.
      await navigator.clipboard?.writeText(csv).catch(() => document.execCommand("copy"));
      area.remove();
      count.textContent = `${rows.length} values copied`;
    });
    show();
    // On paper a page of rows; those of stations with a sheet each are there.
    return () => {
      const kept = most;
      const inSheets = new Set(printing ? Paper.stations(data.figures) : []);
      if (printing) most = Paper.MOST_ROWS;
      show((row) => !inSheets.has(row.station));
      most = kept;
    };
  }

  // A station's values: those of its sections in a table with a column for each section, and those of the station.
  function stationValues(station) {
    const own = values.filter((row) => row.station === station);
    const parts = [own.filter(({ section }) => section), own.filter(({ section }) => !section)].filter((rows) => rows.length);
    return element("div", { className: "columns" }, ...parts.map(valuesBySection));
  }

  // A row for each symbol and reference, below a line that says the filter.
  function valuesBySection(own) {
    const sections = [...new Set(own.map(({ section }) => section))];
    const groups = new Map();
    own.forEach((row) => {
      const [reference, filter] = [row.refers.split(", ").slice(0, -1).join(", "), row.refers.split(", ").pop()];
      const group = groups.get(filter) ?? groups.set(filter, new Map()).get(filter);
      const key = JSON.stringify([row.symbol, reference, row.unit]);
      const cells = group.get(key) ?? group.set(key, { name: [row.symbol, reference].filter(Boolean).join(" "), unit: row.unit, of: sections.map(() => []) }).get(key);
      cells.of[sections.indexOf(row.section)].push(row);
    });
    const cell = (list) => (list.length > 1 ? `${list.length} values` : list[0]?.shown ?? "");
    const cells = (kind, row) => row.map((text, column) => element(kind, { textContent: text, className: column > 1 ? "number" : "" }));
    const head = element("thead", {}, element("tr", {}, ...cells("th", ["value", "unit", ...sections.map((name) => name || "value ± std")])));
    const body = [...groups].flatMap(([filter, group]) => [
      ...(groups.size > 1 ? [element("tr", {}, element("th", { textContent: `filter: ${filter || "none"}`, colSpan: 2 + sections.length }))] : []),
      ...[...group.values()].map(({ name, unit, of }) => element("tr", {}, ...cells("td", [name, unit, ...of.map(cell)]))),
    ]);
    return element("table", {}, head, element("tbody", {}, ...body));
  }

  // Sheets of the stations, made when the page is printed and taken away after it.
  function sheets() {
    const names = Paper.stations(data.figures);
    const figures = Paper.ofStations(data.figures, names);
    const next = document.getElementById("figures");
    return names.map((name, index) => {
      const charts = element("div", { className: "charts" });
      const section = element("section", { className: "sheet-of-station" }, element("h2", { textContent: name, dir: "auto" }), charts, stationValues(name));
      next.before(section);
      figures.forEach((figure, place) => {
        const plot = element("div", { className: "plot" });
        const readout = element("p", { className: "readout" });
        charts.append(element("figure", { className: place ? "" : "large" }, element("figcaption", {}, element("h3", { textContent: figure.title })), plot, readout));
        const drawn = Draw[figure.kind](figure, figure.panels[index], {});
        put(plot, drawn);
        readout.textContent = [drawn.said, drawn.magnification?.(plot)].filter(Boolean).join("; ");
        if (drawn.table) charts.lastChild.append(element("div", { className: "sheet" }, written(drawn.table)));
      });
      return section;
    });
  }

  const redraw = () => redraws.forEach((one) => one());
  document.querySelectorAll("[data-figure]").forEach((box) => chart(data.figures[Number(box.dataset.figure)], box.querySelector(".drawn")));
  if (data.surface) surface(data.surface, document.querySelector('[data-map="surface"]'), "surface");
  const tabulate = table();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  // Print has its own colours and sizes, and a sheet for each of a few stations in place of the figures that one chooses from.
  const ofSheets = new Set(Paper.ofStations(data.figures, Paper.stations(data.figures)));
  const charts = [...document.querySelectorAll("#figures [data-figure]")];
  charts.forEach((box) => box.classList.toggle("by-station", ofSheets.has(data.figures[Number(box.dataset.figure)])));
  charts[0]?.parentNode.classList.toggle("few", charts.filter((box) => !box.classList.contains("by-station")).length <= Paper.FEW);
  const folded = document.querySelectorAll("#provenance details:not([open])");
  let onPaper = [];
  addEventListener("beforeprint", () => {
    printing = true;
    redraw();
    tabulate();
    onPaper = sheets();
    folded.forEach((one) => { one.open = true; });
  });
  addEventListener("afterprint", () => {
    printing = false;
    onPaper.forEach((sheet) => sheet.remove());
    folded.forEach((one) => { one.open = false; });
    redraw();
    tabulate();
  });
  document.documentElement.dataset.ready = "true";
  drawAll();
})();
