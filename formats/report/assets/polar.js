// Polar plots: curves over an angle, with the reference circles that belong to them.
"use strict";

Object.assign(Draw, (() => {
  const { COVERAGE, clear, closed, colours, gaussian, layout, numbers, plain, roundedUp, shown } = Draw;
  const MM_PER_PX = 25.4 / 96; // As CSS defines them.
  const FILTERS = [15, 50, 150, 500]; // Cut-offs in undulations per revolution, beside those of the values.
  const CENTRED = 0.5; // Beyond this share of RONt beside the origin, a profile is drawn about the centre of its circle.
  const MOST_CIRCLES = 4; // Curves whose circles are drawn together: more would hide each other.
  const MEANING = { LSCI: "least squares", MZCI: "minimum zone", MICI: "maximum inscribed", MCCI: "minimum circumscribed" };
  const RADIANS = Math.PI / 180;

  // The filters and the circles that a figure can be looked at with.
  function choices(figure) {
    const known = figure.panels.flatMap((panel) => panel.curves).flatMap((curve) => curve.circles ?? []);
    const filters = new Map([[0, "none"], ...FILTERS.map((upr) => [upr, `Gaussian ${upr} UPR`]), ...known.map(({ upr, filter }) => [upr, filter])]);
    const circles = [...new Set(known.map(({ name }) => name))].map((name) => [name, `${name}, ${MEANING[name] ?? ""}`]);
    const all = [{ key: "cutoff", text: "Filter", options: [...filters].sort(([one], [other]) => one - other) }];
    return circles.length ? [...all, { key: "circle", text: "Circle", options: [...circles, ["", "none"]] }] : all;
  }

  const radius = ({ at: [x, y, r] }, angle) => r + x * Math.cos(angle * RADIANS) + y * Math.sin(angle * RADIANS);

  // Curves behind the filter, each with its circle where there is one.
  function curvesOf(panel, cutoff, wanted) {
    return panel.curves.map((curve) => {
      const theta = numbers(curve.x);
      const whole = closed(theta);
      const filtered = cutoff > 0 && whole;
      const values = filtered ? gaussian(theta, numbers(curve.y), cutoff) : numbers(curve.y);
      // What a filter leaves of an uncertainty is not known here.
      const std = filtered ? null : numbers(curve.std);
      const circle = (curve.circles ?? []).find(({ upr, name }) => upr === cutoff && name === wanted);
      const far = circle && Math.hypot(circle.at[0], circle.at[1]) > CENTRED * (circle.peak[1] - circle.valley[1]);
      const origin = far ? circle : { at: [0, 0, 0] };
      return { name: curve.name, theta, values: far ? values.map((value, place) => value - radius(origin, theta[place])) : values, std, whole, circle, origin, far };
    });
  }

  // A circle, those through peak and valley about the same centre, and where these are.
  function circleTraces({ name, circle, origin }, colour) {
    const around = Array.from({ length: 181 }, (_, step) => 2 * step);
    const at = (angle, more) => radius(circle, angle) - radius(origin, angle) + more;
    const ring = (more, dash, showlegend) => ({
      type: "scatterpolar", mode: "lines", name: plain([circle.name, name].filter(Boolean).join(" ")), theta: around, r: around.map((angle) => at(angle, more)), hoverinfo: "skip",
      line: { color: colour, width: 1, dash }, showlegend,
    });
    const mark = (text, [angle, deviation], symbol) => ({
      type: "scatterpolar", mode: "markers", name: plain([text, name].filter(Boolean).join(" ")), theta: [angle], r: [at(angle, deviation)], showlegend: false,
      marker: { color: colour, size: 11, symbol, line: { width: 1 } }, hovertemplate: `${text} at %{theta:.1f}°: ${shown(deviation)}<extra>%{fullData.name}</extra>`,
    });
    return [ring(0, "dash", true), ring(circle.peak[1], "dot", false), ring(circle.valley[1], "dot", false), mark("peak", circle.peak, "triangle-up"), mark("valley", circle.valley, "triangle-down")];
  }

  function polar(figure, panel, { cutoff = 0, circle: wanted = "LSCI" }) {
    const { line, faint, curves: palette } = colours();
    const traces = [];
    const curves = curvesOf(panel, cutoff, wanted);
    let largest = 0;
    for (const { values, std } of curves) {
      values.forEach((value, place) => { largest = Math.max(largest, Math.abs(value) + COVERAGE * (std?.[place] || 0)); });
    }
    const span = roundedUp(largest);
    const circled = curves.filter(({ circle }) => circle);
    const around = Array.from({ length: 181 }, (_, step) => 2 * step);
    if (!circled.length || circled.length > MOST_CIRCLES) {
      traces.push({
        type: "scatterpolar", mode: "lines", name: "zero", theta: around, r: around.map(() => 0), hoverinfo: "skip",
        line: { color: faint, width: 1.2, dash: "dash" }, showlegend: true,
      });
    }
    curves.forEach((curve, index) => {
      const { name, theta, values, std, whole, circle } = curve;
      const colour = palette[index % palette.length];
      const again = (list) => (whole ? [...list, list[0]] : list);
      if (std?.some((one) => COVERAGE * one > 0.002 * span)) {
        const side = (sign) => again(values.map((value, place) => value + sign * COVERAGE * (std[place] || 0)));
        traces.push({
          type: "scatterpolar", mode: "lines", theta: [...again(theta), ...again(theta).reverse()], r: [...side(1), ...side(-1).reverse()],
          fill: "toself", fillcolor: clear(colour, 0.25), line: { width: 0 }, hoverinfo: "skip", showlegend: false, name: `${plain(name)} ± 2 std`,
        });
      }
      const text = again(values.map((value, place) => shown(value, std?.[place])));
      traces.push({
        type: "scatterpolar", mode: "lines", name: plain(name) || plain(figure.title), theta: again(theta), r: again(values), text,
        line: { color: colour, width: 1.8 }, meta: "values", showlegend: curves.length > 1 || name !== "",
        hovertemplate: `%{theta:.2f}°, %{text} ${figure.y.unit}<extra>%{fullData.name}</extra>`,
      });
      if (circle && circled.length <= MOST_CIRCLES) traces.push(...circleTraces(curve, colour));
    });
    const angular = { gridcolor: line, linecolor: faint, ticksuffix: "°", showticksuffix: "all", dtick: 45, direction: "counterclockwise", rotation: 0 };
    const radial = {
      range: [-2 * span, span], tickvals: [-span, 0, span], ticktext: [`−${span}`, "0", `+${span}`].map((text) => `${text} ${figure.y.unit}`),
      angle: 22.5, tickangle: 22.5, gridcolor: line, linecolor: "rgba(0,0,0,0)", tickfont: { size: 11, color: faint },
    };
    const place = layout({
      polar: { bgcolor: "rgba(0,0,0,0)", radialaxis: radial, angularaxis: angular }, margin: { l: 48, r: 48, t: 32, b: 32 }, height: 480,
    });
    place.legend = { ...place.legend, y: -0.1 };
    const magnification = (plot) => {
      const across = plot._fullLayout.polar._subplot?.radius;
      const um = { "µm": 1, nm: 1e-3, mm: 1e3 }[figure.y.unit];
      if (!across || !um) return "";
      const times = (1e3 * MM_PER_PX * across) / (3 * span * um);
      return `magnification ${Number(times.toPrecision(2)).toLocaleString("en")} : 1 in print`;
    };
    const bounds = curves.map(({ name, std }) => {
      const same = std?.every((one) => Math.abs(one - std[0]) <= 1e-6 * std[0]) && std[0] > 0;
      return same ? `${name || figure.title}: U = ${(COVERAGE * std[0]).toPrecision(2)} ${figure.y.unit}` : "";
    });
    const said = bounds.filter(Boolean);
    const bound = said.length && said.length <= 4 ? `${said.join(", ")} (k = 2)` : "";
    const none = !circled.length && wanted && panel.curves.some(({ circles }) => circles?.length) ? "no circle is computed behind this filter: `filter_upr` in [evaluate] gives it" : "";
    const centred = curves.some(({ far }) => far) ? `drawn about the centre of ${wanted}` : "";
    return { traces, layout: place, magnification, said: [none, centred, bound].filter(Boolean).join("; "), table: sheet(figure, circled) };
  }

  // What is written beside a polar plot of form: a row for each curve.
  function sheet({ y: { unit } }, circled) {
    if (!circled.length) return null;
    const { filter, name } = circled[0].circle;
    // As many decimals as RONt has.
    const fixed = (circle, value) => value.toFixed(Math.min(9, (circle.ront.split(" ")[0].split(".")[1] ?? "").length)).replace("-", "−");
    const at = (circle, [angle, deviation]) => `${fixed(circle, deviation)} at ${angle.toFixed(1)}°`;
    const off = (circle) => (circle.off ? `${fixed(circle, circle.off[0])} to ${circle.off[1].toFixed(1)}°` : "not observable");
    return {
      caption: `About ${name}, filter: ${filter}; lengths in ${unit}`,
      head: ["of", "RONt", "peak", "valley", "eccentricity"],
      rows: circled.map(({ name: curve, circle }) => [curve, circle.ront, at(circle, circle.peak), at(circle, circle.valley), off(circle)]),
    };
  }

  return { polar, choices: { ...Draw.choices, polar: choices } };
})());
