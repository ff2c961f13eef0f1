// SPDX-License-Identifier: Apache-2.0
// The search page. The generator's own asks a server for its index; this one also works where the site lies as files on a disk:
// the index is a script, search_index.js, which sets `search_index`.
(function () {
    const place = document.currentScript.src.replace(/[^/]*$/, "");
    const field = document.getElementById("mkdocs-search-query");
    const list = document.getElementById("mkdocs-search-results");
    if (!field || !list) {
        return; // the field of the other pages leads here
    }

    function load(name) {
        return new Promise((done, failed) => {
            const script = document.createElement("script");
            script.src = place + name;
            script.onload = done;
            script.onerror = () => failed(new Error(name + " is missing"));
            document.head.appendChild(script);
        });
    }

    function element(tag, text, attributes) {
        const made = Object.assign(document.createElement(tag), attributes);
        made.textContent = text;
        return made;
    }

    // A piece of the section around the first word that is looked for.
    function excerpt(text, words) {
        const lower = text.toLowerCase();
        const at = Math.max(0, Math.min(...words.map((word) => lower.indexOf(word)).filter((k) => k >= 0), text.length));
        const begin = at >= text.length ? 0 : Math.max(0, at - 80);
        return (begin > 0 ? "… " : "") + text.slice(begin, begin + 240) + (begin + 240 < text.length ? " …" : "");
    }

    function show(index, sections) {
        const query = field.value.trim().toLowerCase();
        const words = query.split(/\s+/).filter((word) => word.length > 1);
        list.replaceChildren();
        if (words.length === 0) {
            return;
        }
        const found = index.query((q) => words.forEach((word) => {
            q.term(lunr.tokenizer(word), {boost: 10});
            q.term(lunr.tokenizer(word), {wildcard: lunr.Query.wildcard.TRAILING});
        }));
        for (const {ref} of found.slice(0, 40)) {
            const section = sections[ref];
            const article = document.createElement("article");
            const title = document.createElement("h3");
            title.append(element("a", section.title, {href: place + "../" + section.location}));
            article.append(title, element("p", excerpt(section.text, words), {}));
            list.append(article);
        }
        if (found.length === 0) {
            list.append(element("p", list.dataset.noResultsText || "nothing was found", {}));
        }
    }

    Promise.all([load("lunr.js"), load("search_index.js")]).then(() => {
        const sections = search_index.docs;
        const index = lunr(function () {
            this.ref("at");
            this.field("title", {boost: 10});
            this.field("text");
            this.tokenizer.separator = /[\s\-.,:;()[\]{}<>|"'`=/]+/; // words of keys and options, too
            sections.forEach((section, at) => this.add({at, title: section.title, text: section.text}));
        });
        field.value = new URLSearchParams(window.location.search).get("q") || "";
        field.addEventListener("input", () => show(index, sections));
        show(index, sections);
    }).catch((error) => list.replaceChildren(element("p", "the search does not work: " + error.message, {})));
})();
