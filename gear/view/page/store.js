// What the page carries: the index, read at once, and blocks of pictures and records, read when they are looked at.
const DATA = JSON.parse(byId("index").textContent);
const { about: ABOUT, channels: CHANNELS, samples: SAMPLES } = DATA;
SAMPLES.forEach((sample, number) => (sample.number = number));

const ROLES = [
  { key: "ego", label: "Ego", colour: "#7cc0ff" },
  { key: "npc", label: "Traffic", colour: "#d9dee5" },
  { key: "parked", label: "Parked", colour: "#8793a1" },
  { key: "carrier", label: "Carrier of a patch", colour: "#ff6ae0" },
  { key: "pedestrian", label: "Pedestrians", colour: "#ffb86b" },
];
const PATCH_COLOUR = "#ff6ae0";

const KINDS = [
  { key: "image", label: "Camera", group: "Pictures" },
  { key: "preview", label: "Preview", group: "Previews" },
  { key: "prediction", label: "Prediction", group: "Predictions" },
  { key: "defended", label: "Defended", group: "Defended pictures" },
];
const kindLabel = (channel) => KINDS.find((kind) => kind.key === channel.kind).label;
const channelLabel = (channel) => [`${kindLabel(channel)} ${channel.name}`, channel.dataset, channel.evaluation].filter(Boolean).join(" · ");

function channelOptions(isOffered, chosen) {
  return KINDS.map(({ key, group }) => {
    const options = CHANNELS.map((channel, place) => (channel.kind === key && isOffered(place) ? h("option", { value: place, selected: place === chosen }, channelLabel(channel)) : null)).filter(Boolean);
    return options.length ? h("optgroup", { label: group }, options) : null;
  });
}

// Pictures come after the script, so that a large page shows itself before all of it is read. A block is whole once
// something follows it.
let waiting = [];
const isWhole = (block) => block && (document.readyState !== "loading" || block.nextElementSibling);

function whenThere(id, use) {
  const block = byId(id);
  if (isWhole(block)) use(block.textContent);
  else if (document.readyState === "loading") waiting.push([id, use]);
}

const poll = setInterval(() => {
  const now = waiting;
  waiting = [];
  for (const [id, use] of now) whenThere(id, use);
  if (document.readyState !== "loading" && !waiting.length) clearInterval(poll);
}, 60);

function withPicture(sample, place, use) {
  whenThere(`p${sample.number}.${place}`, (text) => use(`data:${DATA.mediaType};base64,${text}`));
}

function details(sample) {
  return new Promise((resolve) => whenThere(`d${sample.number}`, resolve)).then((text) => {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).json();
  });
}
