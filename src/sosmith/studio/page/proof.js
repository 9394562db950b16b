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
  else if (isChain() && !tables().length) show("fail", "Not a chain yet", "There must be a stage: add one to the list.");
  else if (wrong) show("fail", isChain() ? "Not a chain yet" : "Not a filter yet", wrong);
  else if (!proof || proof.state === "waiting") show("wait", "Changing", "The proof begins when the handle is let go.");
  else if (proof.state === "working") show("wait", "Proving", `${proof.step}. ${kind() === "auto" ? "The stages are being chosen." : `The response is already that of the new ${isChain() ? "chain" : "filter"}.`}`);
  else if (proof.state === "refused") show("fail", "No proven design", proof.error);
  else {
    const { bound, allowed, unit, realization, architecture } = known.design;
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
  const result = known.design;
  for (const id of ["tiles", "budget", "sections", "cycles", "reasons"]) byId(id).classList.toggle("old", !isProven());
  chainTables();
  const { sections, limit_cycles: limitCycles, reasons } = provenStage() || { sections: [], limit_cycles: [], reasons: {} };
  byId("reasons").replaceChildren(...Object.entries(reasons).map(([name, reason]) => element("p", `${name}: ${reason}.`)));
  byId("sections").hidden = !sections.length;
  rows("sections", [["section", false], ["coefficients", false]], sections.map(([name, all]) => ({
    cells: [name, all.map(([key, integer, bits]) => `${key} = ${minus(integer)}·2${superscript(-bits)}`).join("   ")],
  })));
  byId("cycles").hidden = !limitCycles.length;
  rows("cycles", [["section", false], ["without input, at most", true], ["dead band", true]], limitCycles.map(([name, most, dead]) => ({ cells: [name, short(most, 3), short(dead, 3)] })));
  say("ofstage", isChain() && (sections.length || limitCycles.length) ? `, stage ${table().name}` : "");
  if (!result) return;
  const { unit, lsb } = result, cycles = result.stages.flatMap((each) => each.limit_cycles), largest = Math.max(0, ...cycles.map(([, size]) => size));
  byId("tiles").replaceChildren(
    tile("error bound", withUnit(short(result.bound), unit), `${short(result.bound / lsb, 4)} LSB, ${short(100 * result.bound / result.allowed, 3)} % of what is allowed`, result.bound / result.allowed),
    tile("realization", result.realization || "none", result.architecture),
    tile("time", `${result.cycles.toLocaleString("en")} clock${result.cycles === 1 ? "" : "s"}`, `a sample and channel${result.chain ? ", at the input" : ""}; latency ${result.latency.toLocaleString("en")} clocks`),
    tile("cost, estimated", size(result.cost), sizeBeside(result.cost)),
    tile("limit cycles", cycles.length ? (largest > 0 ? `${short(largest, 3)} LSB` : "none") : "–", "at most, of any one section, without input"),
  );
  const part = (value) => `${short(100 * value / result.allowed, 3)} %`;
  rows("budget", [[result.chain ? "stage" : "part", false], [unit || "full scale 1", true], ["LSB", true], ["of allowed", true]], [
    ...result.budget.filter(([, value]) => result.chain || value >= lsb / 20000).map(([name, value]) => ({ cells: [name, short(value, 3), short(value / lsb, 3), part(value)] })),
    { cells: ["sum", short(result.bound, 3), short(result.bound / lsb, 3), part(result.bound)] },
  ]);
  const source = byId("source"), names = Object.keys(result.scenarios);
  if ([...source.options].map((each) => each.value).join() !== names.join()) {
    const chosen = source.value;
    source.replaceChildren(...names.map((name) => element("option", `${name}: ${result.scenarios[name]}`, { value: name })));
    if (names.includes(chosen)) source.value = chosen;
    else if (names.includes("wear_ramp")) source.value = "wear_ramp";
  }
}

function realizations() {
  const { state, step: at, rows: designs } = known.realizations, taken = isProven() && (provenStage() || {}).realization;
  byId("sidebyside").hidden = isChain() && !seen();
  byId("sidehint").textContent = isChain() ? `The chain with every realization of stage ${table().name}, each proven with its own word lengths.` : "Every realization designed and proven for this specification, each with its own word lengths.";
  byId("compare").setAttribute("aria-pressed", `${state !== "off"}`);
  byId("compare").textContent = state === "off" ? "Compare realizations" : "Stop comparing";
  say("comparing", state === "working" ? `Designing ${at}.` : state === "waiting" ? "After the proof." : "");
  byId("realizations").hidden = !designs.length;
  const unit = known.preview ? known.preview.unit : "";
  rows("realizations", [["realization", false], ["architecture", false], [withUnit("bound", unit && `in ${unit}`), true], ["clocks a sample", true], ["latency", true], ["cost, estimated", false]], designs.map((one) => ({
    name: one.realization === taken ? "taken" : "",
    cells: one.refused ? [one.realization, "–", "–", "–", "–", one.refused] : [one.realization + (one.realization === taken ? ", taken" : ""), one.architecture, short(one.bound), one.cycles.toLocaleString("en"), one.latency.toLocaleString("en"), `${size(one.cost)}, ${counted(one.cost.multipliers, "multiplier")}`],
  })));
}
