"use strict";
// ---- Drawing: axes and curves as SVG

const LEFT = 58, RIGHT = 14, TOP = 12, BOTTOM = 34;

function drawn(name, attributes, text = "") {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text) node.textContent = text;
  return node;
}

const minus = (text) => `${text}`.replace("-", "−");

// A number as a reader takes it in: some significant digits, no trailing zeros, powers of ten where it is very small.
function short(value, digits = 4) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) {
    const [mantissa, power] = value.toExponential(digits - 1).split("e");
    return minus(`${Number(mantissa)} × 10`) + superscript(Number(power));
  }
  return minus(Number(value.toPrecision(digits)).toLocaleString("en", { maximumSignificantDigits: digits }));
}

// Seconds in the unit in which a number of this size is read.
function inTime(size) {
  const [factor, unit] = [[1, "s"], [1e3, "ms"], [1e6, "µs"], [1e9, "ns"]].find(([each]) => size * each >= 0.5) || [1, "s"];
  return { factor, unit, text: (value, digits = 4) => `${short(value * factor, digits)} ${unit}` };
}

const superscript = (power) => [...`${power}`].map((each) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[each] ?? "⁻").join("");

function evenTicks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((each) => each >= rough * 0.999);
  const positions = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) positions.push(k * step);
  return positions.map((value) => [value, short(Math.abs(value) < step / 1e6 ? 0 : value, 6), true]);
}

function decadeTicks(low, high) {
  const labelled = [];
  for (let power = Math.floor(Math.log10(low)); 10 ** power <= high; power++) {
    for (let k = 1; k < 10; k++) {
      const value = k * 10 ** power;
      if (value >= low * 0.9999 && value <= high * 1.0001) labelled.push([value, k === 1 ? short(value) : "", k === 1]);
    }
  }
  return labelled;
}

// Axes in a place of the page: returns the layer for curves, and the scales.
function axes(place, { x: [x0, x1], y: [y0, y1], logarithmic = false, xUnit = "", yUnit = "", height = 230 }) {
  const width = Math.max(place.clientWidth, 240), bottom = height - BOTTOM;
  const along = logarithmic ? Math.log : (value) => value;
  const x = (value) => LEFT + ((along(value) - along(x0)) / (along(x1) - along(x0))) * (width - LEFT - RIGHT);
  const y = (value) => bottom - ((value - y0) / (y1 - y0)) * (bottom - TOP);
  const layer = drawn("g", {});
  for (const [value, text] of evenTicks(y0, y1, Math.max(2, Math.floor(height / 55)))) {
    layer.append(drawn("line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value) }));
    layer.append(drawn("text", { x: LEFT - 7, y: y(value) + 4.5, "text-anchor": "end" }, text));
  }
  const marks = logarithmic ? decadeTicks(x0, x1) : evenTicks(x0, x1, Math.max(2, Math.floor(width / 110)));
  let right = -Infinity;
  for (const [value, text, major] of marks) {
    layer.append(drawn("line", { class: "grid", x1: x(value), x2: x(value), y1: major ? TOP : bottom - 5, y2: bottom }));
    const room = text.length * 4;
    if (text && x(value) - room > right && x(value) + room < width - 26) {
      layer.append(drawn("text", { x: x(value), y: bottom + 18, "text-anchor": "middle" }, text));
      right = x(value) + room + 6;
    }
  }
  layer.append(drawn("text", { x: width - 2, y: bottom + 18, "text-anchor": "end" }, xUnit));
  layer.append(drawn("text", { x: 2, y: TOP + 4 }, yUnit));
  const inverse = (pixel) => {
    const part = (pixel - LEFT) / (width - LEFT - RIGHT);
    return logarithmic ? x0 * (x1 / x0) ** part : x0 + part * (x1 - x0);
  };
  const level = (pixel) => y0 + ((bottom - pixel) / (bottom - TOP)) * (y1 - y0);
  return { layer, x, y, inverse, level, width, height, bottom, range: { x: [x0, x1], y: [y0, y1] } };
}

function curve(to, name, xs, ys) {
  const [low, high] = to.range.y, room = 3 * (high - low);
  let text = "", pen = "M";
  xs.forEach((value, k) => {
    const level = ys[k];
    if (level === null || level === undefined || value < to.range.x[0] * 0.999) { pen = "M"; return; }
    text += `${pen}${to.x(value).toFixed(1)} ${to.y(Math.max(low - room, Math.min(high + room, level))).toFixed(1)}`;
    pen = "L";
  });
  to.layer.append(drawn("path", { class: `line ${name}`, d: text }));
}

// What is drawn beyond the axes is cut off.
let clips = 0;
function shown(place, to, label) {
  const svg = drawn("svg", { viewBox: `0 0 ${to.width} ${to.height}`, width: to.width, height: to.height, role: "img", "aria-label": label });
  const clip = drawn("clipPath", { id: `clip${++clips}` });
  clip.append(drawn("rect", { x: LEFT, y: TOP - 1, width: to.width - LEFT - RIGHT, height: to.bottom - TOP + 2 }));
  svg.append(clip, to.layer);
  for (const each of to.layer.querySelectorAll(".line, .mask, .edge")) each.setAttribute("clip-path", `url(#clip${clips})`);
  place.replaceChildren(svg);
  return svg;
}

function span(values, room = 0.05) {
  const finite = values.filter((value) => value !== null && value !== undefined);
  let low = Math.min(...finite), high = Math.max(...finite);
  if (!finite.length) [low, high] = [0, 1];
  const more = (high - low) * room || Math.abs(high) * 0.05 || 1;
  return [low - more, high + more];
}
