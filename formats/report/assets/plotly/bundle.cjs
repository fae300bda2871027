const Plotly = require('plotly.js/lib/core');
Plotly.register([
  require('plotly.js/lib/bar'), require('plotly.js/lib/heatmap'),
  require('plotly.js/lib/scatterpolar'), require('plotly.js/lib/surface'),
]);
module.exports = Plotly;
