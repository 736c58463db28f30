// Curves of the twins over time, with a cursor at the time of the frame.
const CURVES = [
  { key: "speed_kmh", title: "speed, km/h", low: 0 },
  { key: "acceleration_mps2", title: "acceleration, m/s²", low: 0 },
  { key: "ttc_s", title: "time to collision, s (up to 10)", low: 0, most: 10 },
];
const LEFT_PX = 40;
const TOP_PX = 30;
const BOTTOM_PX = 20;

function drawCurve(canvas, { key, title, low, most }, drives, frame) {
  const { pen, width, height } = penOf(canvas);
  const values = drives.flatMap((drive) => drive.motion[key]).filter(isNumber).map((value) => Math.min(value, most ?? value));
  const least = Math.min(low, ...values.slice(0, 60000));
  const largest = Math.max(low + 1, ...values.slice(0, 60000));
  const duration = Math.max(0.1, ...drives.map((drive) => drive.motion.time_s[drive.motion.time_s.length - 1]));
  const x = (time) => LEFT_PX + (time / duration) * (width - LEFT_PX - 12);
  const y = (value) => TOP_PX + (1 - (value - least) / (largest - least)) * (height - TOP_PX - BOTTOM_PX);
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = "#a3afbd";
  pen.fillText(title, 8, 15);
  for (const value of [least, (least + largest) / 2, largest]) {
    drawWay(pen, [[LEFT_PX, y(value)], [width - 12, y(value)]], "#222a33", 1);
    pen.fillText(rounded(value, 1), 6, y(value) + 4);
  }
  pen.fillText("0 s", LEFT_PX, height - 5);
  pen.fillText(`${rounded(duration, 1)} s`, width - 40, height - 5);
  drives.forEach((drive, place) => {
    pen.strokeStyle = drive.colour;
    pen.lineWidth = 5 - 1.5 * Math.min(place, 2);
    pen.beginPath();
    let isOn = false;
    drive.motion[key].forEach((value, number) => {
      const isShown = isNumber(value);
      if (isShown) pen[isOn ? "lineTo" : "moveTo"](x(drive.motion.time_s[number]), y(Math.min(value, most ?? value)));
      isOn = isShown;
    });
    pen.stroke();
    const [time, value] = [at(drive.motion.time_s, frame), at(drive.motion[key], frame)];
    if (!isNumber(value)) return;
    pen.fillStyle = drive.colour;
    pen.beginPath();
    pen.arc(x(time), y(Math.min(value, most ?? value)), 4, 0, 7);
    pen.fill();
  });
  const now = frame / 10;
  drawWay(pen, [[x(Math.min(now, duration)), TOP_PX], [x(Math.min(now, duration)), height - BOTTOM_PX]], "#e8ebef", 1);
}

// The frame under a point of a curve.
function frameAt(canvas, offsetX, frames) {
  const share = (offsetX - LEFT_PX) / Math.max(1, canvas.clientWidth - LEFT_PX - 12);
  return Math.round(Math.min(1, Math.max(0, share)) * (frames - 1));
}
