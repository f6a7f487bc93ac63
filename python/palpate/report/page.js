"use strict";
(() => {
  const { colours, charts } = JSON.parse(document.getElementById("report-data").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const finger = window.matchMedia("(pointer: coarse)").matches;
  const roots = () => Bokeh.documents.flatMap((each) => each.roots());

  function paint(scheme) {
    document.documentElement.dataset.scheme = scheme;  // on paper, page.css inverts charts of the dark scheme
    paintCharts(colours[scheme], roots());
  }
  const scheme = () => (dark.matches ? "dark" : "light");

  Bokeh.set_log_level("warn");
  Promise.all(charts.map((item) => Bokeh.embed.embed_item(item))).then(() => {
    paint(scheme());
    // A finger scrolls the page; a mouse zooms without a click on the tool first.
    for (const tool of finger ? [] : roots().flatMap((root) => root.toolbar.tools)) {
      if ((tool.tools?.[0] ?? tool).type === "BoxZoomTool") tool.active = true;
    }
    document.documentElement.dataset.charts = "drawn";
  });
  dark.addEventListener("change", () => paint(scheme()));
})();
