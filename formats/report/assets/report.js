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

  // Two charts are beside each other on A4, whose width a browser gives only once it prints.
  const PAPER = { width: 320, wide: 660, height: 0.7 };
  let printing = false;

  // Draws into a place of the chart's own height, and as wide as there is room.
  function put(place, { traces, layout: { height, ...layout } }) {
    const high = printing ? PAPER.height * height : height;
    place.style.height = `${high}px`;
    // The first figure has the page's width; a map shares it with its body in space.
    const width = place.closest(".first") && !place.closest(".map") ? PAPER.wide : PAPER.width;
    // A lower chart has its legend farther below, by shares of its height.
    const legend = { ...layout.legend, y: layout.polar ? -0.2 : -0.38 };
    const size = printing ? { autosize: false, width, height: high, legend } : { autosize: true };
    return Plotly.react(place, traces, { ...layout, ...size }, CONFIG);
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
        space.style.zoom = printing ? PAPER.width / space.offsetWidth : "";
        return printing || solid();
      });
    });
    // Later than at first, when another panel was chosen.
    if (document.documentElement.dataset.complete) beginFlat().then(beginSolid);
    else waiting.push({ place: flat, draw: beginFlat }, { place: space, draw: beginSolid });
    redraws.push(map, () => chosen.row !== null && open(chosen.row));
  }

  function table() {
    const body = document.querySelector("#rows tbody");
    if (!body) return;
    let most = 50;
    const columns = Object.fromEntries(Object.entries(data.values).map(([key, column]) => [key, column.texts ? column.rows.map((row) => column.texts[row]) : column]));
    const values = columns.shown.map((_, row) => Object.fromEntries(Object.entries(columns).map(([key, column]) => [key, column[row]])));
    const [filter, count, all] = ["filter", "shown", "all"].map((id) => document.getElementById(id));
    const keys = ["place", "symbol", "low", "shown", "high", "unit", "interval", "kind", "refers", "note"];
    const numeric = new Set(["low", "shown", "high", "interval"]);
    // What a value is by its standard is a footnote of the rows that are shown: its number is in the row, its text below.
    function footnoted(rows) {
      const texts = [...new Set(rows.map((row) => row.about))];
      rows.forEach((row) => { row.note = [row.remark.replace(/; $/, ""), `${texts.indexOf(row.about) + 1})`].filter(Boolean).join(" "); });
      document.getElementById("footnotes").replaceChildren(...texts.map((text) => element("li", { textContent: text })));
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
      const several = ["stations", "sections"].includes(first.group) ? `${group.length} ${first.group}` : `${first.group}, ${group.length} stations`;
      const head = { ...first, key, place: several, low: low.shown, shown: middle.shown, high: high.shown, interval: "", kind: "", remark, value: middle.value };
      return open.has(key) ? [head, ...group] : [head];
    }
    const show = () => {
      const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
      rows = values.filter(matches(words));
      const listed = words.length || sorted ? [...rows] : [...groups].flatMap(([key, group]) => gathered(key, group));
      if (sorted) {
        const [key, sign] = [sorted, down ? -1 : 1];
        listed.sort((a, b) => sign * (key === "value" ? (a.value ?? Infinity) - (b.value ?? Infinity) : String(a[key] ?? "").localeCompare(String(b[key] ?? ""), "en", { numeric: true })));
      }
      const cell = (row, key) => {
        const names = [numeric.has(key) ? "number" : "", key === "low" || key === "high" ? "several" : ""];
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
      count.textContent = listed.length > most ? `the first ${most} of ${listed.length} rows` : `${rows.length} values`;
    };
    filter.addEventListener("input", show);
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
    // On paper nothing is left out.
    let onScreen = most;
    addEventListener("beforeprint", () => { [onScreen, most] = [most, Infinity]; show(); });
    addEventListener("afterprint", () => { most = onScreen; show(); });
    show();
  }

  const redraw = () => redraws.forEach((one) => one());
  document.querySelectorAll("[data-figure]").forEach((box) => chart(data.figures[Number(box.dataset.figure)], box.querySelector(".drawn")));
  if (data.surface) surface(data.surface, document.querySelector('[data-map="surface"]'), "surface");
  table();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  // Print has its own colours and width.
  for (const moment of ["beforeprint", "afterprint"]) {
    addEventListener(moment, () => { printing = moment === "beforeprint"; redraw(); });
  }
  document.documentElement.dataset.ready = "true";
  drawAll();
})();
