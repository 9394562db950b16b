// ---- The list of stages: chosen, dragged, added and removed

const items = []; // [{ name, item }], in the order of the stages
const inHz = (value) => (typeof value === "number" ? `${value >= 1e6 ? `${short(value / 1e6, 6)} M` : value >= 1e3 ? `${short(value / 1e3, 6)} k` : `${short(value, 6)} `}Hz` : "–");
const rearrange = (what, more) => send({ do: "stages", what, ...more });

// What was typed is for the stage that was shown then, not for the one that is shown next.
function leaveField() {
  clearTimeout(typing);
  typed = null;
}

function choose(k) {
  if (!isChain()) { chosen = 0; return; }
  chosen = Math.max(0, Math.min(k, tables().length - 1));
  if (known.realizations && known.realizations.state !== "off") send({ do: "realizations", on: true, stage: chosen });
}

// After a change, the same stage is shown as before: by its name, or by its place if it was renamed.
let chosenName, expected = null, countBefore = 0;
function settleChoice() {
  const names = tables().map((each) => each.name), before = chosen;
  if (!names.includes(chosenName) && names.length !== countBefore) leaveField();
  countBefore = names.length;
  if (expected !== null && names.length > expected.count) { chosen = expected.at; expected = null; }
  else if (names.includes(chosenName)) chosen = names.indexOf(chosenName);
  chosen = Math.max(0, Math.min(chosen, names.length - 1));
  chosenName = names[chosen];
  if (before !== chosen && known.realizations && known.realizations.state !== "off") send({ do: "realizations", on: true, stage: chosen });
}

function show(k) {
  leaveField();
  choose(k);
  chosenName = table().name;
  picture();
  stages();
  proven();
  realizations();
}

function announce(text) { byId("stagessaid").textContent = text; }

function moveStage(from, to) {
  if (to < 0 || to >= tables().length || from === to) return;
  announce(`${tables()[from].name} is stage ${to + 1} of ${tables().length}.`);
  rearrange("move", { at: from, to });
}

function removeStage(k) {
  announce(`${tables()[k].name} is removed; Undo brings it back.`);
  rearrange("remove", { at: k });
}

function row() {
  const item = element("li", "", { class: "stage" });
  const grip = element("span", "⠿", { class: "grip", "aria-hidden": "true", title: "Drag to another place" });
  const pick = element("button", "", { type: "button", class: "pick" });
  pick.append(element("strong"), element("small"), element("span", "", { class: "rate" }));
  const figures = element("div", "", { class: "measures" });
  const actions = element("div", "", { class: "actions" });
  for (const [name, sign] of [["earlier", "↑"], ["later", "↓"], ["remove", "✕"]]) actions.append(element("button", sign, { type: "button", class: name }));
  item.append(grip, pick, figures, actions, element("p", "", { class: "problem" }));
  const place = () => items.findIndex((each) => each.item === item);
  pick.addEventListener("click", () => show(place()));
  actions.querySelector(".earlier").addEventListener("click", () => moveStage(place(), place() - 1));
  actions.querySelector(".later").addEventListener("click", () => moveStage(place(), place() + 1));
  actions.querySelector(".remove").addEventListener("click", () => removeStage(place()));
  item.addEventListener("keydown", (event) => {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!step || !event.altKey) return;
    event.preventDefault();
    moveStage(place(), place() + step);
  });
  drags(item, grip, place);
  return item;
}

// A stage follows the pointer, and the others make room; nothing is changed before it is let go.
let held = null;
function drags(item, grip, place) {
  const target = (event) => {
    const middle = held.middle + event.clientY + scrollY - held.y;
    return held.others.filter((each) => each < middle).length;
  };
  grip.addEventListener("pointerdown", (event) => {
    if (event.button || !known.document.readable) return;
    event.preventDefault();
    grip.setPointerCapture(event.pointerId);
    const boxes = items.map((each) => each.item.getBoundingClientRect()), own = boxes[place()], middle = (box) => box.top + box.height / 2 + scrollY;
    held = { item, from: place(), to: place(), y: event.clientY + scrollY, middle: middle(own), height: own.height + 6, others: boxes.filter((box) => box !== own).map(middle), names: tables().map((each) => each.name).join() };
    item.classList.add("held");
    byId("stages").classList.add("moving");
  });
  grip.addEventListener("pointermove", (event) => {
    if (!held || held.item !== item) return;
    held.to = target(event);
    item.style.transform = `translateY(${event.clientY + scrollY - held.y}px)`;
    items.forEach((each, k) => {
      if (each.item === item) return;
      const moves = k > held.from && k <= held.to ? -1 : k < held.from && k >= held.to ? 1 : 0;
      each.item.style.transform = moves ? `translateY(${moves * held.height}px)` : "";
    });
  });
  grip.addEventListener("pointerup", () => {
    if (!held || held.item !== item) return;
    const { from, to } = held;
    letGo();
    moveStage(from, to);
  });
  for (const name of ["pointercancel", "lostpointercapture"]) grip.addEventListener(name, () => { if (held && held.item === item) letGo(); });
}

function letGo() {
  held.item.classList.remove("held");
  byId("stages").classList.remove("moving");
  held = null;
  for (const { item } of items) item.style.transform = "";
}
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && held) letGo(); });

const what = (stage) => {
  const how = stage.decimate > 1 ? `1 of ${stage.decimate}` : stage.interpolate > 1 ? `${stage.interpolate} of 1` : "";
  return [stage.kind, how].filter(Boolean).join(", ");
};

function measures(stage, result, isOld) {
  const of = result && result.chain && result.stages.find((each) => each.name === stage.name), made = [];
  if (!of) return made;
  const part = of.share / result.allowed, meter = element("div", "", { class: "meter" }), bar = element("i");
  bar.style.width = `${Math.min(100, 100 * part)}%`;
  meter.append(bar);
  const share = element("div");
  share.append(element("span", `${short(100 * part, 3)} % of the error`), meter);
  made.push(share, element("div", `${of.bits} bits out`), element("div", `${of.cost.luts.toLocaleString("en")} LUT4`), element("div", counted(of.cost.multipliers, "multiplier")));
  for (const each of made) each.classList.toggle("old", isOld);
  return made;
}

function stages() {
  const { document: doc, preview, proof } = known;
  byId("stagelist").hidden = !isChain();
  byId("splitting").hidden = isChain() || !doc || !doc.readable;
  if (!isChain()) { items.splice(0).forEach(({ item }) => item.remove()); return; }
  const all = tables(), list = byId("stages"), focused = document.activeElement;
  if (held && held.names !== all.map((each) => each.name).join()) letGo();
  const free = items.splice(0);
  for (const stage of all) {
    const at = free.findIndex((each) => each.name === stage.name);
    items.push({ name: stage.name, item: at < 0 ? row() : free.splice(at, 1)[0].item });
  }
  for (const { item } of free) item.remove();
  items.forEach(({ item }, k) => { if (list.children[k] !== item) list.insertBefore(item, list.children[k] || null); });
  if (focused && focused !== document.activeElement && focused.isConnected) focused.focus({ preventScroll: true });
  const wrong = preview && preview.error ? preview.wrong : proof && proof.state === "refused" ? proof.wrong : [];
  const isOld = !isProven();
  items.forEach(({ item }, k) => {
    const stage = all[k], [before, after] = doc.stages[k], name = `${stage.name ?? "without a name"}`;
    const pick = item.querySelector(".pick");
    pick.querySelector("strong").textContent = name;
    pick.querySelector("small").textContent = what(stage);
    pick.querySelector(".rate").textContent = `${inHz(before)} → ${inHz(after)}`;
    pick.setAttribute("aria-pressed", `${k === chosen}`);
    item.classList.toggle("chosen", k === chosen);
    item.classList.toggle("wrong", Boolean(wrong[k]));
    item.querySelector(".problem").textContent = wrong[k] || "";
    item.querySelector(".measures").replaceChildren(...measures(stage, known.design, isOld));
    for (const [action, off] of [["earlier", k === 0], ["later", k === all.length - 1], ["remove", false]]) {
      const button = item.querySelector(`.${action}`);
      button.disabled = off || !doc.readable;
      button.setAttribute("aria-label", `${action === "remove" ? "Remove" : "Move"} ${name}${action === "remove" ? "" : ` ${action}`}`);
    }
  });
  adding(all);
  byId("takechosen").hidden = !(isProven() && known.design.chosen && all.some((each) => each.kind === "auto"));
}

// The stage that the proof is at.
function working() {
  const { proof } = known, at = proof && proof.state === "working" ? (/^stage ([^:]+)/.exec(proof.step) || [])[1] : null;
  for (const { name, item } of items) item.classList.toggle("working", at === name);
}

// Kinds of stages that there can be one more of.
function adding(all) {
  const field = byId("newkind"), chosenKind = field.value;
  const kinds = kindsAt(0, all.length + 1).filter((name) => name !== "auto" || !all.length).filter((name) => name !== "polynomial" || all.every((each) => each.kind !== name));
  if ([...field.options].map((each) => each.value).join() !== kinds.join()) {
    field.replaceChildren(...kinds.map((name) => element("option", name, { value: name })));
    field.value = kinds.includes(chosenKind) ? chosenKind : kinds.includes("fir") ? "fir" : kinds[0];
  }
  byId("addstage").disabled = !known.document.readable || all.length >= 8 || all.some((each) => each.kind === "auto");
  say("nostages", all.length ? "" : "There is no stage yet: add one.");
}

byId("addstage").addEventListener("click", () => {
  const made = byId("newkind").value, count = tables().length, at = made === "polynomial" || !count ? 0 : chosen + 1;
  expected = { at, count };
  announce(`A stage ${made} is added as number ${at + 1}.`);
  rearrange("add", { kind: made, at });
});
byId("split").addEventListener("click", () => rearrange("split", {}));
byId("takechosen").addEventListener("click", () => rearrange("chosen", {}));

// ---- Undo

byId("undo").addEventListener("click", () => send({ do: "undo" }));
byId("redo").addEventListener("click", () => send({ do: "redo" }));
document.addEventListener("keydown", (event) => {
  const key = event.key.toLowerCase();
  if (!(event.ctrlKey || event.metaKey) || event.altKey || !["z", "y"].includes(key)) return;
  if (event.target.matches("input, textarea")) return; // which undo what was typed in them
  event.preventDefault();
  send({ do: key === "y" || event.shiftKey ? "redo" : "undo" });
});
