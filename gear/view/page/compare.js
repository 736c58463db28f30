// Two pictures of one sample: a slider between them, side by side, or their difference. And what changed in the predictions.
const IS_COMPARED = ABOUT.datasets.length > 1 || ABOUT.evaluations.length > 0;
const MODES = [["slider", "Slider"], ["side", "Side by side"], ["difference", "Difference"]];
const compared = { pair: null, mode: "slider", at: 50, gain: 4 };
const CHANGES = ["hidden", "misclassified", "moved", "invented"];

const placeOf = (wanted) => CHANNELS.findIndex((channel) => Object.entries(wanted).every(([key, value]) => channel[key] === value));

// The camera of the first two datasets; with one dataset, the ground truth and its prediction, or the defended picture.
function usualPair() {
  const image = CHANNELS.findIndex((channel) => channel.kind === "image");
  if (image < 0) return null;
  const partner = (wanted) => placeOf({ name: CHANNELS[image].name, ...wanted });
  const prediction = CHANNELS.findIndex((channel) => channel.kind === "prediction");
  const truth = prediction < 0 ? -1 : placeOf({ kind: "preview", name: CHANNELS[prediction].name });
  const pairs = [[image, partner({ kind: "image", dataset: ABOUT.datasets[1] })], [truth, prediction], [image, partner({ kind: "defended" })], [image, prediction]];
  return pairs.find((pair) => pair.every((place) => place >= 0)) ?? null;
}

function compareCard(sample) {
  compared.pair ??= usualPair();
  if (!IS_COMPARED || !compared.pair) return null;
  const holder = h("div", { class: "pair-holder" });
  const range = h("input", { type: "range", id: "compare-at", min: 0, max: 100, step: 0.5 });
  const label = h("label", { class: "dim" });
  const chooser = (side, name) => h("select", { id: `compare-${name}`, "aria-label": `${name} picture`, onchange: (event) => { compared.pair[side] = Number(event.target.value); draw(); } },
    channelOptions((place) => pictureOf(sample, place), compared.pair[side]));
  const modes = MODES.map(([mode, text]) => h("button", { type: "button", "data-mode": mode, onclick: () => { compared.mode = mode; draw(); } }, text));
  let box = null;

  function move() {
    if (compared.mode === "slider") box.style.setProperty("--at", `${compared.at}%`);
    else box.style.setProperty("--gain", String(compared.gain));
  }

  function drag(event) {
    if (compared.mode !== "slider" || (event.type === "pointermove" && !event.buttons)) return;
    if (event.type === "pointerdown") box.setPointerCapture(event.pointerId);
    const { left, width } = box.getBoundingClientRect();
    compared.at = Math.min(100, Math.max(0, (100 * (event.clientX - left)) / width));
    range.value = String(compared.at);
    move();
  }

  function overlaid() {
    const [left, right] = compared.pair;
    const picture = pictureOf(sample, left);
    const isDifference = compared.mode === "difference";
    box = h("div", { class: `stack pair ${compared.mode}`, onpointerdown: drag, onpointermove: drag }, image(sample, left, "left", true, isDifference), image(sample, right, "right", true, isDifference));
    if (compared.mode === "slider") box.append(h("i", { class: "divider" }), h("span", { class: "tag" }, channelLabel(CHANNELS[left])), h("span", { class: "tag end" }, channelLabel(CHANNELS[right])));
    box.style.aspectRatio = `${picture.width} / ${picture.height}`;
    box.addEventListener("near", () => box.querySelectorAll("img").forEach((img) => img.show(true)));
    seen.observe(box);
    move();
    return box;
  }

  function draw() {
    holder.querySelectorAll(".stack").forEach((old) => seen.unobserve(old));
    const isWhole = compared.pair.every((place) => pictureOf(sample, place));
    const isSide = compared.mode === "side";
    modes.forEach((button) => button.setAttribute("aria-pressed", String(button.dataset.mode === compared.mode)));
    label.hidden = isSide || !isWhole;
    const isDifference = compared.mode === "difference";
    label.firstChild?.remove();
    label.prepend(isDifference ? "Brighter by" : "Right picture from");
    Object.assign(range, isDifference ? { min: 1, max: 32, value: compared.gain } : { min: 0, max: 100, value: compared.at });
    if (!isWhole) holder.replaceChildren(h("p", { class: "empty" }, "One of these pictures is missing in this sample."));
    else if (isSide) holder.replaceChildren(h("div", { class: "channels two" }, compared.pair.map((place) => figure(sample, place))));
    else holder.replaceChildren(overlaid());
  }

  range.addEventListener("input", () => { compared[compared.mode === "difference" ? "gain" : "at"] = Number(range.value); move(); });
  label.append("", range);
  draw();
  return h("section", { class: "card", id: "compare" },
    h("div", { class: "head" }, h("h2", {}, "Compare"), chooser(0, "left"), chooser(1, "right"), h("div", { class: "modes", role: "group", "aria-label": "How the pictures are compared" }, modes), label), holder);
}

function cycleCompareMode() {
  const here = MODES.findIndex(([mode]) => mode === compared.mode);
  compared.mode = MODES[(here + 1) % MODES.length][0];
  const old = byId("compare");
  if (old) old.replaceWith(compareCard(current));
}

function objectsCard(sample) {
  const found = sample.compared.objects;
  if (!found.length) return null;
  const headers = ["change", "object", "detected as", "score", "on the patch", "in", "against", "evaluation"];
  const rows = found.map((one) => [one.change, one.label, one.detected_as ?? "–", one.score, one.on_patch ? "yes" : "no", one.dataset, one.against, one.evaluation]);
  return card("What the patch did to objects", `${found.length}; hidden, misclassified and moved objects are found in the other dataset`, table("Changed objects", headers, rows),
    h("div", { class: "legend" }, CHANGES.map((change) => h("span", {}, h("i", { class: `swatch-${change}` }), change))));
}

function metricsCard(sample) {
  const rows = Object.entries(sample.compared.metrics).flatMap(([evaluation, datasets]) => {
    const names = [...new Set(Object.values(datasets).flatMap(Object.keys))];
    return names.map((name) => [evaluation, name, ...ABOUT.datasets.map((dataset) => datasets[dataset]?.[name] ?? null)]);
  });
  if (!rows.length) return null;
  return card("Metrics of the predictions", "of this sample alone", table("Metrics of the predictions", ["evaluation", "metric", ...ABOUT.datasets.map((name) => name || "value")], rows));
}

// Boxes of the changes that one dataset of the page shows, over its pictures of the camera that detectors look through.
function changeBoxes(sample, place) {
  const channel = CHANNELS[place];
  const picture = pictureOf(sample, place);
  if (picture.camera !== sample.cameras[0]?.name || !["image", "prediction"].includes(channel.kind)) return [];
  return sample.compared.objects
    .filter((one) => one.dataset === channel.dataset && (!channel.evaluation || one.evaluation === channel.evaluation))
    .map(({ change, label, box: [left, top, right, bottom] }) =>
      svg("rect", { class: `change ${change}`, x: left - 0.5, y: top - 0.5, width: Math.max(1, right - left), height: Math.max(1, bottom - top) }, svg("title", {}, `${change}: ${label}`)));
}
