// Histograms of numbers, and bars for counts by name.
function binned(values, low, high, bins) {
  const counts = new Array(bins).fill(0);
  const width = (high - low) / bins || 1;
  for (const value of values) {
    const bin = Math.min(bins - 1, Math.floor((value - low) / width));
    if (bin >= 0) counts[bin] += 1;
  }
  return counts;
}

function columns(counts, isIn = () => true) {
  const top = Math.max(1, ...counts);
  const bars = counts.map((count, i) => {
    const height = count ? Math.max(2, (count / top) * 100) : 0;
    return svg("rect", { x: i + 0.06, y: 100 - height, width: 0.88, height, class: isIn(i) ? "in" : "" });
  });
  return svg("svg", { viewBox: `0 0 ${counts.length} 100`, preserveAspectRatio: "none", "aria-hidden": "true" }, bars);
}

function niceCeiling(value) {
  if (!(value > 0)) return 1;
  const step = 10 ** Math.floor(Math.log10(value)) / 2;
  return Math.ceil(value / step) * step;
}

const MOST_BARS = 40;

function barList(totals, describe, pick = null) {
  const sorted = [...totals].sort((a, b) => b[1] - a[1] || (a[0] < b[0] ? -1 : 1));
  const top = sorted.length ? sorted[0][1] : 1;
  const rows = sorted.slice(0, MOST_BARS).map(([name, value]) => {
    const fill = h("div", { class: "bar-fill" });
    fill.style.width = `${(100 * value) / (top || 1)}%`;
    const label = pick ? h("button", { type: "button", title: `Show only samples with ${name}`, onclick: () => pick(name) }, name) : name;
    return [h("dt", { title: name }, label), h("dd", { class: "bar-track", "aria-hidden": "true" }, fill), h("dd", { class: "number" }, describe(value))];
  });
  const rest = sorted.length - MOST_BARS;
  return [h("dl", { class: "bars" }, rows), rest > 0 ? h("p", { class: "dim" }, `and ${rest} more`) : null];
}
