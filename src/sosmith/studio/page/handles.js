// ---- Handles on the gain

const handles = new Map();
let scales = null, dragged = null, frozen = null;

function wanted() {
  if (!seen()) return [];
  const now = form(), filter = seen().filter;
  const losses = { passband_edge: "filter.passband_loss", stopband_edge: "filter.stopband_loss" };
  const keys = now === "order" ? ["cutoff"] : now === "mask" ? ["passband_edge", "stopband_edge"] : [];
  return keys.flatMap((key) => {
    const all = numbers(ask(`filter.${key}`)).filter((f) => typeof f === "number");
    return all.map((f, at) => {
      const loss = losses[key], names = all.length > 1 ? [", lower", ", upper"] : [""];
      return {
        id: `${key}${at}`, at, path: pathOf(`filter.${key}`), loss: loss && pathOf(loss), f, count: all.length,
        db: loss ? -ask(loss) || 0 : at_frequency(f), name: key.replace("_", " ") + names[at], filter,
      };
    });
  });
}

function at_frequency(f) {
  const { f: grid, db } = seen().response;
  let best = 0;
  grid.forEach((value, k) => { if (Math.abs(value - f) < Math.abs(grid[best] - f)) best = k; });
  return db[best];
}

function settle(one, f, db) {
  const half = seen().rate / 2, changes = {};
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
    const x = scales.x(Math.min(Math.max(one.f, scales.range.x[0]), scales.range.x[1])), y = scales.y(Math.max(low, Math.min(high, one.db)));
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
    const half = seen().rate / 2;
    for (const [key, value] of Object.entries({ "aria-label": one.name, "aria-valuemin": 0, "aria-valuemax": half, "aria-valuenow": one.f, "aria-valuetext": words })) {
      group.setAttribute(key, value);
    }
  }
}
