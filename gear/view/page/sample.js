// One sample: its channels side by side, where everything stands, and all that is known of it.
let current = null;
let samplePlan = null;

function showSample(sample) {
  current = sample;
  const section = byId("sample");
  const place = shown.indexOf(sample);
  const step = (by) => h("button", { type: "button", id: by < 0 ? "previous" : "next", disabled: !neighbour(by), onclick: () => goBy(by) }, by < 0 ? "← Previous" : "Next →");
  const first = h("div", { class: "columns" });
  const wide = h("div", { class: "wide-cards" });
  const rest = h("div", { class: "columns" });
  const channels = h("div", { class: "channels" }, CHANNELS.map((_, i) => (pictureOf(sample, i) ? figure(sample, i) : null)));
  section.querySelectorAll(".stack").forEach((box) => seen.unobserve(box));
  section.replaceChildren(
    h("div", { class: "title" }, h("h2", { id: "sample-title" }, `Sample ${sampleName(sample)}`),
      h("span", { class: "dim" }, `sequence ${sample.sequence}, frame ${sample.frame}, ${rounded(sample.time_s, 2)} s · ${sample.weather}${place < 0 ? " · outside the filters" : ` · ${grouped(place + 1)} of ${grouped(shown.length)}`}`),
      h("div", { class: "tools push" }, ...overlayTools()),
      h("div", { class: "push" }, step(-1), step(1), h("button", { type: "button", onclick: closeSample }, "Close ", h("kbd", {}, "Esc")))),
    sample.problem ? h("p", { class: "problem", role: "alert" }, sample.problem) : "",
    compareCard(sample) ?? "", channels, first, wide, rest);
  samplePlan ??= new Plan("Map of the sample from above");
  first.append(card("Map", "seen from above; the wedge is what a camera sees, symbols are not to scale", samplePlan.node, legend(() => samplePlan.draw())));
  if (SURFACE_NAMES.length) first.append(surfaceCard(sample));
  samplePlan.show([sample], true);
  wide.append(...[objectsCard(sample), metricsCard(sample)].filter(Boolean));
  details(sample).then(({ record, facts: own, files }) => {
    if (current !== sample || !rest.isConnected) return;
    first.append(sceneCard(record));
    wide.append(...factTables(own), actorCard(record));
    rest.append(...factCards(own), ...recordCards(record, files), raw("Scene record as JSON", record), raw("Facts of the task as JSON", own));
  });
}

function figure(sample, place) {
  const picture = pictureOf(sample, place);
  const button = h("button", { type: "button", "aria-pressed": "false", onclick: () => {
    const isWide = node.classList.toggle("wide");
    button.setAttribute("aria-pressed", String(isWide));
  } }, "Enlarge");
  const node = h("figure", { class: "card" }, stack(sample, place, { large: true }),
    h("figcaption", {}, h("b", {}, channelLabel(CHANNELS[place])), h("span", { class: "dim" }, `${picture.width} × ${picture.height}${picture.whole || picture.original ? "" : ", smaller here"}`), button), pictureLegend(CHANNELS[place]));
  return node;
}

function surfaceCard(sample) {
  const headers = ["surface", "camera", "visible", "occluded", "truncated", "distance", "incidence", "pixels"];
  const rows = sample.surfaces.map((s) => [s.name, s.camera, percent(s.visible), percent(s.occluded), percent(s.truncated), metres(s.distance), degrees(s.incidence), s.pixels]);
  return card("Patch surfaces", `patch ${ABOUT.patch}`, rows.length ? table("Patch surfaces", headers, rows) : h("p", { class: "dim" }, "none"));
}

const heading = ([w, x, y, z]) => (Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) * 180) / Math.PI;

function actorCard(record) {
  const ego = record.actors.find((actor) => actor.role === "ego") ?? record.actors[0];
  const away = (actor) => Math.hypot(...actor.world_from_actor.position_m.map((v, i) => v - ego.world_from_actor.position_m[i]));
  const rows = record.actors.map((actor) => [
    actor.id, actor.role, actor.asset, ...actor.world_from_actor.position_m.map((v) => Number(v.toFixed(2))), Math.round(heading(actor.world_from_actor.quat_wxyz)),
    Number(Math.hypot(...actor.velocity_world_mps).toFixed(2)), Number(away(actor).toFixed(1)),
  ]);
  return card("Actors", `${rows.length}`, table("Actors", ["id", "role", "asset", "x m", "y m", "z m", "heading °", "speed m/s", "from ego m"], rows));
}

function sceneCard(record) {
  return card("Scene", null, facts("Scene", Object.entries(record).filter(([, value]) => !(value instanceof Object))));
}

function recordCards(record, files) {
  const rows = files.map(([path, digest, link]) =>
    h("tr", {}, h("td", {}, link ? h("a", { href: link, rel: "noreferrer" }, path) : path), h("td", { class: "dim digest", title: digest }, digest.slice(0, 12))));
  return [
    card("Weather", null, facts("Weather", Object.entries(record.weather))),
    ...record.cameras.map((camera) => card(`Camera ${camera.name}`, null, facts(`Camera ${camera.name}`, flattened(camera)))),
    ...record.surfaces.map((surface) => card(`Surface ${surface.name}`, null, facts(`Surface ${surface.name}`, flattened(surface)))),
    card("Files", "of the dataset", h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Files" }, h("table", {}, h("tbody", {}, rows)))),
  ];
}

function neighbour(by) {
  const here = shown.indexOf(current);
  if (here >= 0) return shown[here + by];
  // A sample that the filters leave out still has neighbours: the nearest shown ones on either side.
  return by > 0 ? shown.find((s) => s.number > current.number) : shown.findLast((s) => s.number < current.number);
}

function goBy(by) {
  const next = neighbour(by);
  if (next) openSample(next);
}
