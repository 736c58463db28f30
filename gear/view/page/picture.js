// A picture with what can be laid over it: a preview at the chosen strength over its camera's picture, and outlines.
const seen = new IntersectionObserver(
  (entries) => {
    for (const entry of entries) entry.target.dispatchEvent(new CustomEvent(entry.isIntersecting ? "near" : "far"));
  },
  { root: byId("main"), rootMargin: "700px 0px" },
);

const isPreview = (place) => CHANNELS[place].kind !== "image";
const pictureOf = (sample, place) => sample.pictures[place];

function baseOf(sample, place) {
  const camera = pictureOf(sample, place)?.camera;
  if (!isPreview(place) || !camera) return null;
  const base = CHANNELS.findIndex((channel) => channel.kind === "image" && channel.name === camera && channel.dataset === CHANNELS[place].dataset);
  return base >= 0 && pictureOf(sample, base) ? base : null;
}

function outlines(sample, place, withNames) {
  const picture = pictureOf(sample, place);
  const changes = changeBoxes(sample, place);
  const faces = sample.surfaces.filter((surface) => surface.camera === picture.camera && surface.corners);
  if (!faces.length && !changes.length) return null;
  // Corners and boxes are in pixels of the camera; a defended picture may be stored with fewer.
  const { width, height } = sample.cameras.find((camera) => camera.name === picture.camera) ?? picture;
  const size = width / 48;
  // Corners are index pixels: the picture spans half a pixel more on every side.
  return svg("svg", { viewBox: `-0.5 -0.5 ${width} ${height}`, preserveAspectRatio: "none", "aria-hidden": "true" },
    changes,
    faces.map((face) => [
      svg("polygon", { points: face.corners.map((corner) => corner.join(",")).join(" ") }, svg("title", {}, face.name)),
      withNames
        ? svg("text", { x: Math.min(...face.corners.map((c) => c[0])), y: Math.min(...face.corners.map((c) => c[1])) - size / 3, "font-size": size }, `${face.name}  ${percent(face.visible)}`)
        : null,
    ]));
}

function stack(sample, place, { large = false } = {}) {
  const picture = pictureOf(sample, place);
  const box = h("div", { class: "stack" });
  if (!picture) {
    box.style.aspectRatio = "2.5";
    box.append(h("span", { class: "none" }, "no picture"));
    return box;
  }
  box.style.aspectRatio = `${picture.width} / ${picture.height}`;
  const base = baseOf(sample, place);
  const layers = base === null ? [[place, ""]] : [[base, ""], [place, "over"]];
  box.append(...layers.map(([layer, css]) => image(sample, layer, css, layer === place)));
  const lines = outlines(sample, place, large);
  if (lines) box.append(lines);
  box.addEventListener("near", () => box.querySelectorAll("img").forEach((img) => img.show(large)));
  box.addEventListener("far", () => box.querySelectorAll("img").forEach((img) => img.removeAttribute("src")));
  seen.observe(box);
  return box;
}

// `isExact` loads the dataset's file also at full size, because the page's picture has losses.
function image(sample, place, css, isNamed, isExact = false) {
  const picture = pictureOf(sample, place);
  const img = h("img", { class: css, decoding: "async", draggable: "false", alt: isNamed ? `${channelLabel(CHANNELS[place])}, sample ${sampleName(sample)}` : "" });
  img.show = (large) => {
    withPicture(sample, place, (url) => { if (!img.src) img.src = url; });
    if (!large || !picture.original || (picture.whole && !isExact)) return;
    const file = new Image();
    file.onload = () => { img.src = file.src; };
    file.src = picture.original;
  };
  return img;
}
