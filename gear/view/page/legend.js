// What the colours of a preview or a prediction mean.
function pictureLegend(channel) {
  const found = channel.kind === "preview" || channel.kind === "prediction" ? ABOUT.legends[channel.name] : null;
  if (!found) return null;
  return found.names ? namesLegend(found.names) : colourBar(found);
}

const css = ([red, green, blue]) => `rgb(${red}, ${green}, ${blue})`;

function swatch(colour) {
  const node = h("i", { "aria-hidden": "true" });
  node.style.background = css(colour);
  return node;
}

function namesLegend(names) {
  return h("div", { class: "legend colours", role: "list", "aria-label": "Legend" }, names.map(([name, colour]) => h("span", { role: "listitem" }, swatch(colour), name)));
}

function colourBar({ quantity, colours, ticks }) {
  const bar = h("div", { class: "colour-bar", "aria-hidden": "true" });
  bar.style.background = `linear-gradient(to right, ${colours.map(css).join(", ")})`;
  const marks = ticks.map(([position, text]) => {
    const mark = h("span", {}, text);
    mark.style.left = `${position * 100}%`;
    return mark;
  });
  return h("div", { class: "legend colours", role: "img", "aria-label": `Colour bar: ${quantity}, ${ticks.map((tick) => tick[1]).join(", ")}` },
    h("span", {}, quantity), h("div", { class: "colour-scale" }, bar, h("div", { class: "ticks", "aria-hidden": "true" }, marks)));
}
