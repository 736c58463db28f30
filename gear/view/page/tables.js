// Tables of whatever JSON a record and a task's facts hold.
const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
const isRows = (value) => Array.isArray(value) && value.length > 0 && value.every(isObject);
const LONGEST_TEXT = 32;

// Without commas between thousands, which would look like more items; large numbers with fewer digits.
const inList = (value) => String(Number(value.toFixed(Math.abs(value) < 100 ? 3 : 1)));

function words(value) {
  if (isNumber(value)) return String(Math.abs(value) < 1e-3 ? Number(value.toPrecision(3)) : Number(value.toFixed(4)));
  if (value === null || value === undefined) return "–";
  if (Array.isArray(value) && !value.length) return "none";
  if (Array.isArray(value)) return value.length <= 4 && !value.some((item) => item instanceof Object) ? value.map((item) => (isNumber(item) ? inList(item) : words(item))).join(", ") : counted(value.length, "value");
  if (isObject(value)) return counted(Object.keys(value).length, "value");
  return String(value);
}

function cell(value, isAligned = false) {
  const text = words(value);
  const isLong = text.length > LONGEST_TEXT;
  return h("td", { class: isAligned && isNumber(value) ? "number" : null, title: isLong ? text.slice(0, 1000) : null }, isLong ? `${text.slice(0, LONGEST_TEXT - 1)}…` : text);
}

function table(label, headers, rows) {
  const isNumeric = headers.map((_, i) => rows.some((row) => isNumber(row[i])));
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": label },
    h("table", {}, h("thead", {}, h("tr", {}, headers.map((name, i) => h("th", { scope: "col", class: isNumeric[i] ? "number" : null }, name)))),
      h("tbody", {}, rows.map((row) => h("tr", {}, row.map((value) => cell(value, true)))))));
}

function facts(label, pairs) {
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": label },
    h("table", {}, h("tbody", {}, pairs.map(([name, value]) => h("tr", {}, h("th", { scope: "row" }, name), cell(value))))));
}

// One level of mappings inside becomes names with dots, as far as they are small.
function flattened(value) {
  return Object.entries(value).flatMap(([key, item]) => (isObject(item) ? Object.entries(item).map(([inner, v]) => [`${key}.${inner}`, v]) : [[key, item]]));
}

// Columns of long texts, as run lengths are, come last: what can be read stands where it is seen.
function tableOfRows(label, items) {
  const rows = items.map((item) => new Map(flattened(item)));
  const names = [...new Set(rows.flatMap((row) => [...row.keys()]))];
  const isLong = (name) => rows.some((row) => words(row.get(name)).length > LONGEST_TEXT);
  const headers = [...names.filter((name) => !isLong(name)), ...names.filter(isLong)];
  return table(label, headers, rows.map((row) => headers.map((name) => row.get(name))));
}

function card(title, note, ...body) {
  return h("section", { class: "card" }, h("div", { class: "head" }, h("h2", {}, title), note ? h("span", { class: "dim" }, note) : null), h("div", { class: "body" }, body));
}

function raw(title, value) {
  const pre = h("pre", { tabindex: "0", "aria-label": title });
  const box = h("details", { class: "card", ontoggle: () => { if (box.open && !pre.firstChild) pre.textContent = JSON.stringify(value, null, 1); } }, h("summary", {}, title), pre);
  return box;
}

// What a task says of a sample, whatever it is: lists of mappings are tables, the rest is names and values.
const ofTask = (value) => (isObject(value) ? Object.entries(value) : [["facts", value]]);
const isFilled = (item) => isObject(item) && Object.keys(item).length > 0;

function factTables(value) {
  return ofTask(value).filter(([, item]) => isRows(item)).map(([key, items]) => card(key, `${items.length}, of the task`, tableOfRows(key, items)));
}

function factCards(value) {
  const groups = ofTask(value).filter(([, item]) => isFilled(item)).map(([key, item]) => card(key, "of the task", facts(key, flattened(item))));
  const single = ofTask(value).filter(([, item]) => !isRows(item) && !isFilled(item));
  return single.length ? [...groups, card("Facts", "of the task", facts("Facts", single))] : groups;
}
