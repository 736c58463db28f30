// Seen from above: who stands where, in one sample or in all that are shown. East is right, north is up.
const layers = { street: true, ego: true, npc: true, parked: true, carrier: true, pedestrian: true, board: true };
const ROLE_COLOUR = Object.fromEntries(ROLES.map((role) => [role.key, role.colour]));
const LENGTH_M = { ego: 4.5, npc: 4.5, parked: 4.5, carrier: 8, pedestrian: 0.7 };
const WIDTH_M = { ego: 1.9, npc: 1.9, parked: 1.9, carrier: 2.5, pedestrian: 0.7 };

const MANY = 60; // samples; with more, everybody but the ego cars is a dot, so that drawing stays quick,
const LONGEST_OF_MANY_PX = 13; // and ego cars are small arrows, or they would hide one another

class Plan {
  constructor(label) {
    this.canvas = h("canvas", { tabindex: "0", role: "img", "aria-label": label });
    this.tip = h("div", { class: "tip", hidden: true });
    const button = (text, name, run) => h("button", { type: "button", "aria-label": name, title: name, onclick: run }, text);
    this.node = h("div", { class: "plan" }, this.canvas, this.tip,
      h("div", { class: "buttons" }, button("+", "Zoom in", () => this.zoom(1.4)), button("−", "Zoom out", () => this.zoom(1 / 1.4)), button("⤢", "Fit", () => this.fit())));
    this.samples = [];
    this.view = null;
    this.pending = null;
    this.spots = [];
    this.listen();
    new ResizeObserver(() => (this.view ? this.draw() : this.fit())).observe(this.canvas);
  }

  listen() {
    const { canvas } = this;
    let from = null;
    let moved = 0;
    canvas.addEventListener("pointerdown", (event) => { from = event; moved = 0; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointerup", (event) => {
      if (from && moved < 4) this.pick(event);
      from = null;
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!from) return this.hover(event);
      moved += Math.abs(event.clientX - from.clientX) + Math.abs(event.clientY - from.clientY);
      this.pan(event.clientX - from.clientX, event.clientY - from.clientY);
      from = event;
    });
    canvas.addEventListener("pointerleave", () => (this.tip.hidden = true));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const steps = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] };
      if (event.key in steps) this.pan(...steps[event.key]);
      else if (event.key === "+" || event.key === "=") this.zoom(1.3);
      else if (event.key === "-") this.zoom(1 / 1.3);
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
  }

  show(samples, isSingle) {
    Object.assign(this, { samples, isSingle });
    this.fit();
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const points = this.samples.flatMap((sample) => [
      ...sample.actors.filter((actor) => actor[1] === "ego").map((actor) => [actor[3], actor[4]]),
      ...sample.boards.flatMap((board) => board.ends),
      ...(this.isSingle && !sample.boards.length ? sample.actors.map((actor) => [actor[3], actor[4]]) : []),
    ]);
    if (!width || !points.length) return;
    let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const [x, y] of points) [x0, x1, y0, y1] = [Math.min(x0, x), Math.max(x1, x), Math.min(y0, y), Math.max(y1, y)];
    const scale = Math.min(width / (x1 - x0 + 24), height / (y1 - y0 + 24), 30);
    this.view = { scale, x: (x0 + x1) / 2, y: (y0 + y1) / 2 };
    this.draw();
  }

  pan(dx, dy) {
    if (!this.view) return;
    this.view.x -= dx / this.view.scale;
    this.view.y += dy / this.view.scale;
    this.draw();
  }

  zoom(factor, px = this.canvas.clientWidth / 2, py = this.canvas.clientHeight / 2) {
    if (!this.view) return;
    const scale = Math.min(200, Math.max(0.05, this.view.scale * factor));
    const keep = (old) => 1 / old - 1 / scale;
    this.view.x += (px - this.canvas.clientWidth / 2) * keep(this.view.scale);
    this.view.y -= (py - this.canvas.clientHeight / 2) * keep(this.view.scale);
    this.view.scale = scale;
    this.draw();
  }

  toPixels(x, y) {
    const { scale, x: cx, y: cy } = this.view;
    return [this.canvas.clientWidth / 2 + (x - cx) * scale, this.canvas.clientHeight / 2 - (y - cy) * scale];
  }

  draw() {
    this.pending ??= requestAnimationFrame(() => {
      this.pending = null;
      this.paint();
    });
  }

  paint() {
    const { canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !this.view) return;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    drawScale(pen, this.view, width, height);
    if (layers.street) drawStreets(pen, this.view, width, height);
    this.spots = [];
    for (const role of ["parked", "npc", "pedestrian", "carrier", "ego"]) {
      if (!layers[role]) continue;
      pen.fillStyle = ROLE_COLOUR[role];
      pen.strokeStyle = "#0a0d11";
      pen.lineWidth = 1;
      pen.globalAlpha = this.isSingle || role === "ego" ? 1 : Math.max(0.15, Math.min(1, 12 / Math.sqrt(this.samples.length + 1)));
      for (const sample of this.samples) {
        for (const actor of sample.actors) if (actor[1] === role) this.drawActor(pen, sample, actor);
        if (role === "ego" && this.isSingle) this.drawCameras(pen, sample);
      }
    }
    pen.globalAlpha = 1;
    if (layers.board) for (const sample of this.samples) for (const board of sample.boards) this.drawBoard(pen, sample, board);
  }

  drawActor(pen, sample, [asset, role, id, x, y, heading]) {
    const [px, py] = this.toPixels(x, y);
    if (px < -40 || py < -40 || px > this.canvas.clientWidth + 40 || py > this.canvas.clientHeight + 40) return;
    const label = this.isSingle ? `${asset} · ${role} ${id}` : `${sampleName(sample)} · ${asset} · ${role}`;
    const isOneOfMany = this.samples.length > MANY;
    const largest = isOneOfMany ? LONGEST_OF_MANY_PX : Infinity;
    const long = Math.min(largest, Math.max((LENGTH_M[role] ?? 4.5) * this.view.scale, role === "ego" ? 7 : 3));
    const wide = Math.min(largest / 2, Math.max((WIDTH_M[role] ?? 1.9) * this.view.scale, role === "ego" ? 5 : 2.5));
    this.spots.push([px, py, sample, label, long / 2]);
    if (role !== "ego" && isOneOfMany) return void pen.fillRect(px - 1.5, py - 1.5, 3, 3);
    pen.save();
    pen.translate(px, py);
    pen.rotate(-heading);
    pen.beginPath();
    if (role === "pedestrian") pen.arc(0, 0, Math.max(long / 2, 2), 0, 7);
    else for (const [along, aside] of [[0.5, 0], [0.25, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.25, -0.5]]) pen.lineTo(along * long, aside * wide);
    pen.closePath();
    pen.fill();
    if (long > 6) pen.stroke();
    pen.restore();
  }

  drawCameras(pen, sample) {
    for (const camera of sample.cameras) {
      const reach = 60 * this.view.scale;
      const [px, py] = this.toPixels(camera.x, camera.y);
      pen.save();
      pen.globalAlpha = 0.1;
      pen.beginPath();
      pen.moveTo(px, py);
      pen.arc(px, py, reach, -camera.heading - camera.hfov / 2, -camera.heading + camera.hfov / 2);
      pen.fill();
      pen.restore();
    }
  }

  drawBoard(pen, sample, board) {
    const [a, b] = board.ends.map((end) => this.toPixels(...end));
    const [mx, my] = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    pen.strokeStyle = PATCH_COLOUR;
    pen.lineWidth = 3;
    pen.beginPath();
    pen.moveTo(...a);
    pen.lineTo(...b);
    pen.stroke();
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(mx, my);
    pen.lineTo(mx + board.outward[0] * 10, my - board.outward[1] * 10);
    pen.stroke();
    this.spots.push([mx, my, this.isSingle ? sample : null, `${board.name} · ${board.asset}`, 0]);
  }

  nearest(event) {
    let [found, least] = [null, 1];
    for (const spot of this.spots) {
      const distance = Math.hypot(spot[0] - event.offsetX, spot[1] - event.offsetY) / Math.max(12, spot[4]);
      if (distance <= least) [found, least] = [spot, distance];
    }
    return found;
  }

  hover(event) {
    const spot = this.nearest(event);
    this.tip.hidden = !spot;
    if (!spot) return;
    this.tip.textContent = spot[3];
    this.tip.style.left = `${Math.min(spot[0] + 12, this.canvas.clientWidth - 220)}px`;
    this.tip.style.top = `${Math.max(4, spot[1] - 30)}px`;
  }

  pick(event) {
    const spot = this.nearest(event);
    if (spot?.[2] && !this.isSingle) openSample(spot[2]);
  }
}

// Streets as strips of their width, sidewalks below lanes below crosswalks.
const STREET_COLOURS = { sidewalk: "#1d242d", lane: "#2c3540", crosswalk: "#4a5563" };
const STREETS = ABOUT.streets.map(([kind, width, line]) => {
  const path = new Path2D();
  for (let i = 0; i < line.length; i += 2) path.lineTo(line[i], line[i + 1]);
  return { kind, width, path };
});

function drawStreets(pen, view, width, height) {
  pen.save();
  pen.translate(width / 2, height / 2);
  pen.scale(view.scale, -view.scale);
  pen.translate(-view.x, -view.y);
  for (const [kind, colour] of Object.entries(STREET_COLOURS)) {
    pen.strokeStyle = colour;
    for (const street of STREETS) {
      if (street.kind !== kind) continue;
      pen.lineWidth = street.width;
      pen.stroke(street.path);
    }
  }
  pen.restore();
}

function drawScale(pen, view, width, height) {
  const step = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 5000].find((metres) => metres * view.scale >= 60) ?? 10000;
  const [left, top] = [view.x - width / 2 / view.scale, view.y + height / 2 / view.scale];
  pen.strokeStyle = "#1b222b";
  pen.lineWidth = 1;
  pen.beginPath();
  for (let x = Math.ceil(left / step) * step; (x - left) * view.scale < width; x += step) pen.moveTo((x - left) * view.scale, 0), pen.lineTo((x - left) * view.scale, height);
  for (let y = Math.floor(top / step) * step; (top - y) * view.scale < height; y -= step) pen.moveTo(0, (top - y) * view.scale), pen.lineTo(width, (top - y) * view.scale);
  pen.stroke();
  pen.strokeStyle = pen.fillStyle = "#a3afbd";
  pen.font = "12px system-ui, sans-serif";
  pen.beginPath();
  pen.moveTo(14, height - 20), pen.lineTo(14, height - 14), pen.lineTo(14 + step * view.scale, height - 14), pen.lineTo(14 + step * view.scale, height - 20);
  pen.stroke();
  pen.fillText(`${step} m`, 20, height - 20);
  pen.fillText("N ↑", 14, 22);
}

function legend(redraw) {
  const roles = unique(SAMPLES.flatMap((sample) => sample.actors.map((actor) => actor[1])));
  const items = ROLES.filter((role) => roles.includes(role.key)).map((role) => [role.key, role.label]);
  if (SAMPLES.some((sample) => sample.boards.length)) items.push(["board", "Patch surfaces"]);
  if (STREETS.length) items.unshift(["street", "Streets"]);
  return h("div", { class: "legend", role: "group", "aria-label": "Layers of the map" }, items.map(([key, label]) =>
    h("label", {}, h("input", { type: "checkbox", checked: layers[key], onchange: (event) => { layers[key] = event.target.checked; redraw(); } }),
      h("i", { class: `swatch-${key === "carrier" ? "board" : key}` }), label)));
}
