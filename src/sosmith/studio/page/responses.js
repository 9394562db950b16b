// ---- Responses of the stage that is shown

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
  const { response, rate, filter } = seen(), half = rate / 2, where = byId("gain");
  const stop = numbers(ask("filter.stopband_loss"))[0] || 0;
  const lowest = Math.max(response.f[0], Math.min(...[...numbers(filter.cutoff), ...numbers(ask("filter.passband_edge")), half / 2].filter((f) => f > 0)) / 30);
  const auto = { x: [10 ** (Math.floor(Math.log10(lowest) * 2) / 2), half], y: [-Math.max(80, Math.ceil((stop + 20) / 20) * 20), 6] };
  const { x, y } = frozen || auto;
  const to = axes(where, { x, y, logarithmic: true, xUnit: "Hz", yUnit: "dB", height: Math.max(300, Math.min(400, where.clientWidth * 0.6)) });
  if (form() === "mask") {
    const box = (from, until, top, bottom) => {
      const left = to.x(Math.max(from, x[0])), right = to.x(Math.min(Math.max(until, x[0]), x[1]));
      if (right > left) to.layer.append(drawn("rect", { class: "mask", x: left, width: right - left, y: to.y(top), height: Math.max(to.y(bottom) - to.y(top), 0) }));
    };
    for (const [from, until] of filter.passbands) box(from, until, -ask("filter.passband_loss") || 0, y[0]);
    for (const [from, until] of filter.stopbands) box(from, until, y[1], -stop);
  }
  curve(to, "ideal", response.f, response.db);
  const integer = isProven() && provenStage();
  if (integer) curve(to, "integer", integer.f, integer.db);
  scales = to;
  redrawn(where, to, "Gain over frequency").setAttribute("role", "group");
  where.classList.toggle("old", known.preview.error !== null);
  const level = Math.abs(response.level) < 5e-4 ? "" : `relative to ${short(response.level, 4)} dB`;
  say("level", level && byId("stagefacts").textContent ? `, ${level}` : level);
  byId("masklegend").hidden = form() !== "mask";
  byId("gainhint").hidden = !wanted().length;
  place();
}

function step() {
  const { step: { t, y }, filter } = seen();
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
  const { response, filter } = seen(), where = byId("delay");
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
  const { poles, zeros } = seen().plane, where = byId("plane"), width = Math.max(where.clientWidth, 240);
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
