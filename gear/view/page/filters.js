// Which samples are shown. A sample passes when one of its surfaces, in one camera, satisfies everything at once that is
// asked of surfaces, and one of the task's objects everything that is asked of objects.
const SURFACE_METRICS = [
  { key: "visible", label: "Patch visible", unit: " %", factor: 100, ceiling: 100, hint: "visible share of the face's whole silhouette" },
  { key: "occluded", label: "Patch occluded", unit: " %", factor: 100, ceiling: 100, hint: "share of what lies inside the picture that other things cover" },
  { key: "distance", label: "Patch distance", unit: " m", factor: 1, hint: "camera to the middle of the face" },
  { key: "incidence", label: "Patch incidence", unit: "°", factor: 1, ceiling: 180, hint: "0° is head-on, above 90° is seen from behind" },
].map((metric) => ({ ...metric, of: (sample) => sample.surfaces.map((surface) => surface[metric.key]) }));
const unique = (values) => [...new Set(values)].sort();
const OBJECT_METRICS = unique(SAMPLES.flatMap((sample) => Object.keys(sample.things.values))).map((name) => {
  const isShare = name.endsWith("_fraction");
  const label = `Object ${name.replace(/_(fraction|m)$/, "").replaceAll("_", " ")}`;
  const scale = isShare ? { unit: " %", factor: 100, ceiling: 100 } : { unit: " m", factor: 1 };
  return { key: `object.${name}`, label, ...scale, hint: `${name} of the task's objects`, of: (sample) => sample.things.values[name] ?? [] };
});
const METRICS = [...SURFACE_METRICS, ...OBJECT_METRICS];
for (const metric of METRICS) {
  metric.values = valuesOf(metric, SAMPLES);
  metric.high = metric.ceiling ?? niceCeiling(metric.values.reduce((top, value) => Math.max(top, value), 0));
}
const OBJECT_LABELS = unique(SAMPLES.flatMap((sample) => sample.things.labels)).filter((label) => label);
const SURFACE_NAMES = unique(SAMPLES.flatMap((sample) => sample.surfaces.map((surface) => surface.name)));
const CAMERA_NAMES = unique(SAMPLES.flatMap((sample) => sample.surfaces.map((surface) => surface.camera)));
const ASSETS = unique(SAMPLES.flatMap(others));

const ASKED = [...(SURFACE_NAMES.length ? ["one surface in one camera"] : []), ...(OBJECT_METRICS.length ? ["one object"] : [])];
const RULE = ASKED.length ? `A sample is shown when ${ASKED.join(", and ")}, satisfies everything at once that is asked of it.` : "A sample is shown when it satisfies all of this.";

const CHANGED = unique(SAMPLES.flatMap((sample) => sample.compared.objects.map((one) => one.change)));
const CHOICES = { surface: "", camera: "", thing: "", asset: "", text: "", change: "" };
const ORDER = { sort: "", order: "" }; // part of the address like the filters, but kept when they are reset
const filters = { ranges: new Map(), ...CHOICES, ...ORDER };
const whenFiltered = [];
let shown = SAMPLES;

// Assets of the actors, without the ego car: it is in every sample.
function others(sample) {
  return sample.actors.filter((actor) => actor[1] !== "ego").map((actor) => actor[0]);
}

function valuesOf(metric, samples) {
  return samples.flatMap(metric.of).filter(isNumber).map((value) => value * metric.factor);
}

function isWithin(metric, value) {
  const range = filters.ranges.get(metric.key);
  return !range || (isNumber(value) && value * metric.factor >= range[0] && value * metric.factor <= range[1]);
}

function passes(sample) {
  const { ranges, surface: name, camera, thing, asset, text } = filters;
  if (filters.change && !sample.compared.objects.some((one) => one.change === filters.change)) return false;
  if (asset && !others(sample).includes(asset)) return false;
  if (text && !`${sampleName(sample)} ${sample.sequence} ${sample.weather} ${sample.problem && "problem"}`.toLowerCase().includes(text)) return false;
  const isAsked = (metrics) => metrics.some((metric) => ranges.has(metric.key));
  const surfacePasses = (surface) =>
    (!name || surface.name === name) &&
    (!camera || surface.camera === camera) &&
    SURFACE_METRICS.every((metric) => isWithin(metric, surface[metric.key]));
  const objectPasses = (label, i) => (!thing || label === thing) && OBJECT_METRICS.every((metric) => isWithin(metric, metric.of(sample)[i]));
  if ((isAsked(SURFACE_METRICS) || name || camera) && !sample.surfaces.some(surfacePasses)) return false;
  return !(isAsked(OBJECT_METRICS) || thing) || sample.things.labels.some(objectPasses);
}

function refilter() {
  shown = sorted(SAMPLES, filters.sort, filters.order === "up").filter(passes);
  const total = grouped(SAMPLES.length);
  byId("count").textContent = shown.length === SAMPLES.length ? `${total} samples` : `${grouped(shown.length)} of ${total} samples`;
  for (const listener of whenFiltered) listener();
}

function resetFilters() {
  Object.assign(filters, { ranges: new Map(), ...CHOICES });
  buildFilters();
  refilter();
}

function filtersToParams() {
  const params = new URLSearchParams();
  for (const [key, [low, high]] of filters.ranges) params.set(key, `${low}~${high}`);
  for (const key of Object.keys({ ...CHOICES, ...ORDER })) if (filters[key]) params.set(key, filters[key]);
  return params.toString();
}

function filtersFromParams(params) {
  filters.ranges = new Map();
  for (const metric of METRICS) {
    const [low, high] = (params.get(metric.key) ?? "").split("~").map(Number);
    if (isNumber(low) && isNumber(high) && params.has(metric.key)) filters.ranges.set(metric.key, [low, high]);
  }
  for (const key of Object.keys({ ...CHOICES, ...ORDER })) filters[key] = params.get(key) ?? "";
}

function rangeFilter(metric) {
  const output = h("output");
  const chart = h("div");
  const bins = 30;
  const counts = binned(metric.values, 0, metric.high, bins);
  const step = metric.high > 20 ? 1 : 0.1;
  const slider = (end, value) =>
    h("input", { type: "range", min: 0, max: metric.high, step, value, "aria-label": `${metric.label}, ${end}`, oninput: change });
  const [from, to] = filters.ranges.get(metric.key) ?? [0, metric.high];
  const low = slider("at least", from);
  const high = slider("at most", to);

  function draw() {
    const [a, b] = [Number(low.value), Number(high.value)];
    output.textContent = `${rounded(a, 1)} to ${rounded(b, 1)}${metric.unit}`;
    const isIn = (bin) => ((bin + 1) * metric.high) / bins > a && (bin * metric.high) / bins < b + 1e-9;
    chart.replaceChildren(columns(counts, isIn));
  }

  function change(event) {
    if (Number(low.value) > Number(high.value)) (event.target === low ? high : low).value = event.target.value;
    const range = [Number(low.value), Number(high.value)];
    if (range[0] <= 0 && range[1] >= metric.high) filters.ranges.delete(metric.key);
    else filters.ranges.set(metric.key, range);
    draw();
    refilter();
  }

  draw();
  return h("div", { class: "range", role: "group", "aria-label": metric.label, title: metric.hint },
    h("div", { class: "head" }, h("h3", {}, metric.label), output), chart, h("div", { class: "track" }, low, high));
}

function choice(label, key, names, any) {
  const options = [["", any], ...names.map((name) => [name, name])].map(([value, text]) =>
    h("option", { value, selected: filters[key] === value }, text));
  return h("label", {}, label, h("select", { onchange: (event) => { filters[key] = event.target.value; refilter(); } }, options));
}

function buildFilters() {
  const search = h("input", {
    type: "search", value: filters.text, placeholder: "index, sequence, weather", autocomplete: "off",
    oninput: (event) => { filters.text = event.target.value.trim().toLowerCase(); refilter(); },
  });
  byId("filters").replaceChildren(
    h("div", { class: "head" }, h("h2", {}, "Filters"), h("button", { type: "button", id: "reset", onclick: resetFilters }, "Reset")),
    ...(SURFACE_NAMES.length ? SURFACE_METRICS.map(rangeFilter) : []),
    ...(SURFACE_NAMES.length > 1 ? [choice("Surface", "surface", SURFACE_NAMES, "any surface")] : []),
    ...(CAMERA_NAMES.length > 1 ? [choice("Camera", "camera", CAMERA_NAMES, "any camera")] : []),
    ...OBJECT_METRICS.map(rangeFilter),
    ...(OBJECT_METRICS.length && OBJECT_LABELS.length > 1 ? [choice("Object", "thing", OBJECT_LABELS, "any object")] : []),
    ...(CHANGED.length ? [choice("Changed objects", "change", CHANGED, "any or none")] : []),
    choice("Actor", "asset", ASSETS, "anything"),
    h("label", {}, "Search", search),
    h("p", { class: "dim" }, RULE),
  );
}

function toggleFilters(open = byId("filters").hidden) {
  byId("filters").hidden = !open;
  byId("filters-button").setAttribute("aria-expanded", String(open));
  if (open) byId("filters").querySelector("input, select")?.focus();
}
