// The samples of the run, to zoom into and to read out. Without this script the page shows the same as pictures.
"use strict";
(() => {
  const root = document.getElementById("viewer");
  const canvas = root.querySelector("canvas");
  const readout = root.querySelector(".readout");
  const data = JSON.parse(document.getElementById("samples").textContent);

  function unpack(packed) {
    if (packed === null) return null;
    const text = atob(packed.data), count = text.length / packed.bytes, values = new Float64Array(count);
    for (let i = 0; i < count; i++) {
      let integer = 0;
      for (let k = packed.bytes - 1; k >= 0; k--) integer = integer * 256 + text.charCodeAt(i * packed.bytes + k);
      values[i] = packed.low + packed.step * integer;
    }
    return values;
  }

  const index = unpack(data.index), code = unpack(data.code), error = unpack(data.error);
  const truth = unpack(data.truth), unfiltered = unpack(data.unfiltered);
  const hardware = code.map((each) => data.zero + data.lsb * each);
  const golden = hardware.map((each, i) => each - error[i]);
  const apart = truth && hardware.map((each, i) => each - truth[i]);
  const count = index.length, last = data.samples - 1;
  const label = (words, unit) => unit ? `${words} in ${unit}` : words;

  const panels = [
    {
      share: 3, factor: data.value[0], title: label("output", data.value[1]), lines: [
        [unfiltered, "unfiltered", 1], [truth, "truth", 4], [golden, "golden", 3], [hardware, "hardware", 1.6],
      ].filter((line) => line[0]), limits: [],
    },
    ...(apart ? [{
      share: 1.6, factor: data.true_error[0], title: label("minus true value", data.true_error[1]),
      lines: [[apart, "hardware", 1.4]], limits: [[0, "truth"]],
    }] : []),
    {
      share: 1.6, factor: data.fine[0], title: label("error", data.fine[1]), lines: [[error, "hardware", 1.4]],
      limits: data.limits.flatMap(([value, role]) => [[value, role], [-value, role]]),
    },
  ];

  // Samples of the run at the left and right edge, and the point that is read out.
  let from = data.focus[0], to = Math.max(data.focus[1], from + 1), cursor = worst();
  let dragged = null;

  function worst() {
    let largest = 0;
    for (let i = 1; i < count; i++) if (Math.abs(error[i]) > Math.abs(error[largest])) largest = i;
    return largest;
  }

  // The first point at or after a sample.
  function after(sample) {
    let low = 0, high = count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (index[middle] < sample) low = middle + 1; else high = middle;
    }
    return low;
  }

  function nearest(sample) {
    const right = Math.min(after(sample), count - 1), left = Math.max(right - 1, 0);
    return sample - index[left] < index[right] - sample ? left : right;
  }

  function show(first, second) {
    const span = Math.min(Math.max(second - first, Math.min(8, last)), Math.max(last, 1));
    const middle = (first + second) / 2;
    from = Math.min(Math.max(middle - span / 2, 0), Math.max(last - span, 0));
    to = from + span;
    draw();
  }

  function zoom(factor, around) {
    show(around - (around - from) * factor, around + (to - around) * factor);
  }

  function round(value, digits) {
    return value.toLocaleString("en", { maximumSignificantDigits: digits }).replace("-", "−");
  }

  function measure(value, [factor, unit]) {
    return `${round(value * factor, 4)} ${unit.startsWith("10") ? "× " : ""}${unit}`.trim();
  }

  function say() {
    const i = cursor, places = Math.max(0, Math.ceil(-Math.log10(data.step || 1)) + 1);
    const seconds = (data.start + data.step * index[i]).toFixed(Math.min(places, 9));
    const parts = [
      `time ${seconds} s`, `sample ${index[i].toLocaleString("en")}`,
      `code ${code[i].toLocaleString("en").replace("-", "−")}`, measure(hardware[i], data.value),
      `error ${measure(error[i], data.fine)} = ${round(error[i] / data.lsb, 3)} LSB`,
    ];
    if (apart) parts.push(`minus true value ${measure(apart[i], data.true_error)}`);
    readout.textContent = parts.join(" · ");
  }

  function ticks(low, high, wanted) {
    const rough = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((each) => each * power >= rough * 0.999);
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), labelled = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high * (1 + 1e-12) + 1e-12 * step; k++) {
      labelled.push([k * step, (k * step).toFixed(Math.min(places, 12)).replace("-", "−")]);
    }
    return labelled;
  }

  const margin = { left: 74, right: 10, top: 8, gap: 16, bottom: 40 };
  let width = 0, height = 0;
  const x = (sample) => margin.left + (sample - from) / (to - from) * (width - margin.left - margin.right);
  const sampleAt = (place) => from + (place - margin.left) / (width - margin.left - margin.right) * (to - from);

  function draw() {
    const ratio = window.devicePixelRatio || 1, style = getComputedStyle(root);
    const colour = (role) => style.getPropertyValue(`--${role}`);
    width = canvas.clientWidth;
    height = canvas.clientHeight;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = `12px ${style.fontFamily}`;
    const first = Math.max(after(from) - 1, 0), end = Math.min(after(to) + 1, count);
    const shares = panels.reduce((sum, panel) => sum + panel.share, 0);
    const room = height - margin.top - margin.bottom - margin.gap * (panels.length - 1);
    let top = margin.top;
    for (const panel of panels) {
      const tall = room * panel.share / shares;
      paint(pen, panel, top, tall, first, end, colour);
      top += tall + margin.gap;
    }
    const bottom = height - margin.bottom, time = (sample) => data.start + data.step * sample;
    pen.fillStyle = colour("ink");
    pen.textAlign = "center";
    for (const [value, words] of ticks(time(from), time(to), Math.max(2, width / 110))) {
      pen.fillText(words, x((value - data.start) / (data.step || 1)), bottom + 17);
    }
    pen.fillText("time in s", (margin.left + width) / 2, bottom + 35);
    pen.strokeStyle = colour("ink");
    pen.lineWidth = 1;
    const place = x(index[cursor]);
    if (place >= margin.left && place <= width - margin.right) line(pen, place, margin.top, place, bottom);
    if (dragged && dragged.to !== null) {
      pen.fillStyle = colour("hardware");
      pen.globalAlpha = 0.15;
      pen.fillRect(dragged.from, margin.top, dragged.to - dragged.from, bottom - margin.top);
      pen.globalAlpha = 1;
    }
    say();
  }

  function line(pen, x0, y0, x1, y1) {
    pen.beginPath();
    pen.moveTo(x0, y0);
    pen.lineTo(x1, y1);
    pen.stroke();
  }

  function paint(pen, panel, top, tall, first, end, colour) {
    let low = Infinity, high = -Infinity;
    for (const [values] of panel.lines) {
      for (let i = first; i < end; i++) {
        low = Math.min(low, values[i]);
        high = Math.max(high, values[i]);
      }
    }
    for (const [value] of panel.limits) [low, high] = [Math.min(low, value), Math.max(high, value)];
    const space = 0.08 * (high - low) || Math.abs(high) || data.lsb;
    [low, high] = [low - space, high + space];
    const y = (value) => top + (high - value) / (high - low) * tall;
    const right = width - margin.right;
    if (data.transient > from) {
      pen.fillStyle = colour("muted");
      pen.globalAlpha = 0.14;
      pen.fillRect(margin.left, top, Math.min(x(data.transient), right) - margin.left, tall);
      pen.globalAlpha = 1;
    }
    pen.textAlign = "right";
    pen.lineWidth = 1;
    for (const [value, words] of ticks(low * panel.factor, high * panel.factor, Math.max(2, tall / 26))) {
      const place = y(value / panel.factor);
      pen.strokeStyle = colour("grid");
      line(pen, margin.left, place, right, place);
      pen.fillStyle = colour("ink");
      pen.fillText(words, margin.left - 7, place + 4);
    }
    pen.save();
    pen.translate(12, top + tall / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillText(panel.title, 0, 0);
    pen.restore();
    pen.save();
    pen.beginPath();
    pen.rect(margin.left, top, right - margin.left, tall);
    pen.clip();
    for (const [value, role] of panel.limits) {
      pen.strokeStyle = colour(role);
      pen.setLineDash(role === "truth" ? [] : [6, 4]);
      line(pen, margin.left, y(value), right, y(value));
      pen.setLineDash([]);
    }
    for (const [values, role, thick] of panel.lines) {
      pen.strokeStyle = pen.fillStyle = colour(role);
      pen.lineWidth = thick;
      pen.lineJoin = "round";
      curve(pen, values, y, first, end);
      if (role === "hardware" && end - first < (right - margin.left) / 8) dots(pen, values, y, first, end);
    }
    pen.restore();
    pen.strokeStyle = colour("muted");
    pen.lineWidth = 1;
    line(pen, margin.left, top, margin.left, top + tall);
    line(pen, margin.left, top + tall, right, top + tall);
  }

  // Every point, or where they are more than the pixels, the smallest and the largest of each column.
  function curve(pen, values, y, first, end) {
    pen.beginPath();
    const columns = width - margin.left - margin.right;
    if (end - first <= 3 * columns) {
      for (let i = first; i < end; i++) pen.lineTo(x(index[i]), y(values[i]));
    } else {
      let i = first;
      while (i < end) {
        const place = Math.floor(x(index[i]));
        let low = values[i], high = low;
        for (; i < end && Math.floor(x(index[i])) === place; i++) {
          low = Math.min(low, values[i]);
          high = Math.max(high, values[i]);
        }
        pen.lineTo(place, y(low));
        pen.lineTo(place, y(high));
      }
    }
    pen.stroke();
  }

  function dots(pen, values, y, first, end) {
    for (let i = first; i < end; i++) {
      pen.beginPath();
      pen.arc(x(index[i]), y(values[i]), 3, 0, 2 * Math.PI);
      pen.fill();
    }
  }

  function point(event) {
    cursor = nearest(sampleAt(event.offsetX));
  }

  canvas.addEventListener("pointerdown", (event) => {
    point(event);
    if (event.pointerType === "mouse") {
      dragged = { from: event.offsetX, to: null };
      canvas.setPointerCapture(event.pointerId);
    }
    draw();
  });
  canvas.addEventListener("pointermove", (event) => {
    point(event);
    if (dragged) dragged.to = Math.abs(event.offsetX - dragged.from) > 4 ? event.offsetX : null;
    draw();
  });
  canvas.addEventListener("pointerup", () => {
    const drawn = dragged;
    dragged = null;
    if (drawn && drawn.to !== null) {
      show(sampleAt(Math.min(drawn.from, drawn.to)), sampleAt(Math.max(drawn.from, drawn.to)));
    }
  });
  canvas.addEventListener("dblclick", () => show(0, last));
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return; // the page scrolls
    event.preventDefault();
    zoom(event.deltaY < 0 ? 0.8 : 1.25, sampleAt(event.offsetX));
  }, { passive: false });

  const acts = {
    in: () => zoom(0.5, (from + to) / 2),
    out: () => zoom(2, (from + to) / 2),
    left: () => show(from - (to - from) / 3, to - (to - from) / 3),
    right: () => show(from + (to - from) / 3, to + (to - from) / 3),
    all: () => show(0, last),
    worst: () => {
      cursor = worst();
      show(data.focus[0], data.focus[1]);
    },
  };
  for (const button of root.querySelectorAll("button")) button.addEventListener("click", acts[button.value]);
  canvas.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const act = { "+": acts.in, "=": acts.in, "-": acts.out, "0": acts.all, PageUp: acts.left, PageDown: acts.right, Home: acts.worst };
    if (by) {
      cursor = Math.min(Math.max(cursor + by, 0), count - 1);
      if (index[cursor] < from) acts.left(); else if (index[cursor] > to) acts.right(); else draw();
    } else if (act[event.key]) {
      act[event.key]();
    } else {
      return;
    }
    event.preventDefault();
  });

  document.documentElement.classList.add("scripted");
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  draw();
})();

// On paper nothing is folded up.
addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details:not([open])")) {
    details.open = true;
    addEventListener("afterprint", () => { details.open = false; }, { once: true });
  }
});
