// The site's search. It stands in place of MkDocs' own, which asks for its index in a way that browsers refuse to a page
// from a disk: here the index is a script, `search_index.js`, which says `sosmithSearch = {docs: [...]}`.
(() => {
  "use strict";
  const field = document.getElementById("mkdocs-search-query");
  if (!field) return; // only the page of results has it
  const found = document.getElementById("mkdocs-search-results");
  const asked = new URLSearchParams(location.search).get("q");

  function load(name) {
    return new Promise((done, fail) => {
      const script = document.createElement("script");
      script.src = `${base_url}/search/${name}`;
      script.onload = done;
      script.onerror = fail;
      document.head.append(script);
    });
  }

  function say(text) {
    const line = document.createElement("p");
    line.textContent = text;
    found.append(line);
  }

  function results(index, pages) {
    found.replaceChildren();
    if (field.value.trim().length < 3) return;
    const words = lunr.tokenizer(field.value).map(String);
    // A word may be the beginning of a longer one. No operators: what is typed is text.
    const hits = index.query((query) => words.forEach((word) => {
      query.term(word, { boost: 10 });
      query.term(word, { wildcard: lunr.Query.wildcard.TRAILING });
    }));
    hits.forEach(({ ref }) => {
      const page = pages.get(ref);
      const part = document.createElement("article"), heading = document.createElement("h3");
      const link = document.createElement("a"), text = document.createElement("p");
      link.href = `${base_url}/${page.location}`;
      link.textContent = page.title;
      text.textContent = page.text.slice(0, 200);
      heading.append(link);
      part.append(heading, text);
      found.append(part);
    });
    if (!hits.length) say("No results found");
  }

  Promise.all([load("lunr.js"), load("search_index.js")]).then(() => {
    const pages = new Map(sosmithSearch.docs.map((page) => [page.location, page]));
    const index = lunr(function () {
      this.ref("location");
      this.field("title", { boost: 5 });
      this.field("text");
      pages.forEach((page) => this.add(page));
    });
    if (asked !== null) field.value = asked;
    field.addEventListener("input", () => results(index, pages));
    results(index, pages);
  }).catch(() => say("The search could not be loaded"));
})();
