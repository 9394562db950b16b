// ---- The text

let retyping = 0, overwrite = false;
byId("toml").addEventListener("input", () => {
  clearTimeout(retyping);
  retyping = setTimeout(() => send({ do: "text", text: byId("toml").value }), 400);
});
byId("write").addEventListener("click", () => send({ do: "save", overwrite }));
byId("reread").addEventListener("click", () => send({ do: "reread" }));

function text() {
  const { text: content, file, saved, question, problem } = known.document, box = byId("toml");
  if (box !== document.activeElement && box.value !== content) box.value = content;
  overwrite = Boolean(question);
  byId("write").textContent = overwrite ? `Overwrite ${file}` : `Save ${file}`;
  byId("write").disabled = saved;
  byId("undo").disabled = !known.document.undo;
  byId("redo").disabled = !known.document.redo;
  byId("reread").hidden = !overwrite;
  say("saved", saved ? "" : "· not saved");
  say("saving", problem || question || (saved ? "Saved." : ""));
  byId("saving").className = problem ? "problem" : "";
}

// ---- What comes

function picture() {
  controls();
  if (!known.preview || !known.preview.spec) return;
  chainPlots();
  const why = seen() ? "" : { polynomial: "A polynomial has no frequency response.", auto: "The stages are chosen when the chain is designed." }[kind()] || "";
  for (const figure of document.querySelectorAll("[data-response]")) figure.hidden = !seen();
  byId("noresponse").hidden = !why;
  say("noresponse", why);
  say("gaintitle", isChain() ? `Gain of stage ${table().name}` : "Gain");
  say("stagefacts", isChain() && seen() ? seen().filter.describe : "");
  if (!seen()) return;
  gain();
  step();
  delay();
  plane();
}

function take(news) {
  const before = isProven();
  Object.assign(known, news);
  const turned = Boolean(news.design) || before !== isProven(); // the steps of a proof change nothing that is drawn
  const answer = news.preview || news.document;
  for (const path of Object.keys(pending)) {
    if (news.preview && (answer.client !== me || answer.n >= pending[path].n)) delete pending[path];
  }
  if (news.document) settleChoice();
  if (news.document && !news.preview) picture();
  if (news.preview) {
    if (news.preview.spec) {
      say("name", news.preview.name.replaceAll("_", "_\u200b"));
      say("describe", news.preview.describe);
      document.title = `${news.preview.name}, studio`;
    }
    picture();
    landed();
  } else if (turned && !news.document) picture();
  if (news.document) text();
  if (news.document || news.preview || turned || (news.proof && news.proof.state === "refused")) stages();
  if (news.proof) working();
  if (news.document || turned) proven();
  if (news.realizations || news.document || turned) realizations();
  if (news.trace || news.report) traced();
  if (news.calibration || news.document) calibrated();
  if (news.ended) ended = true;
  verdict();
}

function listen(wait) {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${location.pathname}live`);
  socket.addEventListener("message", (event) => {
    const news = JSON.parse(event.data);
    wait = 1;
    if (news.you) { me = news.you; sent = 0; flying = 0; return; }
    take(news);
  });
  socket.addEventListener("close", () => {
    verdict();
    if (!ended) setTimeout(listen, wait * 1000, Math.min(2 * wait, 10));
  });
}

new ResizeObserver(() => { picture(); if (known.trace) traced(); }).observe(document.querySelector("main"));
listen(1);
