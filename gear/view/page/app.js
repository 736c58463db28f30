// Which view is open, the address that leads back to it, and the keys.
const VIEWS = ["samples", "sample", "map", "statistics"];
const KEYS = [
  ["← → ↑ ↓", "move over the samples; on a sample: previous, next"],
  ["Enter", "open the sample"],
  ["Esc", "close the sample, the filters or this list"],
  ["1 … 9", "show a picture or preview on the sheet"],
  ["o", "patch outlines on or off"],
  ["[  ]", "overlay weaker, stronger"],
  ["f", "filters"],
  ["s  m  h", "samples, map, histograms"],
  ...(OTHER_DATASETS.length ? [["t", "on the sheet, the same picture of the next dataset"]] : []),
  ...(IS_COMPARED ? [["c", "on a sample, compare by slider, side by side, by difference"]] : []),
  ["?", "this list"],
];
let view = "samples";
let splitPlan = null;
let routed = null;
let scrolled = 0; // of the sheet, while something else is shown

function address(name, sample) {
  const params = filtersToParams();
  return `#/${name}${sample ? `/${sample.index}` : ""}${params ? `?${params}` : ""}`;
}

function go(name, sample = null) {
  location.hash = address(name, sample);
  route(); // at once, not when the browser says so: the next key may come before that
}

const openSample = (sample) => go("sample", sample);

function closeSample() {
  const left = current;
  go("samples");
  requestAnimationFrame(() => focusCell(shown.includes(left) ? left : shown[0]));
}

function route() {
  routed = location.hash;
  const [path, query] = location.hash.slice(1).split("?");
  const [, name, index] = path.split("/");
  const sample = SAMPLES.find((one) => String(one.index) === index);
  view = name === "sample" && !sample ? "samples" : VIEWS.includes(name) ? name : "samples";
  if (view === "sample") current = sample;
  const params = new URLSearchParams(query ?? "");
  if (params.toString() !== filtersToParams()) {
    filtersFromParams(params);
    buildFilters();
    refilter();
  }
  const isNew = byId(view).hidden;
  if (!byId("samples").hidden) scrolled = byId("main").scrollTop;
  for (const one of VIEWS) byId(one).hidden = one !== view;
  for (const one of ["samples", "map", "statistics"]) {
    const tab = byId(`tab-${one}`);
    if (one === view || (one === "samples" && view === "sample")) tab.setAttribute("aria-current", "page");
    else tab.removeAttribute("aria-current");
    tab.setAttribute("href", address(one));
  }
  document.title = view === "sample" ? `${sampleName(sample)} · ${ABOUT.task}` : `${ABOUT.task} · ${ABOUT.scene} · ${ABOUT.split}`;
  if (isNew && view !== "samples") byId("main").focus({ preventScroll: true });
  if (view === "sample") {
    showSample(sample);
    byId("main").scrollTop = 0;
  }
  if (view === "samples" && isNew) byId("main").scrollTop = scrolled;
  if (view === "map") showMap();
  if (view === "statistics") showStatistics();
}

function showMap() {
  if (!splitPlan) {
    splitPlan = new Plan("Map of all shown samples from above; every ego car opens its sample");
    byId("map").append(h("div", { class: "card" }, legend(() => splitPlan.draw()), splitPlan.node));
  }
  splitPlan.show(shown, false);
}

function keepUp() {
  const hash = address(view, view === "sample" ? current : null);
  if (location.hash !== hash) history.replaceState(null, "", hash);
  for (const one of ["samples", "map", "statistics"]) byId(`tab-${one}`).setAttribute("href", address(one));
  if (view === "sample") showSample(current);
  if (view === "map" && splitPlan) splitPlan.show(shown, false);
  if (view === "statistics") showStatistics();
}

function toggleHelp() {
  if (byId("help").open) byId("help").close();
  else byId("help").showModal();
}

function press(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
  const isTyping = event.target.matches("input[type=search], select, textarea");
  if (event.key === "Escape") return void escape(event);
  if (isTyping || byId("help").open) return void (event.key === "?" && !isTyping && toggleHelp());
  const isSlider = event.target.matches("input[type=range]");
  const strength = Number(document.querySelector(".strength").value);
  const acts = {
    f: () => toggleFilters(), "?": toggleHelp, s: () => go("samples"), m: () => go("map"), h: () => go("statistics"), o: toggleOutlines,
    "[": () => setStrength(Math.max(0, strength - 10)), "]": () => setStrength(Math.min(100, strength + 10)),
  };
  if (view === "sample" && !isSlider) Object.assign(acts, { ArrowLeft: () => goBy(-1), ArrowRight: () => goBy(1) });
  if (view === "samples" && !isSlider && ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"].includes(event.key)) acts[event.key] = () => focusCell(shown[0]);
  if (view === "samples" && OTHER_DATASETS.length) acts.t = showNextDataset;
  if (view === "sample" && IS_COMPARED) acts.c = cycleCompareMode;
  if (view === "samples" && /^[1-9]$/.test(event.key)) acts[event.key] = () => showChannel(Number(event.key) - 1);
  if (!(event.key in acts)) return;
  event.preventDefault();
  acts[event.key]();
}

function escape(event) {
  if (byId("help").open) return; // the dialog closes itself
  if (byId("filters").contains(event.target)) {
    toggleFilters(false);
    byId("filters-button").focus();
  } else if (view === "sample") closeSample();
  else if (view !== "samples") go("samples");
  else if (!byId("filters").hidden) toggleFilters(false);
}

function start() {
  byId("name").textContent = `${ABOUT.task} · ${ABOUT.scene}`;
  byId("about").textContent = `${ABOUT.town}, split ${ABOUT.split}, seed ${ABOUT.seed}, patch ${ABOUT.patch}${OTHER_DATASETS.length ? `, compared with ${OTHER_DATASETS.join(", ")}` : ""}${SAMPLES.length < ABOUT.total ? `, first ${SAMPLES.length} of ${ABOUT.total} samples` : ""}${ABOUT.scale < 1 ? `, pictures at ${percent(ABOUT.scale)} of their width` : ""}`;
  byId("help").append(h("h2", { id: "help-title" }, "Keys"), h("dl", {}, KEYS.flatMap(([keys, what]) => [h("dt", {}, h("kbd", {}, keys)), h("dd", {}, what)])),
    h("button", { type: "button", onclick: toggleHelp }, "Close"));
  byId("filters-button").addEventListener("click", () => toggleFilters());
  byId("help-button").addEventListener("click", toggleHelp);
  buildFilters();
  buildGrid();
  addEventListener("hashchange", () => { if (location.hash !== routed) route(); });
  document.addEventListener("keydown", press);
  refilter();
  route();
  whenFiltered.push(keepUp);
}

start();
