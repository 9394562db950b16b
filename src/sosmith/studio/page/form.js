// ---- The form: the stage that is shown, the signal and the hardware

const fields = [...document.querySelectorAll("[data-key]")];
const labels = [...document.querySelectorAll("#controls label")].filter((label) => label.querySelector("[data-key]"));
const form = () => (numbers(given(pathOf("filter.passband_edge"))).length ? "mask" : numbers(given(pathOf("filter.cutoff"))).length ? "order" : "sections");

function options(field, names) {
  if ([...field.options].map((each) => each.value).join() === names.join()) return;
  const value = field.value;
  field.replaceChildren(...names.map((name) => element("option", name || field.dataset.empty, { value: name })));
  field.value = value;
}

// The names among which a field chooses: of a stage, those of its kind.
function namesOf(field) {
  const key = field.dataset.key;
  if (key === "filter.family" && isChain()) return choices.families[kind()] || [];
  if (key === "stage.kind") return kindsAt(chosen, tables().length);
  return [...("empty" in field.dataset ? [""] : []), ...choices[key.replace("stage.", "hardware.")]];
}

// The kinds that a stage can have at a place: a polynomial takes the inputs, and `auto` is for all stages.
function kindsAt(k, count) {
  const inputs = Object.keys(given("input") || {}).join();
  const fits = { polynomial: k === 0 && inputs === "voltage,temperature", auto: count < 2 };
  return choices["stage.kind"].filter((name) => fits[name] !== false || name === (tables()[k] || {}).kind);
}

// The value of a field, null for one that is left empty, undefined for what it cannot take.
function read(field) {
  const text = field.value.trim();
  if (text === "" && "empty" in field.dataset) return null;
  if (field.tagName === "SELECT" || text === field.dataset.word) return text;
  if ("text" in field.dataset) return text === "" ? undefined : text;
  if ("list" in field.dataset) return listed(text, field.dataset.list === "rows");
  const value = Number(text.replace(",", ".").replace("−", "-"));
  return text === "" || !Number.isFinite(value) ? undefined : value;
}

function listed(text, ofRows) {
  let value;
  try { value = JSON.parse(text.startsWith("[") ? text : `[${text.split(/[\s,;]+/).filter(Boolean).join()}]`); } catch { return undefined; }
  const isRow = (row) => Array.isArray(row) && row.length > 0 && row.every((each) => typeof each === "number");
  return (ofRows ? Array.isArray(value) && value.length > 0 && value.every(isRow) : isRow(value)) ? value : undefined;
}

const written = (value) => (Array.isArray(value) ? (Array.isArray(value[0]) ? JSON.stringify(value) : value.join(", ")) : `${value}`);

function commit(field) {
  const value = read(field), path = pathOf(field.dataset.key);
  field.toggleAttribute("aria-invalid", false);
  if (value === undefined) { field.setAttribute("aria-invalid", "true"); return; }
  const before = numbers(asked(path)), at = Number(field.dataset.at || 0);
  if (field.dataset.at !== undefined && isBand()) {
    const both = [...before];
    both[at] = value;
    change({ [path]: both });
  } else change({ [path]: value });
}

let typing = 0, typed = null; // the field in which something was typed that is not sent yet
byId("controls").addEventListener("input", (event) => {
  const field = event.target;
  if (!field.dataset.key || field.tagName === "SELECT") return;
  clearTimeout(typing);
  typed = field;
  typing = setTimeout(commit, "text" in field.dataset || "list" in field.dataset ? 700 : 350, field);
});
byId("controls").addEventListener("change", (event) => {
  const field = event.target;
  if (field.name === "form") { reform(field.value); return; }
  if (!field.dataset.key) return;
  clearTimeout(typing);
  if (field.tagName !== "SELECT" && typed !== field) return;
  // After a refusal, what the page knows is older than what was sent: the number before is a change again.
  const refused = known.preview.error !== null || field.hasAttribute("aria-invalid");
  const now = asked(pathOf(field.dataset.key)), before = "list" in field.dataset ? now : numbers(now)[Number(field.dataset.at || 0)];
  if (refused || field.tagName === "SELECT" || JSON.stringify(read(field)) !== JSON.stringify(before ?? null)) commit(field);
});
byId("controls").addEventListener("submit", (event) => event.preventDefault());

// The same filter, as far as possible, in the other form.
function reform(to) {
  if (!seen()) return;
  const { filter, rate } = seen(), half = rate / 2;
  const edges = (bands) => {
    const frequencies = bands.flat().filter((value) => value > 0 && value < half).map((value) => rounded(value, 6));
    return isBand() ? frequencies : frequencies[0];
  };
  if (to === "mask") change({ [pathOf("filter.passband_edge")]: edges(filter.passbands), [pathOf("filter.stopband_edge")]: edges(filter.stopbands) });
  else {
    const cutoff = filter.cutoff.map((value) => rounded(value, 7));
    change({ [pathOf("filter.order")]: filter.order / (isBand() ? 2 : 1), [pathOf("filter.cutoff")]: isBand() ? cutoff : cutoff[0] });
  }
}

const fallbacks = { "hardware.start": "steady", "filter.method": "bilinear", "filter.freedom": "none", "filter.kind": "lowpass" };

// Whether a field has a meaning here: of a stage, what its kind knows, in the form in which its filter is given.
function applies(label, now) {
  const field = label.querySelector("[data-key]"), [group, name] = pathOf(field.dataset.key).split(".").slice(-2), of = kind();
  if (!isChain()) {
    if (field.dataset.key.startsWith("stage.")) return false;
  } else {
    if (field.dataset.key === "hardware.realization") return false;
    const own = field.dataset.key.startsWith("filter.") || field.dataset.key.startsWith("stage.");
    if (own && !["name", "kind"].includes(name) && !(choices.kinds[of] || []).includes(name)) return false;
    if (name === "method" && now === "sections") return false;
  }
  if ("pair" in label.dataset && !isBand()) return false;
  const byForm = !isChain() || of === "iir" || of === "fir";
  if (label.dataset.form && byForm && label.dataset.form !== now) return false;
  return !("needed" in label.dataset) || !byForm || asked(pathOf(field.dataset.key)) !== undefined;
}

function controls() {
  const now = form(), of = kind();
  byId("stageset").hidden = isChain() && !tables().length;
  byId("stagelegend").textContent = isChain() ? `Stage ${table().name ?? ""}` : "Filter";
  for (const label of labels) label.hidden = !applies(label, now);
  document.querySelector(".forms").hidden = now === "sections" || (isChain() && of !== "iir");
  for (const radio of document.querySelectorAll("input[name=form]")) radio.checked = radio.value === now;
  for (const unit of document.querySelectorAll("[data-unit]")) unit.textContent = (known.preview && known.preview.unit) || "";
  for (const field of fields) {
    const key = field.dataset.key, isSelect = field.tagName === "SELECT", whole = asked(pathOf(key));
    if (isSelect) options(field, namesOf(field));
    if (field === document.activeElement && !isSelect) continue;
    field.removeAttribute("aria-invalid");
    const value = "list" in field.dataset ? whole : numbers(whole)[Number(field.dataset.at || 0)];
    const byTaps = of === "fir" && now === "sections";
    const fallback = !isSelect || "empty" in field.dataset ? "" : key === "filter.family" && isChain() ? (byTaps ? "" : choices.families[of]?.[0]) : fallbacks[key] || "auto";
    const text = value === undefined || value === null ? fallback : written(value);
    if (field.value !== text) field.value = text;
    if (isSelect && key.startsWith("filter.")) field.disabled = now === "sections" && !byTaps;
  }
}
