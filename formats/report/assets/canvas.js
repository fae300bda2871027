// Before the chart library: it measures texts in a canvas and reads them back, which a canvas of its default kind is slow at.
"use strict";

(() => {
  const context = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, settings) {
    return context.call(this, kind, kind === "2d" ? { willReadFrequently: true, ...settings } : settings);
  };
})();
