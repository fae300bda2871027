// Vectors at places in space, in one plane of the three, layer by layer.
"use strict";

Object.assign(Draw, (() => {
  const { axis, colours, layout, numbers, plain, shown } = Draw;
  const PLANES = [[0, 1], [0, 2], [1, 2]];
  const MOST_LAYERS = 40; // Places along an axis that are looked at one by one.
  const MM = { mm: 1, "µm": 1e-3, nm: 1e-6, m: 1e3 };

  const axes = ({ x, y }, { depth: [name, unit] }) => [x, y, { name, unit }];

  function layers(arrows, across) {
    const places = [...new Set(numbers(arrows.place[across]).map((one) => Number(one.toPrecision(6))))].sort((one, other) => one - other);
    return places.length > 1 && places.length <= MOST_LAYERS ? places : [];
  }

  // Planes, and the layers across the chosen one.
  function choices(figure, panel, { plane = 0 }) {
    const { arrows } = panel;
    const names = axes(figure, arrows);
    const across = 3 - PLANES[plane][0] - PLANES[plane][1];
    const found = layers(arrows, across);
    const planes = { key: "plane", text: "Plane", options: PLANES.map(([one, other], index) => [index, `${names[one].name}, ${names[other].name}`]) };
    if (!found.length) return [planes];
    const { name, unit } = names[across];
    return [planes, { key: "layer", text: name, options: [["all", "all"], ...found.map((at, index) => [index, `${at} ${unit}`])], usual: found.length >> 1 }];
  }

  // The next lower of 1, 2 and 5 times a power of ten.
  function roundedDown(value) {
    const power = 10 ** Math.floor(Math.log10(value));
    return [5, 2, 1].map((step) => step * power).find((one) => one <= value * (1 + 1e-12)) ?? power;
  }

  function vectors(figure, panel, { plane = 0, layer }) {
    const { arrows } = panel;
    const { faint, curves: palette } = colours();
    const [place, vector] = [arrows.place.map(numbers), arrows.vector.map(numbers)];
    const [first, second] = PLANES[plane];
    const across = 3 - first - second;
    const names = axes(figure, arrows);
    const found = layers(arrows, across);
    const at = layer === "all" || !found.length ? null : found[layer ?? found.length >> 1] ?? null;
    const kept = place[across].map((_, index) => index).filter((index) => at === null || Math.abs(place[across][index] - at) <= 1e-5 * Math.abs(at));
    const length = (index) => Math.hypot(vector[first][index], vector[second][index]);
    const span = (list) => kept.reduce(([low, high], index) => [Math.min(low, list[index]), Math.max(high, list[index])], [Infinity, -Infinity]);
    const sides = [place[first], place[second]].map((list) => { const [low, high] = span(list); return high - low; });
    // Of all layers, so that these compare.
    const longest = vector[0].reduce((most, _, index) => Math.max(most, length(index)), 0);
    const spacing = Math.max(...sides, 1e-9) / Math.max(4, Math.sqrt(kept.length));
    const [component] = arrows.components;
    const ratio = (MM[names[first].unit] ?? 1) / (MM[component[1]] ?? 1);
    const times = longest > 0 ? roundedDown((1.5 * spacing * ratio) / longest) : 1;
    const head = innerWidth < 640 ? 6 : 10; // Pixels.
    const [x, y, colour, size, text] = [[], [], [], [], []];
    for (const index of kept) {
      const [from, to] = [[place[first][index], place[second][index]], [vector[first][index], vector[second][index]].map((one) => (times * one) / ratio)];
      const said = arrows.components.map(([name, unit], of) => `${plain(name)} ${shown(vector[of][index])} ${unit}`).join("<br>");
      x.push(from[0], from[0] + to[0], null);
      y.push(from[1], from[1] + to[1], null);
      colour.push(vector[across][index], vector[across][index], 0);
      size.push(3, head, 0);
      text.push(said, said, "");
    }
    const [name, unit] = arrows.components[across];
    const [cmin, cmax] = span(vector[across]);
    const trace = {
      type: "scatter", mode: "lines+markers", x, y, text, meta: "values", name: plain(figure.title), line: { color: faint, width: 1 }, showlegend: false,
      marker: {
        symbol: x.map((_, index) => ["circle", "arrow", "circle"][index % 3]), angleref: "previous", size, color: colour, cmin, cmax, colorscale: "Viridis", opacity: 1, line: { width: 0 },
        colorbar: { title: { text: plain(`${name} / ${unit}`), side: "top" }, orientation: "h", y: -0.22, yanchor: "top", thickness: 10, outlinewidth: 0 },
      },
      hovertemplate: "%{text}<extra></extra>", connectgaps: false,
    };
    const equal = { constrain: "domain" };
    const where = at === null ? "" : `${names[across].name} = ${at} ${names[across].unit}`;
    const said = [where, `vectors are ${times.toLocaleString("en")} times as long as they are`, `the longest of all is ${shown(longest)} ${component[1]}`];
    return {
      traces: [trace], said: said.filter(Boolean).join("; "),
      layout: layout({ xaxis: axis(names[first], equal), yaxis: axis(names[second], { ...equal, scaleanchor: "x" }), height: 480, plot_bgcolor: "rgba(0,0,0,0)", colorway: palette }),
    };
  }

  return { vectors, choices: { ...Draw.choices, vectors: choices } };
})());
