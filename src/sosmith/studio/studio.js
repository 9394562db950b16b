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

// What the specification has, and what it will have once the changes are answered that are on their way.
const given = (path) => path.split(".").reduce((tree, key) => (tree === undefined || tree === null ? undefined : tree[key]), known.preview && known.preview.spec);
const asked = (path) => (pending[path] ? pending[path].value : given(path));

const numbers = (value) => (value === undefined || value === null ? [] : Array.isArray(value) ? value : [value]);
const rounded = (value, digits = 5) => Number(value.toPrecision(digits));
const withUnit = (text, unit) => (unit ? `${text} ${unit}` : text);
const isBand = () => ["bandpass", "bandstop"].includes(given("filter.kind"));

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

// ---- Controls

const fields = [...document.querySelectorAll("[data-key]")];
const form = () => (numbers(given("filter.passband_edge")).length ? "mask" : numbers(given("filter.cutoff")).length ? "order" : "sections");

for (const field of fields.filter((each) => each.tagName === "SELECT")) {
  for (const name of choices[field.dataset.key]) field.append(element("option", name, { value: name }));
}

function read(field) {
  const text = field.value.trim();
  if (field.tagName === "SELECT" || text === field.dataset.word) return text;
  const value = Number(text.replace(",", ".").replace("−", "-"));
  return text === "" || !Number.isFinite(value) ? undefined : value;
}

function commit(field) {
  const value = read(field), path = field.dataset.key;
  const bad = value === undefined;
  field.toggleAttribute("aria-invalid", false);
  if (bad) { field.setAttribute("aria-invalid", "true"); return; }
  const before = numbers(asked(path)), at = Number(field.dataset.at || 0);
  if (field.dataset.at !== undefined && isBand()) {
    const both = [...before];
    both[at] = value;
    change({ [path]: both });
  } else change({ [path]: value });
}

let typing = 0;
byId("controls").addEventListener("input", (event) => {
  const field = event.target;
  if (!field.dataset.key || field.tagName === "SELECT") return;
  clearTimeout(typing);
  typing = setTimeout(commit, 350, field);
});
byId("controls").addEventListener("change", (event) => {
  const field = event.target;
  if (field.name === "form") { reform(field.value); return; }
  if (!field.dataset.key) return;
  clearTimeout(typing);
  // After a refusal, what the page knows is older than what was sent: the number before is a change again.
  const refused = known.preview.error !== null || field.hasAttribute("aria-invalid");
  if (refused || field.tagName === "SELECT" || read(field) !== numbers(asked(field.dataset.key))[Number(field.dataset.at || 0)]) commit(field);
});
byId("controls").addEventListener("submit", (event) => event.preventDefault());

// The same filter, as far as possible, in the other form.
function reform(to) {
  const { filter, spec } = known.preview, half = spec.sample_rate / 2;
  const edges = (bands) => {
    const frequencies = bands.flat().filter((value) => value > 0 && value < half).map((value) => rounded(value, 6));
    return isBand() ? frequencies : frequencies[0];
  };
  if (to === "mask") change({ "filter.passband_edge": edges(filter.passbands), "filter.stopband_edge": edges(filter.stopbands) });
  else {
    const cutoff = filter.cutoff.map((value) => rounded(value, 7));
    change({ "filter.order": filter.order / (isBand() ? 2 : 1), "filter.cutoff": isBand() ? cutoff : cutoff[0] });
  }
}

const fallbacks = { "hardware.start": "steady", "filter.method": "bilinear", "filter.freedom": "none" };

function controls() {
  const now = form(), stale = known.preview.error !== null;
  for (const label of document.querySelectorAll("#controls label[data-form]")) {
    label.hidden = label.dataset.form !== now || ("pair" in label.dataset && !isBand());
  }
  for (const label of document.querySelectorAll("#controls label[data-needed]")) {
    label.hidden = asked(label.querySelector("[data-key]").dataset.key) === undefined;
  }
  document.querySelector(".forms").hidden = now === "sections";
  for (const radio of document.querySelectorAll("input[name=form]")) radio.checked = radio.value === now;
  for (const unit of document.querySelectorAll("[data-unit]")) unit.textContent = known.preview.unit;
  if (stale) return; // what is typed stays, for correction
  for (const field of fields) {
    const path = field.dataset.key, value = numbers(asked(path))[Number(field.dataset.at || 0)];
    if (field === document.activeElement && field.tagName !== "SELECT") continue;
    field.removeAttribute("aria-invalid");
    const fallback = field.tagName === "SELECT" ? (fallbacks[path] || "auto") : "";
    const text = value === undefined ? fallback : `${value}`;
    if (field.value !== text) field.value = text;
    if (field.tagName === "SELECT" && path.startsWith("filter.")) field.disabled = now === "sections";
  }
}

// ---- Handles on the gain

const handles = new Map();
let scales = null, dragged = null, frozen = null;

function wanted() {
  if (!known.preview || !known.preview.spec) return [];
  const now = form(), filter = known.preview.filter;
  const losses = { passband_edge: "filter.passband_loss", stopband_edge: "filter.stopband_loss" };
  const keys = now === "order" ? ["cutoff"] : now === "mask" ? ["passband_edge", "stopband_edge"] : [];
  return keys.flatMap((key) => {
    const all = numbers(asked(`filter.${key}`));
    return all.map((f, at) => {
      const loss = losses[key], names = all.length > 1 ? [", lower", ", upper"] : [""];
      return {
        id: `${key}${at}`, at, path: `filter.${key}`, loss, f, count: all.length,
        db: loss ? -asked(loss) : at_frequency(f), name: key.replace("_", " ") + names[at], filter,
      };
    });
  });
}

function at_frequency(f) {
  const { f: grid, db } = known.preview.response;
  let best = 0;
  grid.forEach((value, k) => { if (Math.abs(value - f) < Math.abs(grid[best] - f)) best = k; });
  return db[best];
}

function settle(one, f, db) {
  const half = asked("sample_rate") / 2, changes = {};
  if (f !== null) {
    const inside = Math.min(Math.max(f, half * 2.1e-6), half * 0.99999), all = [...numbers(asked(one.path))];
    all[one.at] = rounded(inside);
    changes[one.path] = one.count > 1 ? all : all[0];
  }
  if (db !== null && one.loss) changes[one.loss] = rounded(Math.min(Math.max(db, 1e-6), 200), 4);
  return changes;
}

function handle(one) {
  const group = drawn("g", { class: "handle", tabindex: "0", role: "slider", id: `handle-${one.id}` });
  group.append(
    drawn("line", { class: "edge", y1: 0, y2: 0 }),
    drawn("circle", { class: "reach", r: 22 }), drawn("circle", { class: "knob", r: 8 }), drawn("text", { y: -14, "text-anchor": "middle" }),
  );
  group.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    event.preventDefault();
    group.focus();
    group.setPointerCapture(event.pointerId);
    group.classList.add("held");
    frozen = scales.range;
    dragged = { id: one.id, x: event.clientX, y: event.clientY, loss: null, up: false, last: null };
    const now = wanted().find((each) => each.id === one.id);
    dragged.loss = now.loss ? asked(now.loss) : null;
  });
  group.addEventListener("pointermove", (event) => {
    if (!dragged || dragged.id !== one.id) return;
    const now = wanted().find((each) => each.id === one.id);
    if (!now) return;
    const box = byId("gain").getBoundingClientRect(), dy = event.clientY - dragged.y;
    const f = Math.abs(event.clientX - dragged.x) > 2 || dragged.last ? scales.inverse(event.clientX - box.left) : null;
    if (Math.abs(dy) > 6) dragged.up = true;
    // A loss near 0 dB would be out of reach on this scale: there, up and down multiply it.
    const db = !dragged.up || dragged.loss === null ? null : now.path.endsWith("passband_edge") ? dragged.loss * 10 ** (dy / 120) : -scales.level(event.clientY - box.top);
    const changes = settle(now, f, db);
    if (!Object.keys(changes).length) return;
    dragged.last = changes;
    for (const [path, value] of Object.entries(changes)) pending[path] = { value, n: Infinity };
    move(changes);
    place();
  });
  const drop = () => {
    if (!dragged || dragged.id !== one.id) return;
    const last = dragged.last;
    dragged = null;
    frozen = null;
    group.classList.remove("held");
    if (last) release(last);
  };
  group.addEventListener("pointerup", drop);
  group.addEventListener("pointercancel", drop);
  group.addEventListener("keydown", (event) => {
    const now = wanted().find((each) => each.id === one.id), far = event.shiftKey ? 10 : 1;
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1], PageDown: [-10, 0], PageUp: [10, 0] }[event.key];
    if (!steps || !now) return;
    event.preventDefault();
    const f = steps[0] ? now.f * 1.01 ** (steps[0] * far) : null;
    const db = steps[1] && now.loss ? asked(now.loss) + steps[1] * far * (now.path.endsWith("stopband_edge") ? 1 : asked(now.loss) * 0.05) : null;
    const changes = settle(now, f, db);
    if (Object.keys(changes).length) change(changes);
    place();
  });
  return group;
}

// Handles stay the same elements while they are moved: they keep the focus and the pointer.
function place() {
  const svg = byId("gain").querySelector("svg");
  if (!svg || !scales) return;
  let layer = svg.querySelector(".handles");
  if (!layer) {
    layer = byId("gain").handles || drawn("g", { class: "handles" });
    byId("gain").handles = layer;
    svg.append(layer);
  }
  const now = wanted();
  for (const [id, group] of handles) if (!now.some((one) => one.id === id)) { group.remove(); handles.delete(id); }
  for (const one of now) {
    if (!handles.has(one.id)) { handles.set(one.id, handle(one)); layer.append(handles.get(one.id)); }
    const group = handles.get(one.id), [low, high] = scales.range.y;
    const x = scales.x(Math.max(one.f, scales.range.x[0])), y = scales.y(Math.max(low, Math.min(high, one.db)));
    group.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
    const line = group.querySelector("line");
    line.setAttribute("y1", TOP - y);
    line.setAttribute("y2", scales.bottom - y);
    const words = `${short(one.f, 5)} Hz${one.loss ? `, ${short(asked(one.loss), 4)} dB` : ""}`;
    const text = group.querySelector("text");
    if (text.textContent !== words) text.textContent = words;
    const room = Math.min(text.textContent.length * 3.7, 90);
    text.setAttribute("x", Math.max(LEFT + room - x, Math.min(0, scales.width - room - x)));
    text.setAttribute("y", y < 40 ? 28 : -14);
    const half = asked("sample_rate") / 2;
    for (const [key, value] of Object.entries({ "aria-label": one.name, "aria-valuemin": 0, "aria-valuemax": half, "aria-valuenow": one.f, "aria-valuetext": words })) {
      group.setAttribute(key, value);
    }
  }
}

// ---- Plots

function redrawn(where, to, label) {
  const former = where.querySelector("svg");
  if (!former || !where.handles) return shown(where, to, label);
  const svg = document.createElement("div");
  const fresh = shown(svg, to, label);
  // Children are exchanged one by one, so that the handles never leave the document.
  for (const child of [...former.children]) if (child !== where.handles) child.remove();
  former.prepend(...fresh.children);
  for (const name of ["viewBox", "width", "height"]) former.setAttribute(name, fresh.getAttribute(name));
  return former;
}

function gain() {
  const { response, spec, filter } = known.preview, half = spec.sample_rate / 2, where = byId("gain");
  const stop = numbers(asked("filter.stopband_loss"))[0] || 0;
  const lowest = Math.max(response.f[0], Math.min(...[...numbers(filter.cutoff), ...numbers(asked("filter.passband_edge")), half / 2]) / 30);
  const auto = { x: [10 ** (Math.floor(Math.log10(lowest) * 2) / 2), half], y: [-Math.max(80, Math.ceil((stop + 20) / 20) * 20), 6] };
  const { x, y } = frozen || auto;
  const to = axes(where, { x, y, logarithmic: true, xUnit: "Hz", yUnit: "dB", height: Math.max(300, Math.min(400, where.clientWidth * 0.6)) });
  if (form() === "mask") {
    const box = (from, until, top, bottom) => {
      const left = to.x(Math.max(from, x[0])), right = to.x(Math.min(Math.max(until, x[0]), x[1]));
      if (right > left) to.layer.append(drawn("rect", { class: "mask", x: left, width: right - left, y: to.y(top), height: Math.max(to.y(bottom) - to.y(top), 0) }));
    };
    for (const [from, until] of filter.passbands) box(from, until, -asked("filter.passband_loss"), y[0]);
    for (const [from, until] of filter.stopbands) box(from, until, y[1], -stop);
  }
  curve(to, "ideal", response.f, response.db);
  const proof = known.proof;
  if (proof && proof.state === "proven" && proof.result.f) curve(to, "integer", proof.result.f, proof.result.db);
  scales = to;
  redrawn(where, to, "Gain over frequency").setAttribute("role", "group");
  where.classList.toggle("old", known.preview.error !== null);
  const level = Math.abs(response.level) < 5e-4 ? "" : `relative to ${short(response.level, 4)} dB`;
  say("level", level);
  place();
}

function step() {
  const { step: { t, y }, filter } = known.preview;
  const facts = [];
  if (filter.overshoot !== null) facts.push(`overshoot ${short(100 * filter.overshoot, 3)} %`);
  if (filter.settling !== null) facts.push(`within 1 % after ${inTime(filter.settling).text(filter.settling)}`);
  say("stepfacts", facts.join(", "));
  if (!t.length) { byId("step").replaceChildren(element("p", "It does not settle in a million samples.")); return; }
  const { factor, unit } = inTime(t.at(-1));
  const to = axes(byId("step"), { x: [0, factor * t.at(-1) || 1], y: span([0, ...y]), xUnit: unit });
  curve(to, "ideal", t.map((time) => factor * time), y);
  shown(byId("step"), to, "Step response");
}

function delay() {
  const { response, filter } = known.preview, where = byId("delay");
  const pass = filter.passbands.length ? response.delay.filter((_, k) => filter.passbands.some(([from, until]) => response.f[k] >= from && response.f[k] <= until)) : response.delay;
  const values = span([0, ...(pass.length > 2 ? pass : response.delay)], 0.15), { factor, unit } = inTime(values[1]);
  const to = axes(where, { x: scales.range.x, y: values.map((each) => factor * each), logarithmic: true, xUnit: "Hz", yUnit: unit });
  curve(to, "ideal", response.f, response.delay.map((each) => (each === null ? null : factor * each)));
  shown(where, to, `Group delay over frequency, in ${unit}`);
}

// Half of what is shown around 0: with the zeros of an FIR filter outside the unit circle, as far as it stays to be seen.
function frame(zeros) {
  return Math.min(Math.max(1.1, ...zeros.map(([re, im]) => 1.1 * Math.max(Math.abs(re), Math.abs(im)))), 3);
}

// The unit circle, or its neighbourhood of z = 1 where the poles of a low cutoff would fall into one spot.
function plane() {
  const { poles, zeros } = known.preview.plane, where = byId("plane"), width = Math.max(where.clientWidth, 240);
  const distance = Math.max(...poles.map(([re, im]) => Math.hypot(re - 1, im)), 1e-9);
  const near = poles.length > 0 && distance < 0.3, centre = near ? 1 : 0, half = near ? 1.25 * distance : frame(zeros);
  const height = 230, middle = [width / 2, height / 2], radius = (height / 2 - 6) / half;
  const spot = ([re, im]) => [middle[0] + radius * (re - centre), middle[1] - radius * im];
  const svg = drawn("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": `${poles.length} poles and ${zeros.length} zeros in the z-plane` });
  const clip = drawn("clipPath", { id: `clip${++clips}` }), inside = drawn("g", { "clip-path": `url(#clip${clips})` });
  clip.append(drawn("rect", { x: 0, y: 0, width, height }));
  const [left, level] = spot([0, 0]);
  inside.append(drawn("line", { class: "grid", x1: 0, x2: width, y1: level, y2: level }));
  inside.append(drawn("line", { class: "grid", x1: spot([centre, 0])[0], x2: spot([centre, 0])[0], y1: 0, y2: height }));
  inside.append(drawn("circle", { class: "circle", cx: left, cy: level, r: radius }));
  for (const zero of zeros) { const [x, y] = spot(zero); inside.append(drawn("circle", { class: "zero", cx: x, cy: y, r: 5 })); }
  for (const pole of poles) { const [x, y] = spot(pole); inside.append(drawn("path", { class: "pole", d: `M${x - 5} ${y - 5}l10 10m0-10l-10 10` })); }
  svg.append(clip, inside);
  if (near) svg.append(drawn("text", { x: spot([1, 0])[0] + 6, y: level + 16 }, "1"));
  where.replaceChildren(svg);
  const far = poles.length ? Math.max(...poles.map(([re, im]) => Math.hypot(re, im))) : 0;
  const radii = poles.length ? `radius up to ${far > 0.999 ? `1 − ${short(1 - far, 3)}` : short(far, 4)}` : "";
  const outside = near ? 0 : zeros.filter(([re, im]) => Math.max(Math.abs(re), Math.abs(im)) > half).length;
  say("poles", near ? `${radii}, near z = 1` : [radii, outside ? `${counted(outside, "zero")} farther out` : ""].filter(Boolean).join(", "));
}

// ---- What the proof says

const counted = (number, name) => `${number.toLocaleString("en")} ${name}${number === 1 ? "" : "s"}`;

const size = (one) => `about ${one.luts.toLocaleString("en")} LUT4`;

function sizeBeside(one) {
  const within = `LUT4 to within ${Math.round(100 * one.within)} % for 9 of 10 designs tested`;
  const others = [counted(one.flip_flops, "flip-flop"), counted(one.multipliers, "multiplier"), `${counted(one.memory, "bit")} of memory`];
  return `${others.join(", ")} on ${one.device}; ${within}`;
}

function verdict() {
  const { preview, proof } = known, box = byId("verdict");
  const wrong = preview && preview.error;
  const show = (kind, state, detail) => { box.className = `verdict ${kind}`; say("state", state); say("detail", detail); };
  if (ended) show("fail", "The studio has ended", "What was not saved is in the text below.");
  else if (!socket || socket.readyState !== WebSocket.OPEN) show("wait", "No connection to the studio", "Trying again.");
  else if (wrong) show("fail", "Not a filter yet", wrong);
  else if (!proof || proof.state === "waiting") show("wait", "Changing", "The proof begins when the handle is let go.");
  else if (proof.state === "working") show("wait", "Proving", `${proof.step}. The response is already that of the new filter.`);
  else if (proof.state === "refused") show("fail", "No proven design", proof.error);
  else {
    const { bound, allowed, unit, realization, architecture } = proof.result;
    const kept = bound <= allowed;
    show(kept ? "pass" : "fail", `Proven: error at most ${withUnit(short(bound), unit)}`, `For all inputs in range; ${withUnit(short(allowed), unit)} allowed. ${[realization, architecture].filter(Boolean).join(", ")}.`);
  }
}

function tile(name, value, aside, part = null) {
  const box = element("div"), content = element("dd");
  content.append(element("div", value, { class: "value" }));
  if (part !== null) {
    const meter = element("div", "", { class: part > 1 ? "meter over" : "meter" }), bar = element("i");
    bar.style.width = `${Math.min(100, 100 * part)}%`;
    meter.append(bar);
    content.append(meter);
  }
  content.append(element("div", aside, { class: "aside" }));
  box.append(element("dt", name), content);
  return box;
}

function proven() {
  const { proof } = known, result = proof && proof.result;
  for (const id of ["tiles", "budget", "sections", "cycles", "reasons"]) byId(id).classList.toggle("old", !proof || proof.state !== "proven");
  if (!result) return;
  const { unit, lsb } = result, largest = Math.max(0, ...result.limit_cycles.map(([, size]) => size));
  byId("tiles").replaceChildren(
    tile("error bound", withUnit(short(result.bound), unit), `${short(result.bound / lsb, 4)} LSB, ${short(100 * result.bound / result.allowed, 3)} % of what is allowed`, result.bound / result.allowed),
    tile("realization", result.realization || "none", result.architecture),
    tile("time", `${result.cycles.toLocaleString("en")} clock${result.cycles === 1 ? "" : "s"}`, `a sample and channel; latency ${result.latency.toLocaleString("en")} clocks`),
    tile("cost, estimated", size(result.cost), sizeBeside(result.cost)),
    tile("limit cycles", result.limit_cycles.length ? (largest > 0 ? `${short(largest, 3)} LSB` : "none") : "–", "at most, of any one section, without input"),
  );
  const part = (value) => `${short(100 * value / result.allowed, 3)} %`;
  rows("budget", [["part", false], [unit || "full scale 1", true], ["LSB", true], ["of allowed", true]], [
    ...result.budget.filter(([, value]) => value >= lsb / 20000).map(([name, value]) => ({ cells: [name, short(value, 3), short(value / lsb, 3), part(value)] })),
    { cells: ["sum", short(result.bound, 3), short(result.bound / lsb, 3), part(result.bound)] },
  ]);
  byId("reasons").replaceChildren(...Object.entries(result.reasons).map(([name, reason]) => element("p", `${name}: ${reason}.`)));
  byId("sections").hidden = !result.sections.length;
  rows("sections", [["section", false], ["coefficients", false]], result.sections.map(([name, all]) => ({
    cells: [name, all.map(([key, integer, bits]) => `${key} = ${minus(integer)}·2${superscript(-bits)}`).join("   ")],
  })));
  byId("cycles").hidden = !result.limit_cycles.length;
  rows("cycles", [["section", false], ["without input, at most", true], ["dead band", true]], result.limit_cycles.map(([name, most, dead]) => ({ cells: [name, short(most, 3), short(dead, 3)] })));
  const source = byId("source"), names = Object.keys(result.scenarios);
  if ([...source.options].map((each) => each.value).join() !== names.join()) {
    const chosen = source.value;
    source.replaceChildren(...names.map((name) => element("option", `${name}: ${result.scenarios[name]}`, { value: name })));
    if (names.includes(chosen)) source.value = chosen;
    else if (names.includes("wear_ramp")) source.value = "wear_ramp";
  }
}

function realizations() {
  const { state, step: at, rows: designs } = known.realizations, chosen = known.proof && known.proof.state === "proven" && known.proof.result.realization;
  byId("compare").setAttribute("aria-pressed", `${state !== "off"}`);
  byId("compare").textContent = state === "off" ? "Compare realizations" : "Stop comparing";
  say("comparing", state === "working" ? `Designing ${at}.` : state === "waiting" ? "After the proof." : "");
  byId("realizations").hidden = !designs.length;
  const unit = known.preview ? known.preview.unit : "";
  rows("realizations", [["realization", false], ["architecture", false], [withUnit("bound", unit && `in ${unit}`), true], ["clocks a sample", true], ["latency", true], ["cost, estimated", false]], designs.map((one) => ({
    name: one.realization === chosen ? "taken" : "",
    cells: one.refused ? [one.realization, "–", "–", "–", "–", one.refused] : [one.realization + (one.realization === chosen ? ", taken" : ""), one.architecture, short(one.bound), one.cycles.toLocaleString("en"), one.latency.toLocaleString("en"), `${size(one.cost)}, ${counted(one.cost.multipliers, "multiplier")}`],
  })));
}

// ---- Traces, report, calibration

function traced() {
  const { trace, report } = known, working = [trace, report].find((each) => each.state === "working");
  const wrong = [trace, report].find((each) => each.state === "refused");
  say("running", working ? `Running: ${working.step}.` : wrong ? wrong.error : "");
  byId("running").className = wrong && !working ? "problem" : "";
  byId("stop").hidden = !working;
  byId("report").hidden = report.state !== "done";
  if (report.state === "done") {
    const old = report.old ? " It is that of an earlier design." : "";
    say("reportfacts", `${report.passed ? "passed" : "falls short"}: ${report.samples.toLocaleString("en")} samples by ${report.simulator}, ${report.bit_exact ? "every one equal to the integer model" : "not all equal to the integer model"}.${old}`);
  }
  byId("tracefigure").hidden = trace.state !== "done";
  if (trace.state !== "done") return;
  byId("tracefigure").classList.toggle("old", trace.old);
  const { unit, t, channels } = trace, select = byId("channel");
  if (select.length !== channels.length) select.replaceChildren(...channels.map((_, k) => new Option(k)));
  byId("channels").hidden = channels.length === 1;
  const { low, high, error, truth: exact, from_truth } = channels[select.selectedIndex];
  say("tracetitle", `Output on ${trace.name}${channels.length > 1 ? `, channel ${select.value}` : ""}${trace.old ? ", of an earlier design" : ""}`);
  const to = axes(byId("trace"), { x: [0, t.at(-1) || 1], y: span([...low, ...high]), xUnit: "s", yUnit: unit });
  const top = t.map((time, k) => `${to.x(time).toFixed(1)} ${to.y(high[k]).toFixed(1)}`), base = t.map((time, k) => `${to.x(time).toFixed(1)} ${to.y(low[k]).toFixed(1)}`).reverse();
  to.layer.append(drawn("path", { class: "line hardware", d: `M${top.join("L")}L${base.join("L")}Z` }));
  if (exact) curve(to, "truth", t, exact);
  byId("truthlegend").hidden = !exact;
  shown(byId("trace"), to, "Output over time");
  const under = axes(byId("traceerror"), { x: [0, t.at(-1) || 1], y: [0, trace.bound * 1.1], xUnit: "s", yUnit: unit, height: 150 });
  curve(under, "integer", t, error);
  curve(under, "limit", [0, t.at(-1)], [trace.bound, trace.bound]);
  shown(byId("traceerror"), under, "Largest error over time, and the bound");
  const truth = from_truth === null ? "" : ` Against the true value, ${withUnit(short(from_truth, 3), unit)} rms, delay included.`;
  say("tracefacts", `${trace.samples.toLocaleString("en")} samples${channels.length > 1 ? ` on each of ${channels.length} channels` : ""}, bit for bit what the hardware computes: largest error ${withUnit(short(trace.max_error), unit)} of ${withUnit(short(trace.bound), unit)} proven, ${withUnit(short(trace.rms_error, 3), unit)} rms.${truth}`);
}

byId("run").addEventListener("submit", async (event) => {
  event.preventDefault();
  const file = byId("csv").files[0], seconds = byId("seconds").value.trim();
  const csv = file ? await file.text() : null;
  if (csv === null && !byId("source").value) { say("running", "Traces are there once the first design is proven."); return; }
  send({ do: "trace", source: byId("source").value, seconds: seconds === "" ? null : Number(seconds), csv, report: event.submitter && event.submitter.value === "report" });
});
byId("channel").addEventListener("change", traced);
byId("stop").addEventListener("click", () => send({ do: "stop" }));
byId("compare").addEventListener("click", () => send({ do: "realizations", on: known.realizations.state === "off" }));

function calibrated() {
  const calibration = known.calibration;
  byId("fitted").className = calibration.state === "refused" ? "problem" : "";
  if (calibration.state === "working") say("fitted", "Fitting.");
  else if (calibration.state === "refused") say("fitted", calibration.error);
  else if (calibration.state === "done") {
    const [m, n] = calibration.orders, [low, high] = calibration.half_width;
    say("fitted", `${calibration.measurements} measurements, orders ${m} in voltage and ${n} in temperature, adjusted r ${calibration.adjusted_r.toFixed(6)}. Standard error ${short(calibration.rms, 3)} mm rms, ${short(calibration.largest, 3)} mm at most; 95 % of the clearances lie within ±${short(low, 3)} to ±${short(high, 3)} mm. The coefficients are in the specification. ${calibration.warning}`);
  } else say("fitted", "");
}

async function measured(file) {
  if (file) send({ do: "calibration", csv: await file.text() });
}
byId("measurements").addEventListener("change", (event) => measured(event.target.files[0]));
for (const name of ["dragover", "dragleave", "drop"]) {
  byId("drop").addEventListener(name, (event) => {
    event.preventDefault();
    byId("drop").classList.toggle("over", name === "dragover");
    if (name === "drop") measured(event.dataTransfer.files[0]);
  });
}

// ---- The text

let retyping = 0, overwrite = false;
byId("toml").addEventListener("input", () => {
  clearTimeout(retyping);
  retyping = setTimeout(() => send({ do: "text", text: byId("toml").value }), 400);
});
byId("write").addEventListener("click", () => send({ do: "save", overwrite }));
byId("reread").addEventListener("click", () => send({ do: "reread" }));

function text() {
  const { text: content, file, saved, question, problem } = known.document, box = byId("toml");
  if (box !== document.activeElement && box.value !== content) box.value = content;
  overwrite = Boolean(question);
  byId("write").textContent = overwrite ? `Overwrite ${file}` : `Save ${file}`;
  byId("write").disabled = saved;
  byId("reread").hidden = !overwrite;
  say("saved", saved ? "" : "· not saved");
  say("saving", problem || question || (saved ? "Saved." : ""));
  byId("saving").className = problem ? "problem" : "";
}

// ---- What comes

function picture() {
  if (!known.preview || !known.preview.spec) return;
  controls();
  gain();
  step();
  delay();
  plane();
}

function take(news) {
  Object.assign(known, news);
  const answer = news.preview || news.document;
  for (const path of Object.keys(pending)) {
    if (news.preview && (answer.client !== me || answer.n >= pending[path].n)) delete pending[path];
  }
  if (news.preview) {
    if (news.preview.spec) {
      say("name", news.preview.name.replaceAll("_", "_\u200b"));
      say("describe", news.preview.filter.describe);
      document.title = `${news.preview.name}, studio`;
    }
    picture();
    landed();
  } else if (news.proof && scales) gain();
  if (news.document) text();
  if (news.proof) proven();
  if (news.realizations || news.proof) realizations();
  if (news.trace || news.report) traced();
  if (news.calibration) calibrated();
  if (news.ended) ended = true;
  verdict();
}

function listen(wait) {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${location.pathname}live`);
  socket.addEventListener("message", (event) => {
    const news = JSON.parse(event.data);
    wait = 1;
    if (news.you) { me = news.you; sent = 0; flying = 0; return; }
    take(news);
  });
  socket.addEventListener("close", () => {
    verdict();
    if (!ended) setTimeout(listen, wait * 1000, Math.min(2 * wait, 10));
  });
}

new ResizeObserver(() => { picture(); if (known.trace) traced(); }).observe(document.querySelector("main"));
listen(1);
