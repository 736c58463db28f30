// The map of a situation from above: ways of the twins, road users at the time of the frame. East is right, north is up.
const COLOURS = { none: "#57c785", random: "#b9c2cc", patch: "#ff6ae0" };
const OTHERS = ["#7cc0ff", "#ffb86b", "#ffe14d"];
const STREET_COLOURS = { sidewalk: "#1d242d", lane: "#2c3540", crosswalk: "#4a5563" };
const CAR_M = [4.5, 1.9];
const colourOf = (twin, place) => COLOURS[twin] ?? OTHERS[place % OTHERS.length];
const at = (list, frame) => list[Math.min(frame, list.length - 1)];

// A canvas whose pixels are those of the screen; the pen's unit is a CSS pixel.
function penOf(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.max(1, width * ratio);
  canvas.height = Math.max(1, height * ratio);
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  return { pen, width, height };
}

function drawMap(canvas, drives, streets, frame) {
  const { pen, width, height } = penOf(canvas);
  const points = drives.flatMap((drive) => drive.motion.ego.concat(scriptedWay(drive.motion)));
  if (!points.length || !width) return;
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const [x, y] of points) [x0, x1, y0, y1] = [Math.min(x0, x), Math.max(x1, x), Math.min(y0, y), Math.max(y1, y)];
  const scale = Math.min(width / (x1 - x0 + 16), height / (y1 - y0 + 16), 30);
  const toPixels = ([x, y]) => [width / 2 + (x - (x0 + x1) / 2) * scale, height / 2 - (y - (y0 + y1) / 2) * scale];
  for (const [kind, colour] of Object.entries(STREET_COLOURS)) {
    for (const [what, wide, line] of streets) {
      if (what !== kind) continue;
      const way = [];
      for (let i = 0; i < line.length; i += 2) way.push([line[i], line[i + 1]]);
      drawWay(pen, way.map(toPixels), colour, wide * scale);
    }
  }
  for (const drive of drives) drawWay(pen, scriptedWay(drive.motion).map(toPixels), "#ffcc66", 1.5, [4, 4]);
  drives.forEach((drive, place) => drawWay(pen, drive.motion.ego.map(toPixels), drive.colour, 5 - 1.5 * Math.min(place, 2)));
  const last = drives[drives.length - 1];
  for (const [id, x, y, yaw] of at(last.motion.actors, frame)) {
    if (id === last.motion.scripted && !last.motion.is_walker) drawCar(pen, toPixels([x, y]), yaw, scale, "#ffcc66");
    else drawDot(pen, toPixels([x, y]), scale, id === last.motion.scripted ? "#ffcc66" : "#8793a1");
  }
  for (const drive of drives) {
    const [x, y, yaw] = at(drive.motion.ego, frame);
    const place = toPixels([x, y]);
    drawCar(pen, place, yaw, scale, drive.colour);
    if (drive.measures.is_crash && frame >= drive.motion.ego.length - 1) drawCross(pen, place);
  }
  const step = [1, 2, 5, 10, 20, 50, 100, 200].find((metres) => metres * scale >= 50) ?? 500;
  pen.fillStyle = pen.strokeStyle = "#a3afbd";
  pen.lineWidth = 1;
  pen.font = "12px system-ui, sans-serif";
  pen.strokeRect(12, height - 12, step * scale, 0.5);
  pen.fillText(`${step} m`, 14, height - 17);
}

function scriptedWay({ actors, scripted }) {
  return scripted === null ? [] : actors.flatMap((frame) => frame.filter(([id]) => id === scripted).map(([, x, y]) => [x, y]));
}

function drawWay(pen, pixels, colour, wide, dash = []) {
  pen.strokeStyle = colour;
  pen.lineWidth = wide;
  pen.setLineDash(dash);
  pen.beginPath();
  for (const pixel of pixels) pen.lineTo(...pixel);
  pen.stroke();
  pen.setLineDash([]);
}

function drawCar(pen, [px, py], yaw, scale, colour) {
  const [long, wide] = CAR_M.map((metres) => Math.max(metres * scale, 5));
  pen.save();
  pen.translate(px, py);
  pen.rotate(-yaw);
  pen.fillStyle = colour;
  pen.strokeStyle = "#0a0d11";
  pen.lineWidth = 1;
  pen.beginPath();
  for (const [along, aside] of [[0.5, 0], [0.25, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.25, -0.5]]) pen.lineTo(along * long, aside * wide);
  pen.closePath();
  pen.fill();
  pen.stroke();
  pen.restore();
}

function drawDot(pen, [px, py], scale, colour) {
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(px, py, Math.max(0.6 * scale, 3.5), 0, 7);
  pen.fill();
}

function drawCross(pen, [px, py]) {
  pen.strokeStyle = "#ff3b30";
  pen.lineWidth = 3;
  pen.beginPath();
  pen.moveTo(px - 9, py - 9), pen.lineTo(px + 9, py + 9), pen.moveTo(px - 9, py + 9), pen.lineTo(px + 9, py - 9);
  pen.stroke();
}
