"use strict";
const facts = JSON.parse(document.getElementById("facts").textContent);
const byId = (id) => document.getElementById(id);
const SEVERE = new Set(["wear_critical", "fault"]);
const LEFT = 64, RIGHT = 12, TOP = 26, LANE = 19, AXIS = 30;
const hidden = new Set();
let newest = null, shown = null, cursor = null, held = false;

// ---- Elements and numbers

function element(name, text = "", attributes = {}) {
  const node = document.createElement(name);
  node.textContent = text;
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  return node;
}

function drawn(name, attributes, text = "") {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text) node.textContent = text;
  return node;
}

// What stays the same is left alone: a screen reader would say it again.
function say(id, text) {
  const place = byId(id);
  if (place.textContent !== text) place.textContent = text;
}

const spaced = (flag) => flag.replaceAll("_", " ");
const fixed = (value, digits) => (value === null ? "–" : value.toFixed(digits).replace("-", "−"));
const signed = (value, digits) => (value !== null && value > 0 ? "+" : "") + fixed(value, digits);
const withUnit = (text, unit) => (unit ? `${text} ${unit}` : text);
const perHour = facts.unit ? `${facts.unit}/h` : "1/h";

function duration(seconds) {
  if (seconds < 120) return `${seconds.toFixed(1)} s`;
  if (seconds < 7200) return `${(seconds / 60).toFixed(1)} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}

function clock(seconds) {
  const minutes = Math.floor(seconds / 60), two = (value) => `${value}`.padStart(2, "0");
  return `${Math.floor(minutes / 60)}:${two(minutes % 60)}:${(seconds - 60 * minutes).toFixed(2).padStart(5, "0")}`;
}

function badges(flags) {
  const cell = element("td", "", { class: flags.length ? "some" : "no" });
  for (const flag of flags) cell.append(element("span", spaced(flag), { class: SEVERE.has(flag) ? "flag severe" : "flag" }));
  if (!flags.length) cell.textContent = "–";
  return cell;
}

// ---- Verdict, figures and tables

function verdict(picture, broken) {
  const box = byId("verdict"), count = picture ? picture.alarms : 0;
  const lost = broken || !picture || picture.state === "lost";
  box.className = `verdict ${lost ? "wait" : count ? "fail" : "pass"}`;
  const alarms = count ? `${count.toLocaleString("en")} alarm${count > 1 ? "s" : ""}` : "No alarm";
  const states = { connected: "connected", lost: "board lost, waiting for it", ended: "the monitor has ended" };
  say("state", broken ? "No connection to the monitor" : `${alarms}, ${states[picture.state]}`);
  const last = picture && picture.newest[0];
  const newestAlarm = () =>
    `Newest: ${spaced(last[0])} of channel ${last[1]} at ${clock(last[2])}, ${withUnit(fixed(last[3], facts.digits), facts.unit)}.`;
  say("detail", broken ? "Trying again." : last ? newestAlarm() : "Values are as the board returns them.");
  document.title = `${count ? `(${count}) ` : ""}${facts.name}, live`;
}

function tile(name, value, aside) {
  const box = element("div"), content = element("dd");
  content.append(element("div", value, { class: "value" }), element("div", aside, { class: "aside" }));
  box.append(element("dt", name), content);
  return box;
}

function tiles(picture) {
  const largest = (column) => {
    let best = 0;
    picture.now.forEach((row, k) => { if (row[column] > picture.now[best][column]) best = k; });
    return [picture.now[best][column], `channel ${best}`];
  };
  const many = picture.now.length > 1, most = many ? "largest " : "";
  const elements = [];
  if (picture.now.length) {
    const column = (index, name, text) => {
      const [value, where] = largest(index);
      elements.push(tile(most + name, text(value), many ? where : "now"));
    };
    column(0, facts.quantity, (value) => withUnit(fixed(value, facts.digits), facts.unit));
    if (facts.initial) column(1, "wear", (value) => withUnit(fixed(value, 3), facts.unit));
    if (facts.rated) column(2, "rate", (value) => withUnit(signed(value, 2), perHour));
  }
  elements.push(tile("time", duration(picture.seconds), `${picture.samples.toLocaleString("en")} samples`));
  byId("tiles").replaceChildren(...elements);
}

function header(table, names) {
  const row = element("tr");
  names.forEach(([name, number]) => row.append(element("th", name, number ? { class: "number", scope: "col" } : { scope: "col" })));
  byId(table).tHead.replaceChildren(row);
}

const colour = (channel) => `var(--series${channel % 8})`;

function channelLabel(channel) {
  const label = element("label"), box = element("input", "", { type: "checkbox", checked: "" });
  box.addEventListener("change", () => {
    if (box.checked) hidden.delete(channel);
    else hidden.add(channel);
    draw();
  });
  const swatch = element("i", "", channel < 8 ? {} : { class: "dashed" });
  swatch.style.color = colour(channel);
  label.append(box, swatch, element("span", `${channel}`));
  return label;
}

function channels(picture) {
  const body = byId("channels").tBodies[0];
  while (body.rows.length < picture.now.length) {
    const row = body.insertRow(), name = element("th", "", { scope: "row" });
    name.append(channelLabel(body.rows.length - 1));
    row.append(name);
  }
  picture.now.forEach(([value, wear, rate, flags], k) => {
    const cells = [fixed(value, facts.digits)];
    if (facts.initial) cells.push(fixed(wear, 3));
    if (facts.rated) cells.push(signed(rate, 3));
    const values = cells.map((text) => element("td", text, { class: "number" }));
    const row = body.rows[k];
    while (row.cells.length > 1) row.deleteCell(-1); // the first one stays, as it may have the focus
    row.append(...values, badges(flags));
  });
}

function alarms(picture) {
  byId("alarms").hidden = !picture.newest.length;
  byId("none").hidden = picture.newest.length > 0;
  byId("alarms").tBodies[0].replaceChildren(
    ...picture.newest.map(([flag, channel, seconds, value]) => {
      const row = element("tr");
      row.append(
        element("td", clock(seconds)),
        element("td", `${channel}`, { class: "number" }),
        element("td", fixed(value, facts.digits), { class: "number" }),
        badges([flag]),
      );
      return row;
    }),
  );
}

// ---- The plot

function curve() {
  return document.querySelector("input[name=curve]:checked").dataset.what;
}

function series(picture, what) {
  if (what === "rate") return picture.rates;
  if (what === "wear") return picture.values.map((values, k) => values.map((value) => value - facts.initial[k]));
  return picture.values;
}

// The limits of wear; those of the value only where they are the same for all channels that are shown.
function limits(what, visible) {
  const entries = Object.entries(facts.limits);
  if (what === "wear") return entries;
  const starts = facts.initial ? [...new Set(visible.map((channel) => facts.initial[channel]))] : [];
  return what === "value" && starts.length === 1 ? entries.map(([name, wear]) => [name, wear + starts[0]]) : [];
}

// A limit that is no further from the curves than they reach is in the picture.
function withLimits([low, high], values) {
  const span = high - low, near = values.filter((value) => value > low - span && value < high + span);
  const room = 0.06 * span, bottom = Math.min(low, ...near), top = Math.max(high, ...near);
  return [bottom < low ? bottom - room : low, top > high ? top + room : high];
}

function drawLimits(svg, entries, low, high, y, width) {
  const above = entries.filter(([, value]) => value >= high), below = entries.filter(([, value]) => value <= low);
  const text = ([name, value]) => `${name} ${withUnit(Number(value.toPrecision(6)).toString().replace("-", "−"), facts.unit)}`;
  for (const each of entries) {
    const [name, value] = each;
    if (above.includes(each) || below.includes(each)) continue;
    const place = y(value), under = place < TOP + 20;
    svg.append(drawn("line", { class: `limit ${name}`, x1: LEFT, x2: width - RIGHT, y1: place, y2: place }));
    svg.append(drawn("text", { class: "limit-name", x: LEFT + 6, y: place + (under ? 15 : -5) }, text(each)));
  }
  above.forEach((each, k) => svg.append(
    drawn("text", { class: "limit-name", x: width - RIGHT - 4, y: TOP + 14 + 16 * k, "text-anchor": "end" }, `↑ ${text(each)}`)));
  below.forEach((each, k) => svg.append(
    drawn("text", { class: "limit-name", x: width - RIGHT - 4, y: y(low) - 6 - 16 * k, "text-anchor": "end" }, `↓ ${text(each)}`)));
}

function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((each) => each >= rough);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), positions = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) positions.push(k * step);
  return positions.map((value) => [value, fixed(value === 0 ? 0 : value, digits)]);
}

function range(curves) {
  let low = Infinity, high = -Infinity;
  for (const values of curves) for (const value of values) if (value !== null) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return [0, 1];
  const room = (high - low) * 0.06 || Math.max(Math.abs(high) * 0.01, 10 ** -facts.digits);
  return [low - room, high + room];
}

function path(times, values, x, y) {
  let text = "", pen = "M";
  values.forEach((value, k) => {
    if (value === null) { pen = "M"; return; }
    text += `${pen}${x(times[k]).toFixed(1)} ${y(value).toFixed(1)}`;
    pen = "L";
  });
  return text;
}

function lanes(svg, picture, visible, flags, x, top, width) {
  flags.forEach(([flag, bit], lane) => {
    const y = top + lane * LANE;
    svg.append(drawn("rect", { class: "lane", x: LEFT, y: y + 2, width: width - LEFT - RIGHT, height: LANE - 4 }));
    const mask = 1 << bit, times = picture.times;
    let start = null;
    times.forEach((time, k) => {
      const raised = visible.some((channel) => picture.status[channel][k] & mask);
      if (raised && start === null) start = k;
      if (start !== null && (!raised || k === times.length - 1)) {
        const from = x(times[Math.max(start - 1, 0)]), to = x(raised ? time : times[k - 1]);
        svg.append(drawn("rect", { class: SEVERE.has(flag) ? "raised severe" : "raised", x: from, y: y + 2, width: Math.max(to - from, 2), height: LANE - 4 }));
        start = null;
      }
    });
    svg.append(drawn("text", { x: LEFT + 6, y: y + 14 }, spaced(flag)));
  });
}

function draw() {
  const place = byId("plot"), width = place.clientWidth, picture = shown;
  if (!picture || picture.times.length < 2 || width < 100) return;
  const what = curve(), all = series(picture, what);
  const visible = all.map((_, k) => k).filter((k) => !hidden.has(k));
  const flags = Object.entries(facts.flags).filter(([, bit]) => picture.status.some((each) => each.some((status) => status >> bit & 1)));
  const bottom = TOP + Math.max(220, Math.min(320, width * 0.45)), height = bottom + AXIS + flags.length * LANE + 4;
  const bounds = limits(what, visible), times = picture.times;
  const [low, high] = withLimits(range(visible.map((k) => all[k])), bounds.map(([, value]) => value));
  const end = times.at(-1), unit = end >= 7200 ? [3600, "h"] : end >= 120 ? [60, "min"] : [1, "s"];
  const x = (time) => LEFT + (time - times[0]) / (end - times[0]) * (width - LEFT - RIGHT);
  const y = (value) => bottom - (value - low) / (high - low) * (bottom - TOP);
  const svg = drawn("svg", { viewBox: `0 0 ${width} ${height}`, width, height });
  for (const [value, text] of ticks(low, high, 5)) {
    svg.append(drawn("line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value) }));
    svg.append(drawn("text", { x: LEFT - 8, y: y(value) + 4.5, "text-anchor": "end" }, text));
  }
  for (const [value, text] of ticks(times[0] / unit[0], end / unit[0], width < 500 ? 3 : 7)) {
    svg.append(drawn("text", { x: x(value * unit[0]), y: bottom + 19, "text-anchor": "middle" }, text));
  }
  svg.append(drawn("text", { x: LEFT - 8, y: bottom + 19, "text-anchor": "end" }, unit[1]));
  const label = what === "value" ? withUnit(facts.quantity, facts.unit && `in ${facts.unit}`) : what === "rate" ? `rate in ${perHour}` : `wear in ${facts.unit}`;
  svg.append(drawn("text", { class: "strong", x: LEFT, y: 14 }, label));
  for (const k of visible) {
    const line = drawn("path", { class: "line", d: path(times, all[k], x, y) });
    line.style.stroke = colour(k);
    if (k >= 8) line.style.strokeDasharray = "7 4";
    svg.append(line);
  }
  drawLimits(svg, bounds, low, high, y, width);
  lanes(svg, picture, visible, flags, x, bottom + AXIS, width);
  if (cursor !== null) {
    cursor = Math.max(0, Math.min(cursor, times.length - 1));
    svg.append(drawn("line", { class: "cursor", x1: x(times[cursor]), x2: x(times[cursor]), y1: TOP, y2: bottom }));
    const digits = what === "value" ? facts.digits : 3;
    const read = visible.map((k) => (all.length > 1 ? `${k}: ` : "") + fixed(all[k][cursor], digits));
    byId("cursor").textContent = `At ${clock(times[cursor])}, ${label}: ${read.join(" · ")}`;
  }
  place.replaceChildren(svg);
}

// ---- What the reader does

const plot = byId("plot");

plot.addEventListener("pointermove", (event) => {
  if (!shown || shown.times.length < 2) return;
  const box = plot.getBoundingClientRect(), part = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
  const time = shown.times[0] + part * (shown.times.at(-1) - shown.times[0]);
  cursor = shown.times.reduce((best, each, k) => (Math.abs(each - time) < Math.abs(shown.times[best] - time) ? k : best), 0);
  draw();
});

plot.addEventListener("keydown", (event) => {
  if (!shown) return;
  const last = shown.times.length - 1, from = cursor === null ? last : cursor;
  const to = { ArrowLeft: from - 1, ArrowRight: from + 1, PageUp: from - 20, PageDown: from + 20, Home: 0, End: last }[event.key];
  if (to === undefined && event.key !== "Escape") return;
  cursor = to === undefined ? null : to;
  event.preventDefault();
  draw();
});

byId("controls").addEventListener("change", draw);
byId("controls").addEventListener("submit", (event) => event.preventDefault());
byId("hold").addEventListener("click", () => {
  held = !held;
  byId("hold").setAttribute("aria-pressed", `${held}`);
  if (!held && newest) show(newest);
});
new ResizeObserver(draw).observe(plot);

// ---- What comes from the monitor

function show(picture) {
  shown = picture;
  verdict(picture, false);
  tiles(picture);
  channels(picture);
  alarms(picture);
  draw();
}

function listen(wait) {
  const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${location.pathname}live`);
  socket.addEventListener("message", (event) => {
    newest = JSON.parse(event.data);
    wait = 1;
    // An end is shown even while the page holds still: nothing else would come.
    if (!held || newest.state === "ended") show(newest);
  });
  socket.addEventListener("close", () => {
    if (newest && newest.state === "ended") return;
    verdict(newest, true);
    setTimeout(listen, wait * 1000, Math.min(2 * wait, 10));
  });
}

header("channels", [
  ["channel", false],
  [withUnit(facts.quantity, facts.unit && `(${facts.unit})`), true],
  ...(facts.initial ? [[`wear (${facts.unit})`, true]] : []),
  ...(facts.rated ? [[`rate (${perHour})`, true]] : []),
  ["flags", false],
]);
header("alarms", [["time", false], ["channel", true], [withUnit(facts.quantity, facts.unit && `(${facts.unit})`), true], ["flag", false]]);
byId("alarms").hidden = true;
listen(1);
