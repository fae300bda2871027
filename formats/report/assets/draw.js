// From the page's data to charts: traces and layouts of plotly.js, and nothing that touches the page.
"use strict";

const Draw = (() => {
  const COVERAGE = 2; // Standard uncertainties on each side of an interval of 95 %.

  function numbers(data) {
    if (data === undefined) return null;
    if (typeof data === "string") {
      const bytes = Uint8Array.from(atob(data), (character) => character.charCodeAt(0));
      return Array.from(new Float32Array(bytes.buffer));
    }
    const at = "same" in data ? () => data.same : (place) => data.from + place * data.step;
    return Array.from({ length: data.count }, (_, place) => at(place));
  }

  // plotly.js reads some HTML in texts.
  const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
  const LONGEST_LINE = 34; // Characters of a title beside an axis: a longer one goes on below.

  function label(axis) {
    const text = axis.unit ? (axis.name ? `${axis.name} / ${axis.unit}` : axis.unit) : axis.name;
    const lines = [""];
    for (const word of text.split(" ")) {
      const longer = `${lines[lines.length - 1]} ${word}`.trim();
      if (longer.length > LONGEST_LINE && lines[lines.length - 1]) lines.push(word);
      else lines[lines.length - 1] = longer;
    }
    return lines.map(plain).join("<br>");
  }


  // Digits that a standard uncertainty gives a meaning to; five significant ones without it.
  function shown(value, std) {
    if (!Number.isFinite(value)) return "not known";
    const size = std > 0 ? std : Math.abs(value) * 1e-3 || 1;
    const decimals = Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(size))));
    return std > 0 ? `${value.toFixed(decimals)} ± ${std.toFixed(decimals)}` : value.toFixed(decimals);
  }

  function colours() {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(`--${name}`).trim();
    return { ink: of("ink"), faint: of("faint"), line: of("line"), bad: of("bad"), curves: [0, 1, 2, 3, 4, 5, 6].map((index) => of(`c${index}`)) };
  }

  const clear = (colour, share) => colour + Math.round(255 * share).toString(16).padStart(2, "0");

  function layout(more) {
    const { ink, faint } = colours();
    const base = {
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: ink, size: 13, family: "system-ui, sans-serif" },
      margin: { l: 64, r: 24, t: 32, b: 52 }, hovermode: "closest", modebar: { bgcolor: "rgba(0,0,0,0)", color: faint, activecolor: ink }, legend: { orientation: "h", x: 0.5, xanchor: "center", y: -0.2, yanchor: "top" },
    };
    return { ...base, ...more };
  }

  function axis(of, more) {
    const { line, faint } = colours();
    return { title: { text: label(of), standoff: 8 }, gridcolor: line, zerolinecolor: faint, linecolor: faint, automargin: true, ...more };
  }

  // The next of 1, 1.5, 2, 3, 4, 5, 6, 8 and 10 times a power of ten.
  function roundedUp(value) {
    if (!(value > 0)) return 1;
    const power = 10 ** Math.floor(Math.log10(value));
    const step = [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((one) => one * power >= value * (1 - 1e-12));
    return Number(((step ?? 10) * power).toPrecision(3));
  }

  // Whether angles go once around the part.
  function closed(angles) {
    const count = angles.length;
    const span = angles[count - 1] - angles[0];
    return count > 8 && 360 - span < (3 * span) / (count - 1);
  }

  // The Gaussian low-pass of ISO 16610-21 on a closed profile: order n passes by 2^-(n/cutoff)^2.
  function gaussian(angles, values, cutoff) {
    const count = values.length;
    const turn = Math.PI / 180;
    const weights = angles.map((angle, place) => {
      const before = place ? angles[place - 1] : angles[count - 1] - 360;
      const after = place + 1 < count ? angles[place + 1] : angles[0] + 360;
      return (after - before) / 720;
    });
    const filtered = new Float64Array(count);
    const highest = Math.min(Math.floor(count / 2) - 1, Math.ceil(3.2 * cutoff));
    for (let order = 0; order <= highest; order++) {
      let cosine = 0, sine = 0;
      for (let place = 0; place < count; place++) {
        const phase = order * angles[place] * turn;
        cosine += weights[place] * values[place] * Math.cos(phase);
        sine += weights[place] * values[place] * Math.sin(phase);
      }
      const passes = (order ? 2 : 1) * 2 ** -((order / cutoff) ** 2);
      for (let place = 0; place < count; place++) {
        const phase = order * angles[place] * turn;
        filtered[place] += passes * (cosine * Math.cos(phase) + sine * Math.sin(phase));
      }
    }
    return Array.from(filtered);
  }

  // A horizontal line across the chart; its name is in the legend, where no curve is below it.
  function level(figure) {
    if (!figure.level) return {};
    const { ink } = colours();
    const { value: at, name } = figure.level;
    const line = { color: ink, width: 1.2, dash: "dash" };
    return { shapes: [{ type: "line", xref: "paper", x0: 0, x1: 1, yref: "y", y0: at, y1: at, line, name: plain(name), showlegend: true }], showlegend: true };
  }

  const NAMES_APART = 0.045; // Of the axis: as close as names beside each other are readable on paper.
  const NAMES_BELOW = 3; // Names below each other, where places are closer.

  // Names of places, from left to right, with the height of each: names of close places are below each other, and of more than fit one text.
  function laid(places, [from, to]) {
    const free = Array(NAMES_BELOW).fill(-Infinity);
    const labels = [];
    for (const [at, text] of [...places].sort(([one], [other]) => one - other)) {
      const row = free.findIndex((last) => at - last >= NAMES_APART * (to - from));
      if (row < 0) labels[labels.length - 1].text += `, ${text}`;
      else {
        labels.push({ at, text, y: 1 - row / NAMES_BELOW });
        free[row] = at;
      }
    }
    return labels;
  }

  // Named places along the horizontal axis: a line from bottom to top, with its name.
  function named(figure, chart) {
    const { faint } = colours();
    const places = figure.named ?? [];
    const line = ([at]) => ({ type: "line", xref: "x", x0: at, x1: at, yref: "paper", y0: 0, y1: 1, line: { color: faint, width: 1, dash: "dot" } });
    const name = ({ at, text, y }) => ({ x: at, xref: "x", y, yref: "paper", yanchor: "top", xanchor: "right", text: plain(text), textangle: -90, showarrow: false, font: { size: 10, color: faint } });
    if (!places.length) return chart;
    return { ...chart, shapes: [...(chart.shapes ?? []), ...places.map(line)], annotations: [...(chart.annotations ?? []), ...laid(places, chart.xaxis.range).map(name)] };
  }

  const DASHES = ["dash", "dot", "dashdot", "longdash"];

  // Limits that differ from place to place; several are dashed differently.
  function over(figure) {
    const { ink } = colours();
    return (figure.lines ?? []).map(({ name, x, y }, index) => ({
      type: "scatter", mode: "lines", x: numbers(x), y: numbers(y), name: plain(name), line: { color: ink, width: 1.2, dash: DASHES[index % DASHES.length] }, meta: "limit", showlegend: true,
      hovertemplate: `order %{x}: limit %{y} ${figure.y.unit}<extra></extra>`,
    }));
  }

  const MOST_PLACES = 30; // Names beside each other below a chart.

  // The horizontal axis, with the names of its places where there are some.
  function across(figure, x) {
    const places = figure.places ?? [];
    if (!places.length) return axis(figure.x);
    const range = x.length ? { range: [Math.min(...x) - 0.5, Math.max(...x) + 0.5] } : {};
    if (places.length > MOST_PLACES || places.some(([, name]) => name.length > 24)) return axis(figure.x, range);
    return axis({ name: "", unit: "" }, { ...range, tickvals: places.map(([at]) => at), ticktext: places.map(([, name]) => plain(name)) });
  }

  function lines(figure, panel) {
    const { curves: palette, bad } = colours();
    const places = new Map(figure.places ?? []);
    const traces = [];
    let everyX = [];
    panel.curves.forEach((curve, index) => {
      const colour = palette[index % palette.length];
      const [x, y, std] = [numbers(curve.x), numbers(curve.y), numbers(curve.std)];
      if (places.size) everyX = everyX.concat(x);
      if (std) {
        const side = (sign) => y.map((value, place) => value + sign * COVERAGE * (std[place] || 0));
        traces.push({
          type: "scatter", mode: "lines", x: [...x, ...[...x].reverse()], y: [...side(1), ...side(-1).reverse()], fill: "toself",
          fillcolor: clear(colour, 0.2), line: { width: 0 }, hoverinfo: "skip", showlegend: false,
        });
      }
      traces.push({
        type: "scatter", mode: places.size && index === 0 ? "lines+markers" : "lines", x, y,
        text: y.map((value, place) => shown(value, std?.[place])), name: plain(curve.name) || plain(figure.title),
        customdata: x.map((at) => plain(places.get(at) ?? `${Number(at.toPrecision(6))} ${figure.x.unit}`)),
        line: { color: colour, width: 1.5, dash: curve.y.same === undefined ? "solid" : "dash" }, meta: "values", showlegend: panel.curves.length > 1,
        hovertemplate: `%{customdata}: %{text} ${figure.y.unit}<extra>%{fullData.name}</extra>`,
      });
      const marks = curve.marks ?? [];
      if (marks.length) {
        traces.push({
          type: "scatter", mode: "markers", x: marks.map(([at]) => at), y: marks.map(([, at]) => at), text: marks.map(([at, , said]) => plain(`${places.get(at) ?? at}: ${said}`)),
          name: "rule broken", marker: { color: bad, size: 9, symbol: "diamond" }, meta: "marks", hovertemplate: "%{text}<extra></extra>", showlegend: true,
        });
      }
    });
    // A spectrum has few high lines and many low ones.
    const spectrum = figure.x.unit === "Hz" && traces.every(({ y }) => y.every((one) => !(one < 0)));
    const yaxis = axis(figure.y, spectrum ? { type: "log", dtick: 1, exponentformat: "power" } : {});
    return { traces, layout: layout({ xaxis: across(figure, everyX), yaxis, height: 400, ...level(figure) }), said: spectrum ? "logarithmic axis" : "" };
  }

  // Points with their expanded uncertainty; what all of them share is a line.
  function points(figure, panel) {
    const { curves: palette, faint } = colours();
    const traces = panel.curves.map((curve, index) => {
      const [x, y, std] = [numbers(curve.x), numbers(curve.y), numbers(curve.std)];
      const colour = curve.joined ? faint : palette[index % palette.length];
      return {
        type: "scatter", mode: curve.joined ? "lines" : "markers", x, y, name: plain(curve.name) || plain(figure.title), meta: "values",
        text: y.map((value, place) => shown(value, std?.[place])), marker: { color: colour, size: 6 }, line: { color: colour, width: 1.2, dash: "dash" },
        error_y: std ? { type: "data", array: std.map((one) => COVERAGE * one), thickness: 1, width: 0, color: colour } : undefined,
        showlegend: panel.curves.length > 1, hovertemplate: `%{x} ${figure.x.unit}: %{text} ${figure.y.unit}<extra>%{fullData.name}</extra>`,
      };
    });
    return { traces, layout: layout({ xaxis: axis(figure.x), yaxis: axis(figure.y), height: 400, ...level(figure) }) };
  }

  const FIRST_ORDERS = 50; // Shown at first; the axis can be moved to higher ones.

  // Of coefficients, whose uncertainty is that of both parts together, and without eccentricity, which is no form and would hide it.
  const amplitudes = (figure, panel) => overOrder(figure, panel, { lowest: 2, share: Math.SQRT1_2 });
  const bars = (figure, panel) => overOrder(figure, panel, { lowest: 0, share: 1 });

  const WIDE_RANGE = 30; // Times a limit, or times the median, beyond which small bars are not visible on a linear axis.

  function overOrder(figure, panel, { lowest, share }) {
    const { curves: palette, faint } = colours();
    const lost = new Set();
    let highest = 0;
    const traces = panel.curves.map((curve, index) => {
      const [x, y, std] = [numbers(curve.x), numbers(curve.y), numbers(curve.std)];
      (curve.missing ?? []).forEach((order) => lost.add(order));
      const kept = x.map((_, place) => place).filter((place) => x[place] >= lowest);
      highest = kept.reduce((most, place) => Math.max(most, x[place]), highest);
      const of = (list) => kept.map((place) => list[place]);
      return {
        type: "bar", x: of(x), y: of(y), name: plain(curve.name) || "amplitude", marker: { color: palette[index % palette.length] }, meta: "values",
        error_y: std ? { type: "data", array: of(std).map((one) => COVERAGE * one * share), thickness: 1, width: 0, color: faint } : undefined,
        text: kept.map((place) => shown(y[place], std ? std[place] * share : undefined)), textposition: "none",
        showlegend: panel.curves.length > 1, hovertemplate: `order %{x}: %{text} ${figure.y.unit}<extra>%{fullData.name}</extra>`,
      };
    });
    const heights = traces.flatMap((trace) => trace.y).filter((one) => one > 0).sort((a, b) => a - b);
    const [least, median, most] = [0, heights.length >> 1, heights.length - 1].map((place) => heights[place] ?? 1);
    const usual = figure.level?.value ?? (share === 1 ? 3 * median : most);
    const wide = most > WIDE_RANGE * usual;
    const uncertain = traces.reduce((all, { y, error_y: error }) => y.reduce((high, one, place) => Math.max(high, one + (error?.array[place] || 0)), all), 0);
    const tallest = Math.max(uncertain || 1, figure.level?.value ?? 0);
    const lowestShown = Math.max(least, 1e-3 * usual) / 2;
    // Of several curves, one without a value is a bar less; an order that none of them has is lost.
    const known = new Set(share === 1 ? traces.flatMap((trace) => trace.x) : []);
    const orders = [...lost].filter((order) => order >= lowest && !known.has(order));
    if (orders.length) {
      highest = Math.max(highest, ...orders);
      traces.push({
        type: "bar", x: orders, y: orders.map(() => tallest), name: "lost order", width: 0.9, hovertemplate: "order %{x} is lost<extra></extra>",
        marker: { color: "rgba(0,0,0,0)", line: { width: 0 }, pattern: { shape: "/", fgcolor: faint, size: 6 } }, showlegend: true,
      });
    }
    const limits = over(figure);
    traces.push(...limits);
    const first = lowest || 1;
    // Named places are where there is something to see.
    const shownOrders = figure.named ? Math.ceil(Math.max(...figure.named.map(([at]) => at))) + 4 : FIRST_ORDERS;
    const xaxis = axis({ name: "order", unit: "UPR" }, { range: [(figure.named ? 0 : first - 0.6), Math.min(highest, shownOrders) + 0.6], tickformat: "d" });
    const yaxis = wide ? { type: "log", range: [Math.log10(lowestShown), Math.log10(1.5 * tallest)], dtick: 1, exponentformat: "power" } : { range: [0, 1.06 * tallest] };
    const said = [
      wide ? "logarithmic axis" : "",
      highest > shownOrders ? `the first ${shownOrders} of ${highest} orders` : "",
    ].filter(Boolean).join("; ");
    return { traces, layout: named(figure, layout({ xaxis, yaxis: axis(figure.y, yaxis), height: 380, barmode: "group", bargap: 0.25, ...level(figure) })), said };
  }

  // A map's numbers: columns, rows, and heights row by row.
  function grid(map) {
    const [x, y, heights] = [numbers(map.xs), numbers(map.ys), numbers(map.heights)];
    const rows = y.map((_, row) => heights.slice(row * x.length, (row + 1) * x.length));
    return { x, y, rows };
  }

  const SCALE = "Viridis";
  const LONGEST_SIDE = 6; // Times the shorter one, of a map that keeps its aspect.
  const bar = (map) => ({ title: { text: label(map.height), side: "right" }, thickness: 14, outlinewidth: 0 });

  function map(of, { x, y, rows }) {
    const trace = { type: "heatmap", x, y, z: rows, colorscale: SCALE, colorbar: bar(of), hoverinfo: "none", zsmooth: false };
    const [wide, tall] = [x, y].map((list) => Math.abs(list[list.length - 1] - list[0]));
    // Lengths along both axes keep their aspect, unless a side would be too short to be seen.
    const keeps = !of.radius_mm && of.x.unit === of.y.unit && Math.max(wide, tall) < LONGEST_SIDE * Math.min(wide, tall);
    const across = axis(of.x, of.radius_mm ? { dtick: 45, range: [x[0], 360] } : keeps ? { constrain: "domain" } : {});
    const along = of.radius_mm ? { range: [y[0], y[y.length - 1]] } : keeps ? { constrain: "domain", scaleanchor: "x" } : {};
    return { traces: [trace], layout: layout({ xaxis: across, yaxis: axis(of.y, along), height: 460, margin: { l: 64, r: 8, t: 32, b: 52 } }) };
  }

  const MOST_SOLID = 160_000; // Points that a phone can still turn.

  // Places of a list, at most so many at equal distances.
  function some(list, most) {
    const stride = Math.ceil(list.length / most);
    return list.map((_, place) => place).filter((place) => place % stride === 0);
  }

  // The surface in space, with deviations so many times as large; rings are closed.
  function solid(of, { x, y, rows }, times) {
    // Rings are left out first: a coarser one would show waves that the surface does not have.
    const angles = some(x, MOST_SOLID);
    const rings = some(y, Math.max(1, Math.floor(MOST_SOLID / angles.length)));
    const round = of.radius_mm !== null && of.radius_mm !== undefined;
    const around = round ? [...angles, angles[0]] : angles;
    const each = (value) => rings.map((ring) => around.map((angle) => value(ring, angle)));
    const heights = each((ring, angle) => rows[ring][angle]);
    const turn = Math.PI / 180;
    const radius = (ring, angle) => of.radius_mm + (times * rows[ring][angle]) / 1e3;
    const places = round
      ? {
        x: each((ring) => y[ring]),
        y: each((ring, angle) => radius(ring, angle) * Math.cos(x[angle] * turn)),
        z: each((ring, angle) => radius(ring, angle) * Math.sin(x[angle] * turn)),
      }
      : { x: angles.map((angle) => x[angle]), y: rings.map((ring) => y[ring]), z: each((ring, angle) => times * rows[ring][angle]) };
    const trace = {
      type: "surface", ...places, surfacecolor: heights, colorscale: SCALE, showscale: false, hoverinfo: "none",
      lighting: { ambient: 0.75, diffuse: 0.5, specular: 0.1 }, contours: { x: { highlight: false }, y: { highlight: false }, z: { highlight: false } },
    };
    const { line } = colours();
    const side = (axis) => ({ title: { text: label(axis) }, gridcolor: line, zeroline: false, showspikes: false, backgroundcolor: "rgba(0,0,0,0)" });
    const scene = round
      ? { xaxis: side(of.y), yaxis: side({ name: "x", unit: "mm" }), zaxis: side({ name: "y", unit: "mm" }), aspectmode: "data", camera: { eye: { x: 1.25, y: -2.05, z: 1.0 } } }
      : { xaxis: side(of.x), yaxis: side(of.y), zaxis: side(times === 1 ? of.height : { name: `${of.height.name} × ${times}`, unit: of.height.unit }), aspectmode: "manual", aspectratio: { x: 1.3, y: 1.3, z: 0.4 }, camera: { eye: { x: 1.4, y: 1.4, z: 1.3 }, center: { x: 0, y: 0, z: -0.15 } } };
    const said = rings.length > 1 && rings[1] > 1 ? `one of ${rings[1]} ${round ? "rings" : "rows"} is drawn` : "";
    return { traces: [trace], layout: layout({ scene, height: 460, margin: { l: 0, r: 0, t: 0, b: 0 } }), rings, angles, said };
  }

  // One ring of a surface, or one row of a map.
  function ring(of, { x, y, rows }, row) {
    const panel = { name: "", curves: [{ name: "", x: null, y: null, missing: [] }] };
    const title = `${of.y.name} = ${Number(y[row].toPrecision(6))} ${of.y.unit}`;
    const figure = { title, x: of.x, y: of.height };
    const curve = panel.curves[0];
    const encoded = (list) => btoa(String.fromCharCode(...new Uint8Array(new Float32Array(list).buffer)));
    [curve.x, curve.y] = [encoded(x), encoded(rows[row])];
    return { title, ...(of.radius_mm ? Draw.polar(figure, panel, {}) : lines(figure, panel)) };
  }

  // What can be chosen of a figure, by its kind.
  const choices = {};

  const parts = { COVERAGE, axis, clear, closed, colours, gaussian, layout, numbers, plain };
  return { ...parts, amplitudes, bars, choices, grid, lines, map, points, ring, shown, solid, roundedUp };
})();
