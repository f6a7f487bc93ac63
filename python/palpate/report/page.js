"use strict";
(() => {
  const { colours, charts } = JSON.parse(document.getElementById("report-data").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const finger = window.matchMedia("(pointer: coarse)").matches;
  const roots = () => Bokeh.documents.flatMap((each) => each.roots());

  // Gives every part of the charts the colour of its use; tags such as "line:ink" name the use.
  function paint(scheme) {
    const colour = colours[scheme];
    document.documentElement.dataset.scheme = scheme;  // on paper, page.css inverts charts of the dark scheme
    for (const model of roots().flatMap((root) => [...root.references()])) {
      for (const tag of model.tags ?? []) {
        const [part, use] = tag.split(":");
        model[`${part}_color`] = model.type === "Span" ? colour[use] : { value: colour[use] };
      }
      if (model.axis_label_text_color !== undefined) {
        model.axis_label_text_color = colour.ink;
        model.major_label_text_color = colour.soft;
        model.axis_line_color = model.major_tick_line_color = colour.soft;
      } else if (model.grid_line_color !== undefined) {
        model.grid_line_color = colour.rule;
      }
    }
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
