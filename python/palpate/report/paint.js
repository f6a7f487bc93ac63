"use strict";
// Gives every part of the charts the colour of its use; tags such as "line:ink" name the use.
function paintCharts(colour, roots) {
  for (const model of roots.flatMap((root) => [...root.references()])) {
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
