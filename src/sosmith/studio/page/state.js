// ---- What is known, and what is sent

const choices = JSON.parse(document.getElementById("choices").textContent);
const byId = (id) => document.getElementById(id);
const known = {};
const pending = {};
let me = "", sent = 0, socket = null, ended = false, flying = 0;

function send(message) {
  if (!socket || socket.readyState !== WebSocket.OPEN) return;
  sent += 1;
  socket.send(JSON.stringify({ ...message, n: sent }));
}

function change(changes, moving = false) {
  for (const [path, value] of Object.entries(changes)) pending[path] = { value, n: sent + 1 };
  send({ do: "change", changes, moving });
}

// While something is dragged, the next change waits for the answer to the last one.
let waiting = null;
function move(changes) {
  if (flying > 0) { waiting = changes; return; }
  flying = sent + 1;
  change(changes, true);
}

function landed() {
  if (known.preview && known.preview.client === me && known.preview.n >= flying) {
    flying = 0;
    if (waiting) { const next = waiting; waiting = null; move(next); }
  }
}

function release(changes) {
  waiting = null;
  flying = 0;
  change(changes);
}

// ---- The stage that is shown: a single core has one, whose filter is a table of its own

let chosen = 0;
const isChain = () => Boolean(known.document && known.document.stages);
const isTable = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
const tables = () => (isChain() && Array.isArray(known.document.keys.stage) ? known.document.keys.stage.filter(isTable) : []);
const table = () => tables()[chosen] || {};
const kind = () => (isChain() ? table().kind : null);

// Where a key of the form stands in the specification.
function pathOf(key) {
  if (!isChain()) return key;
  if (key === "filter.kind") return `stage.${chosen}.band`;
  const [group, name] = key.split(".");
  return group === "filter" || group === "stage" || key === "hardware.realization" ? `stage.${chosen}.${name}` : key;
}

// The number of a stage in what was computed, which may be older than the text; -1 if it is not there.
function numberIn(stages) {
  if (!isChain()) return 0;
  return (stages || []).findIndex((each) => each && each.name === table().name);
}

// The responses of the stage that is shown: null for one that has none.
function seen() {
  const { spec, stages, chain } = known.preview || {};
  if (!spec || isChain() !== Boolean(spec.stage)) return null;
  return stages[isChain() ? numberIn(spec.stage) : 0] || null;
}

const isProven = () => Boolean(known.proof) && known.proof.state === "proven";

// What is proven of it: undefined as long as nothing is.
function provenStage() {
  const { design } = known;
  return design && isChain() === Boolean(design.chain) ? design.stages[numberIn(design.stages)] : undefined;
}

// What the specification has, and what it will have once the changes are answered that are on their way.
const given = (path) => path.split(".").reduce((tree, key) => (tree === undefined || tree === null ? undefined : tree[key]), known.document && known.document.keys);
const asked = (path) => (pending[path] ? pending[path].value : given(path));
const ask = (key) => asked(pathOf(key));

const numbers = (value) => (value === undefined || value === null ? [] : Array.isArray(value) ? value : [value]);
const rounded = (value, digits = 5) => Number(value.toPrecision(digits));
const withUnit = (text, unit) => (unit ? `${text} ${unit}` : text);
const isBand = () => ["bandpass", "bandstop"].includes(given(pathOf("filter.kind")));

function say(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

function element(name, text = "", attributes = {}) {
  const node = document.createElement(name);
  node.textContent = text;
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  return node;
}

function rows(table, head, body) {
  const top = element("tr");
  head.forEach(([name, number]) => top.append(element("th", name, number ? { class: "number", scope: "col" } : { scope: "col" })));
  byId(table).tHead.replaceChildren(top);
  byId(table).tBodies[0].replaceChildren(
    ...body.map(({ cells, name = "" }) => {
      const row = element("tr", "", name ? { class: name } : {});
      cells.forEach((text, k) => row.append(element(k ? "td" : "th", text, k && head[k][1] ? { class: "number" } : {})));
      return row;
    }),
  );
}
