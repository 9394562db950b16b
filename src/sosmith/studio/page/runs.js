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
byId("compare").addEventListener("click", () => send({ do: "realizations", on: known.realizations.state === "off", stage: chosen }));

function calibrated() {
  const calibration = known.calibration;
  byId("calibrating").hidden = isChain() && tables()[0]?.kind !== "polynomial";
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
