// ---- The chain as a whole: its gain, and what of its aliases comes out where

// A band of frequencies, shaded over the whole height.
function shade(to, from, until) {
  const left = to.x(Math.max(from, to.range.x[0])), right = to.x(Math.min(until, to.range.x[1]));
  if (right > left) to.layer.append(drawn("rect", { class: "band", x: left, width: right - left, y: TOP, height: to.bottom - TOP }));
}

// The lowest level that is drawn, in dB: under what is proven or asked, if that is known.
function lowestLevel(limits) {
  const stated = [...limits, ...tables().map((each) => -each.stopband_loss), -given("limits.stopband_loss")];
  return -Math.min(200, Math.max(80, 20 * Math.ceil((30 - Math.min(...stated.filter(Number.isFinite), 0)) / 20)));
}

const upTo = (db) => minus(Math.ceil(100 * db) / 100); // what is at most that much is not rounded down

function chainPlots() {
  const result = isProven() && known.design.chain;
  const asIs = known.preview.spec && Boolean(known.preview.spec.stage);
  const chain = result || (asIs && known.preview.chain) || null; // the design has chosen what the preview could not know
  byId("chain").hidden = !isChain();
  byId("chainfigure").hidden = !chain;
  byId("aliasfigure").hidden = !chain || !chain.aliases;
  if (!isChain() || !chain) return;
  const limits = result ? result.limits : [], lowest = lowestLevel(limits.map(([, , db]) => db));
  const where = byId("chaingain"), top = Math.max(6, ...chain.db) + 2;
  const to = axes(where, { x: [chain.f[0], chain.f.at(-1)], y: [lowest, top], logarithmic: true, xUnit: "Hz", yUnit: "dB", height: Math.max(280, Math.min(360, where.clientWidth * 0.42)) });
  for (const [from, until] of chain.bands) shade(to, from, until);
  for (const [name, db] of Object.entries(chain.stages)) curve(to, name === table().name ? "ideal" : "other", chain.f, db);
  curve(to, "whole", chain.f, chain.db);
  for (const [from, until, db] of limits) curve(to, "limit", [from, until], [db, db]);
  shown(where, to, "Gain of the chain and of its stages over frequency");
  const images = chain.bands.some(([, , name]) => name === "image"), rises = tables().some((each) => each.interpolate > 1);
  const said = limits.map(([, , db, name]) => `${name === "image" ? "images" : "aliases"} at most ${upTo(db)} dB`);
  const into = result ? result.passing : [];
  said.push(...into.map(([db, name]) => `${name === "image" ? "of" : "into"} the pass band ${upTo(db)} dB`));
  say("chainfacts", said.length ? `${said.join(", ")}: proven` : "");
  byId("chaincaption").textContent = !chain.bands.length ? "From a sine at the input to the sine at the output."
    : rises ? `At the highest rate. In the shaded band lie ${images ? "images" : "aliases"}.` : "From a sine at the input to the sine at the output; in the shaded band it comes out as an alias, at a lower frequency.";
  byId("chainchosen").hidden = !(table().name in chain.stages);
  byId("chainlimit").hidden = !limits.length;
  where.classList.toggle("old", known.preview.error !== null);
  if (chain.aliases) aliases(chain.aliases, lowest, top);
}

function aliases({ f, stays, folds }, lowest, top) {
  const to = axes(byId("aliases"), { x: [0, f.at(-1)], y: [lowest, top], xUnit: "Hz", yUnit: "dB", height: 250 });
  const edge = given("limits.passband_edge");
  if (edge > 0) curve(to, "limit", [edge, edge], [lowest, top]);
  curve(to, "folds", f, folds);
  curve(to, "whole", f, stays);
  shown(byId("aliases"), to, "Gain of what stays at a frequency, and of what folds there, over frequency at the output");
  byId("aliases").classList.toggle("old", known.preview.error !== null);
}

// The tables of `sosmith design`.
function chainTables() {
  const result = known.design, place = byId("tables");
  place.classList.toggle("old", !isProven());
  byId("tablesheading").hidden = !(isChain() && result && result.tables.length);
  place.replaceChildren(...(isChain() && result ? result.tables : []).map(({ title, head, rows: body, notes }) => {
    const frame = element("div", "", { class: "scroll", tabindex: "0" }), table = element("table");
    table.append(element("caption", title));
    if (head) {
      const top = element("thead"), row = element("tr");
      row.append(...head.map((name) => element("th", name, { scope: "col" })));
      top.append(row);
      table.append(top);
    }
    const rest = element("tbody");
    for (const each of body) {
      const cells = Array.isArray(each) ? each : [each.name, [each.text, each.sentence].filter(Boolean).join("; ")], row = element("tr");
      row.append(...cells.map((text, k) => element(k ? "td" : "th", text, k ? {} : { scope: "row" })));
      rest.append(row);
    }
    table.append(rest);
    frame.append(table, ...notes.map((note) => element("p", note)));
    return frame;
  }));
}
