// What the shown samples hold, counted.
function showStatistics() {
  const byAsset = new Map();
  const byRole = new Map();
  const groups = new Map();
  const add = (totals, name, value) => totals.set(name, (totals.get(name) ?? 0) + value);
  for (const sample of shown) {
    for (const [asset, role] of sample.actors) {
      if (role !== "ego") add(byAsset, asset, 1);
      add(byRole, role, 1);
    }
    for (const [group, numbers] of Object.entries(sample.counts)) {
      if (!groups.has(group)) groups.set(group, new Map());
      for (const [name, value] of Object.entries(numbers)) add(groups.get(group), name, value);
    }
  }
  const pick = (name) => {
    filters.asset = name;
    buildFilters();
    refilter();
  };
  const own = [...groups].map(([group, totals]) => card(group, "counted in the task's facts", barList(totals, shares(totals))));
  byId("statistics").replaceChildren(h("div", { class: "columns" },
    ...own,
    card("Actors by kind", "without the ego car; choose one to filter", barList(byAsset, grouped, pick)),
    card("Actors by role", null, barList(byRole, grouped)),
    ...METRICS.map(spread)),
    h("h2", { class: "part" }, "How the split was made"),
    h("div", { class: "columns" }, ...aboutCards()));
}

function shares(totals) {
  const sum = [...totals.values()].reduce((a, b) => a + b, 0) || 1;
  return (value) => `${rounded(value, 0)} · ${percent(value / sum)}`;
}

function spread(metric) {
  const values = valuesOf(metric, shown);
  if (!values.length) return null;
  const sorted = [...values].sort((a, b) => a - b);
  const at = (share) => `${rounded(sorted[Math.round(share * (sorted.length - 1))], 1)}${metric.unit}`;
  return card(metric.label, metric.hint, h("div", { class: "spread" }, columns(binned(values, 0, metric.high, 40)),
    h("div", { class: "ends" }, h("span", {}, "0"), h("span", {}, `median ${at(0.5)}, middle half ${at(0.25)} to ${at(0.75)}`), h("span", {}, `${rounded(metric.high, 0)}${metric.unit}`))));
}

function aboutCards() {
  return Object.entries(ABOUT.facts).filter(([, value]) => isObject(value) && Object.keys(value).length)
    .map(([key, value]) => card(key, null, facts(key, flattened(value))))
    .concat([card("dataset", null, facts("dataset", Object.entries(ABOUT.facts).filter(([, value]) => !isObject(value))))]);
}
