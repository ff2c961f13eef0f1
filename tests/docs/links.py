# SPDX-License-Identifier: Apache-2.0
"""No link of the built site leads nowhere: pages and their anchors are there; what leads outside is on a list.

    links.py HTML_DIR LIST

The network is not asked. The list (docs/site/links.txt) holds each address outside with what is found there, as somebody saw
it: an address that is mistyped is none of them, and one that no page uses any more has to go.
"""
import html.parser
import re
import sys
import urllib.parse
from pathlib import Path

root = Path(sys.argv[1]).resolve()


class Page(html.parser.HTMLParser):
    def __init__(self, path):
        super().__init__(convert_charrefs=True)
        self.links, self.anchors = [], set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id" or (name == "name" and tag == "a"):
                self.anchors.add(value)
            elif name in ("href", "src") and value:
                self.links.append(value)


def listed(path):
    """{address: what is there}; a line each, '#' begins a remark."""
    found = {}
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line.strip() and not line.startswith("#"):
            address, _, what = line.partition(" ")
            if not what.strip() or address in found:
                sys.exit(f"{path}:{number}: an address, once, and what is found there")
            found[address] = what.strip()
    return found


def wrong_address(address):
    parts = urllib.parse.urlsplit(address)
    if parts.scheme not in ("http", "https", "mailto") or not (parts.netloc or parts.scheme == "mailto"):
        return "is no address"
    if re.search(r"[\s<>\"{}|\\^`]", address):
        return "has a character that no address has"
    if parts.netloc.endswith("doi.org") and not re.fullmatch(r"/10\.\d{4,9}/\S+", parts.path):
        return "is no DOI"
    return None


def main():
    pages = {path: Page(path) for path in sorted(root.rglob("*.html"))}
    known, used, wrong = listed(Path(sys.argv[2])), set(), []
    for path, page in pages.items():
        for link in page.links:
            name = path.relative_to(root)
            if re.match(r"[a-z][a-z0-9+.-]*:", link, re.I):
                if link.startswith("data:"):
                    continue
                used.add(link)
                why = wrong_address(link) or (None if link in known else "is not in the list of what was seen")
                if why:
                    wrong.append(f"{name}: {link} {why}")
                continue
            file, _, anchor = urllib.parse.unquote(link).partition("#")
            base = root if file.startswith("/") else path.parent  # 404.html knows not where it is asked for
            target = (base / file.partition("?")[0].lstrip("/")).resolve() if file else path
            target = target / "index.html" if target.is_dir() else target
            if not target.exists():
                wrong.append(f"{name}: there is no {link}")
            elif anchor and target in pages and anchor not in pages[target].anchors:
                wrong.append(f"{name}: {link}: the page has no such anchor")
    wrong += [f"{sys.argv[2]}: no page leads to {address}" for address in sorted(set(known) - used)]
    print(f"{len(pages)} pages, {len(used)} addresses outside")
    if wrong or len(pages) < 60:
        sys.exit("\n".join(sorted(set(wrong))) or "the pages are not found")


main()
