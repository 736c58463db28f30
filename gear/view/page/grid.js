// The contact sheet.
// The first preview with a legend, such as labels or depth; else the first preview, such as boxes over the picture.
const firstPreview = (isWanted) => CHANNELS.findIndex((channel) => channel.kind === "preview" && isWanted(channel));
const look = { place: [firstPreview((channel) => ABOUT.legends[channel.name]), firstPreview(() => true), 0].find((place) => place >= 0) };
const cells = [];

function buildGrid() {
  const list = h("ul", { class: "cells", id: "cells" });
  for (const sample of SAMPLES) {
    const cell = h("a", { class: "cell", href: "#", "aria-label": described(sample) }, caption(sample));
    cell.addEventListener("click", (event) => { event.preventDefault(); openSample(sample); });
    cells.push(cell);
    list.append(h("li", {}, cell));
  }
  const nothing = h("p", { class: "empty", id: "nothing" }, SAMPLES.length ? "No sample passes the filters." : "This split has no samples.",
    SAMPLES.length ? h("button", { type: "button", onclick: resetFilters }, "Reset the filters") : null);
  byId("samples").append(gridTools(), list, nothing);
  byId("samples").addEventListener("keydown", moveInGrid);
  showChannel(look.place);
  whenFiltered.push(showFiltered);
}

function best(sample) {
  return sample.surfaces.reduce((top, surface) => (!top || surface.visible > top.visible ? surface : top), null);
}

function described(sample) {
  const surface = best(sample);
  const patch = surface ? `, ${surface.name} ${percent(surface.visible)} visible at ${metres(surface.distance)}` : "";
  return `Sample ${sampleName(sample)}${patch}`;
}

function caption(sample) {
  const surface = best(sample);
  const facts = surface ? `${percent(surface.visible)} · ${metres(surface.distance)} · ${degrees(surface.incidence)}` : sample.weather;
  return h("div", { class: "caption" }, h("b", {}, sampleName(sample)),
    sample.problem ? h("span", { class: "warn" }, "incomplete") : null, h("span", { class: "sorted" }), h("span", {}, facts));
}

function gridTools() {
  const channels = h("select", { id: "channel", onchange: (event) => showChannel(Number(event.target.value)) },
    channelOptions(() => true, look.place));
  const size = h("input", { type: "range", min: 160, max: 900, step: 20, value: 300, id: "size",
    oninput: (event) => document.documentElement.style.setProperty("--cell", `${event.target.value}px`) });
  return h("div", { class: "tools", role: "group", "aria-label": "How samples are shown" },
    h("label", {}, "Show", channels), ...sortTools(), ...overlayTools(), h("label", { class: "push" }, "Size", size), h("div", { id: "channel-legend" }));
}

function sortTools() {
  if (!SORTS.length) return [];
  const groups = [...new Set(SORTS.map((sort) => sort.group))].map((group) =>
    h("optgroup", { label: group }, SORTS.filter((sort) => sort.group === group).map((sort) => h("option", { value: sort.key }, sort.label))));
  const keys = h("select", { id: "sort", onchange: (event) => { filters.sort = event.target.value; refilter(); } }, h("option", { value: "" }, "Index"), groups);
  const order = h("button", { type: "button", id: "order", onclick: () => { filters.order = filters.order ? "" : "up"; refilter(); } });
  return [h("label", {}, "Sort by", keys), order];
}

// Puts the cells in the order of the samples; nothing moves as long as the order stays.
let orderShown = null;
function showOrder() {
  const order = `${filters.sort}~${filters.order}`;
  if (order === orderShown) return;
  orderShown = order;
  if (SORTS.length) {
    byId("sort").value = filters.sort;
    byId("order").textContent = filters.sort ? (filters.order ? "Smallest first" : "Largest first") : filters.order ? "Highest first" : "Lowest first";
  }
  byId("cells").append(...sorted(SAMPLES, filters.sort, filters.order === "up").map((sample) => cells[sample.number].parentElement));
  for (const sample of SAMPLES) {
    const value = cells[sample.number].querySelector(".sorted");
    value.textContent = sortOf(filters.sort) ? sortedValue(sample, filters.sort) : "";
  }
}

// Strength and outlines are the same for the sheet and for single samples.
function overlayTools() {
  const strength = h("input", { type: "range", min: 0, max: 100, step: 5, value: 100, class: "strength", oninput: (event) => setStrength(Number(event.target.value)) });
  const lines = h("button", { type: "button", class: "outlines", "aria-pressed": "true", onclick: () => toggleOutlines() }, "Patch outline ", h("kbd", {}, "o"));
  return [h("label", {}, "Overlay", strength), SURFACE_NAMES.length ? lines : null];
}

function setStrength(value) {
  document.documentElement.style.setProperty("--strength", String(value / 100));
  document.querySelectorAll(".strength").forEach((slider) => (slider.value = value));
}

function toggleOutlines() {
  const off = document.body.classList.toggle("without-outlines");
  document.querySelectorAll(".outlines").forEach((button) => button.setAttribute("aria-pressed", String(!off)));
}

function showChannel(place) {
  if (!CHANNELS[place]) return;
  look.place = place;
  byId("channel").value = String(place);
  byId("channel-legend").replaceChildren(pictureLegend(CHANNELS[place]) ?? "");
  SAMPLES.forEach((sample, number) => {
    const old = cells[number].querySelector(".stack");
    if (old) seen.unobserve(old);
    old?.remove();
    cells[number].prepend(stack(sample, place));
  });
}

// The same picture of the next dataset, to blink between twins.
function showNextDataset() {
  const { kind, name, evaluation, dataset } = CHANNELS[look.place] ?? {};
  const turn = ABOUT.datasets.indexOf(dataset);
  const next = [...ABOUT.datasets.slice(turn + 1), ...ABOUT.datasets.slice(0, turn + 1)].map((other) => placeOf({ kind, name, evaluation, dataset: other }));
  showChannel(next.find((place) => place >= 0) ?? look.place);
}

function showFiltered() {
  showOrder();
  const in_ = new Set(shown);
  SAMPLES.forEach((sample, number) => (cells[number].parentElement.hidden = !in_.has(sample)));
  byId("nothing").hidden = shown.length > 0;
}

function moveInGrid(event) {
  if (view !== "samples") return;
  const here = shown.findIndex((sample) => cells[sample.number] === document.activeElement);
  if (here < 0) return;
  const tops = shown.map((sample) => cells[sample.number].parentElement.offsetTop);
  const wide = Math.max(1, tops.filter((top) => top === tops[0]).length);
  const steps = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -wide, ArrowDown: wide, Home: -shown.length, End: shown.length };
  if (!(event.key in steps)) return;
  event.preventDefault();
  focusCell(shown[Math.min(shown.length - 1, Math.max(0, here + steps[event.key]))]);
}

function focusCell(sample) {
  if (!sample) return;
  cells[sample.number].focus();
  cells[sample.number].scrollIntoView({ block: "nearest" });
}
