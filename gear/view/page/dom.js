// Nodes and words. Text of the dataset always goes in as text nodes; nothing here parses HTML.
const SVG = "http://www.w3.org/2000/svg";
const byId = (id) => document.getElementById(id);

function h(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

function svg(name, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, name), attributes, children);
}

function filled(node, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else node.setAttribute(key, value === true ? "" : value);
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
}

const isNumber = (value) => typeof value === "number" && Number.isFinite(value);
const grouped = (value) => value.toLocaleString("en-GB", { maximumFractionDigits: 0 });
const rounded = (value, digits) => value.toLocaleString("en-GB", { maximumFractionDigits: digits });
const percent = (value) => (isNumber(value) ? (value > 0 && value < 0.0005 ? "< 0.1 %" : `${rounded(value * 100, value < 0.1 ? 1 : 0)} %`) : "–");
const counted = (number, thing) => `${number} ${thing}${number === 1 ? "" : "s"}`;
const metres = (value) => (isNumber(value) ? `${value.toFixed(1)} m` : "–");
const degrees = (value) => (isNumber(value) ? `${rounded(value, 0)}°` : "–");
const sampleName = (sample) => String(sample.index).padStart(6, "0");
