// The page on paper: sizes of charts, and a sheet for each station where these are few.
"use strict";

const Paper = (() => {
  const MOST_SHEETS = 4; // Stations that have a sheet each.
  const MOST_ROWS = 84; // Of a table that fills a page.
  const MOST_NOTES = 24; // Footnotes that are printed.
  const FEW = 4; // Charts that are half as wide as the page; more are a third.
  const FONT = 9; // Pixels, of 96 an inch.
  // Between the margins of A4 a browser has 688 px, and says so only once it prints.
  const SIZES = { lead: [660, 285], half: [318, 225], third: [206, 178], large: [434, 286], beside: [206, 152] };

  function size(place) {
    const charts = place.closest(".charts");
    if (place.closest(".map")) return SIZES.half;
    if (!charts) return SIZES.lead;
    if (place.closest(".sheet-of-station")) return place.closest(".large") ? SIZES.large : SIZES.beside;
    return charts.classList.contains("few") ? SIZES.half : SIZES.third;
  }

  // A chart's layout at its size on paper: small letters; its legend is text below it.
  function layout(place, drawn, { height: _, legend, margin, polar, ...rest }) {
    const [width, height] = size(place);
    const small = polar && { ...polar, radialaxis: { ...polar.radialaxis, tickfont: { ...polar.radialaxis.tickfont, size: FONT - 1 } } };
    const bar = drawn.some(({ marker }) => marker?.colorbar) ? 40 : 0;
    const edges = polar ? { l: 26, r: 26, t: 18, b: 24 } : { l: 40, r: 10, t: 8, b: 34 + bar };
    return { ...rest, ...(small ? { polar: small } : {}), autosize: false, width, height, font: { ...rest.font, size: FONT }, margin: { ...margin, ...edges }, showlegend: false };
  }

  // Points as small as the letters.
  const traces = (drawn) => drawn.map((one) => (one.marker?.size > 0 ? { ...one, marker: { ...one.marker, size: 0.6 * one.marker.size } } : one));

  // A line of names with their colours and marks: [name, colour, mark].
  function legend(drawn, { shapes = [] }) {
    const dashes = { dash: "╌╌", dot: "┈┈", dashdot: "─·", longdash: "╴╴" };
    const mark = ({ type, mode, line, marker }) => (type === "bar" ? (marker.pattern ? "▨" : "■") : mode === "markers" ? (marker.symbol === "diamond" ? "◆" : "●") : dashes[line?.dash] ?? "━");
    return [...drawn, ...shapes].filter(({ showlegend, name }) => showlegend && name)
      .map((one) => [one.name.replaceAll("&lt;", "<").replaceAll("&gt;", ">").replaceAll("&amp;", "&"), one.marker?.pattern?.fgcolor ?? one.line?.color ?? one.marker?.color, mark(one)]);
  }

  // Names of the stations that have a sheet each; none where they are one or many.
  function stations(figures) {
    const names = figures[0]?.panels.map(({ name }) => name) ?? [];
    const known = names.length > 1 && names.length <= MOST_SHEETS && names.every(Boolean);
    return known ? names : [];
  }

  // Figures with a panel for each of these stations.
  const ofStations = (figures, names) => figures.filter(({ panels }) => panels.length === names.length && panels.every(({ name }, index) => name === names[index]));

  return { FEW, MOST_NOTES, MOST_ROWS, layout, legend, ofStations, stations, traces, widthOf: (place) => size(place)[0] };
})();
