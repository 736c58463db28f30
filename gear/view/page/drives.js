// The list of situations, and the player of one of them. Text of results always goes in as text nodes.
const INDEX = JSON.parse(byId("index").textContent);
const TWINS = ["none", "random", "patch"];
const situations = byTwins(INDEX.drives);
let current = null; // the situation that is shown
let playing = null;

function byTwins(drives) {
  const groups = new Map();
  drives.forEach((drive, number) => {
    const key = JSON.stringify([drive.study, drive.driver, drive.town, drive.place, drive.scenario, drive.speed_kmh, drive.seed]);
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push({ ...drive, number });
  });
  const order = (twin) => (TWINS.indexOf(twin) + TWINS.length + 1) % (TWINS.length + 1);
  const found = [...groups.values()];
  for (const group of found) {
    group.sort((a, b) => order(a.twin) - order(b.twin));
    group.forEach((drive, place) => (drive.colour = colourOf(drive.twin, place)));
  }
  return found;
}

const titleOf = ([drive]) =>
  `${INDEX.studies.length > 1 ? `${INDEX.studies[drive.study]}: ` : ""}${drive.driver}: ${drive.scenario} at ${rounded(drive.speed_kmh, 1)} km/h, ${drive.place}, seed ${drive.seed}`;

function outcomeLine(drive) {
  return h("span", { class: `outcome${drive.measures.is_crash ? " crash" : ""}` }, h("b", { class: TWINS.includes(drive.twin) ? `twin-${drive.twin}` : null }, drive.twin), drive.outcome);
}

function showList() {
  const driver = byId("driver").value;
  const isDifferent = byId("different").checked;
  const shown = situations.filter((group) => (!driver || group[0].driver === driver) && (!isDifferent || new Set(group.map((one) => one.measures.is_crash)).size > 1));
  byId("situations").replaceChildren(...shown.map((group) =>
    h("a", { href: `#/situation/${situations.indexOf(group)}`, "aria-current": group === current?.group ? "true" : "false" }, titleOf(group), group.map(outcomeLine))));
  if (!shown.length) byId("situations").append(h("p", { class: "empty" }, "No such drives."));
  byId("count").textContent = `${counted(shown.length, "situation")}, ${counted(shown.flat().length, "drive")}`;
}

async function motionOf(drive) {
  const bytes = Uint8Array.from(atob(byId(`d${drive.number}`).textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return JSON.parse(await new Response(stream).text());
}

async function showSituation(group) {
  pause();
  const drives = await Promise.all(group.map(async (drive) => ({ ...drive, motion: await motionOf(drive), film: (byId(`f${drive.number}`)?.textContent ?? "").split("\n").filter(Boolean) })));
  const driven = drives.filter((drive) => drive.motion);
  const frames = Math.max(1, ...driven.map((drive) => drive.motion.time_s.length));
  const slider = h("input", { type: "range", min: 0, max: frames - 1, value: 0, id: "frame", "aria-label": "Time of the drive", oninput: () => show(Number(slider.value)) });
  const time = h("output", { for: "frame", class: "number" });
  const button = h("button", { type: "button", id: "play", onclick: () => (playing ? pause() : play()) }, "Play");
  const figures = drives.map((drive) => h("figure", {},
    drive.film.length ? h("img", { alt: `${drive.twin}: what the camera sees` }) : h("p", { class: "empty" }, "no video of this drive"),
    h("figcaption", {}, outcomeLine(drive), h("span", { class: "now dim number" }), drive.problem ? h("p", { class: "problem" }, drive.problem) : null)));
  const map = h("canvas", { role: "img", "aria-label": "Map from above with the ways of the twins" });
  const curves = CURVES.map((curve) => h("canvas", { role: "img", "aria-label": curve.title, onclick: (event) => show(frameAt(event.target, event.offsetX, frames)) }));
  const key = h("div", { class: "key" }, driven.map((drive) => h("span", { class: TWINS.includes(drive.twin) ? `twin-${drive.twin}` : null }, `■ ${drive.twin}`)),
    h("span", { class: "dim" }, "yellow: the road user of the scenario; grey: others; red cross: crash"));
  byId("situation").replaceChildren(h("h2", {}, titleOf(group)), h("div", { class: "films" }, figures), h("div", { class: "player" }, button, slider, time), key,
    h("div", { class: "views" }, h("div", { class: "map" }, map), h("div", { class: "curves" }, curves)), measuresOf(drives));
  byId("situation").hidden = false;
  current = { group, drives, driven, frames, slider, time, button, figures, map, curves, frame: 0 };
  showList();
  show(0);
}

function show(frame) {
  if (!current) return;
  const { drives, driven, frames, slider, time, figures, map, curves } = current;
  current.frame = Math.min(Math.max(0, frame), frames - 1);
  slider.value = current.frame;
  time.textContent = `${(current.frame / 10).toFixed(1)} s of ${((frames - 1) / 10).toFixed(1)} s`;
  drives.forEach((drive, place) => {
    const picture = figures[place].querySelector("img");
    const isAtEnd = drive.motion && current.frame >= drive.motion.time_s.length - 1;
    if (picture) {
      const shown = isAtEnd ? drive.film.length - 1 : Math.min(drive.film.length - 1, Math.floor(current.frame / INDEX.step));
      picture.src = `data:${INDEX.mediaType};base64,${drive.film[shown]}`;
    }
    figures[place].classList.toggle("crashed", Boolean(isAtEnd && drive.measures.is_crash));
    if (drive.motion) figures[place].querySelector(".now").textContent = nowLine(drive.motion, current.frame);
  });
  if (!driven.length) return;
  drawMap(map, driven, INDEX.streets[driven[0].town] ?? [], current.frame);
  curves.forEach((canvas, place) => drawCurve(canvas, CURVES[place], driven, current.frame));
}

function nowLine(motion, frame) {
  const gap = at(motion.gap_m, frame);
  return `${at(motion.time_s, frame).toFixed(1)} s, ${at(motion.speed_kmh, frame).toFixed(0)} km/h, ${at(motion.acceleration_mps2, frame).toFixed(1)} m/s²${isNumber(gap) ? `, ${gap.toFixed(1)} m free` : ""}${at(motion.is_emergency, frame) ? ", emergency braking" : ""}`;
}

const MEASURES = [
  ["Duration", "duration_s", 1, "s"], ["Impact speed", "impact_mps", 3.6, "km/h"], ["Least distance", "least_distance_m", 1, "m"], ["Least time to collision", "least_ttc_s", 1, "s"],
  ["First braking after", "braking_s", 1, "s"], ["Phantom brakings", "phantom_brakings", 1, ""], ["Largest distance from the lane's centre", "lateral_peak_m", 1, "m"], ["Jerk (RMS)", "jerk_rms_mps3", 1, "m/s³"], ["Driving score", "score", 1, ""],
];

function measuresOf(drives) {
  const value = (drive, [, key, factor, unit]) => (isNumber(drive.measures[key]) ? `${rounded(drive.measures[key] * factor, 2)} ${unit}` : "–");
  return h("table", { class: "measures" }, h("thead", {}, h("tr", {}, h("th", {}, "Measure"), drives.map((drive) => h("th", {}, drive.twin)))),
    h("tbody", {}, MEASURES.map((row) => h("tr", {}, h("th", { scope: "row" }, row[0]), drives.map((drive) => h("td", {}, value(drive, row)))))));
}

function play() {
  if (current.frame >= current.frames - 1) show(0);
  current.button.textContent = "Pause";
  playing = setInterval(() => {
    show(current.frame + 1);
    if (current.frame >= current.frames - 1) pause();
  }, 100);
}

function pause() {
  clearInterval(playing);
  playing = null;
  if (current) current.button.textContent = "Play";
}

function follow() {
  const number = Number(/^#\/situation\/(\d+)$/.exec(location.hash)?.[1] ?? 0);
  const group = situations[number] ?? situations[0];
  if (group && group !== current?.group) showSituation(group);
}

byId("name").textContent = INDEX.studies.join(", ");
byId("about").textContent = `Drives in the closed loop, 10 frames per second${INDEX.step > 1 ? `; the page shows one picture of ${INDEX.step} frames` : ""}`;
byId("driver").append(h("option", { value: "" }, "all drivers"), ...[...new Set(INDEX.drives.map((drive) => drive.driver))].map((name) => h("option", { value: name }, name)));
byId("driver").addEventListener("change", showList);
byId("different").addEventListener("change", showList);
byId("problems").append(...INDEX.problems.map((text) => h("p", { class: "problem" }, text)));
addEventListener("hashchange", follow);
addEventListener("resize", () => current && show(current.frame));
addEventListener("keydown", (event) => {
  if (!current || event.target.matches("input, select, button")) return;
  const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (step) show(current.frame + step);
  else if (event.key === " ") (playing ? pause() : play());
  else return;
  event.preventDefault();
});
showList();
addEventListener("DOMContentLoaded", follow);
