# SPDX-License-Identifier: Apache-2.0
"""The documentation as a site with a search: gathers the pages that lie in the tree, and lets mkdocs build them.

    make.py SOURCE_DIR WORK_DIR PROGRAMS      the site is WORK_DIR/html

Pages stay readable where they lie; here their links are moved to where the pages go. The reference is made from the programs'
own help, the plugins' READMEs and the public headers, which are the manual.
"""
import base64
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import findings

PROGRAMS = ["mhe-run", "mhe-live", "mhe-model", "mhe-calibrate", "mhe-sim", "mhe-study", "mhe-bench"]
TUTORIALS = ["first-run", "own-model", "recording", "walking", "calibration", "calibrate", "python", "notebook-demo", "matlab", "embedding", "plugins"]
HOW_TO = ["install", "raw-emg", "live", "realtime", "batch", "simulate", "studies"]
EXPLANATIONS = ["outputs", "believability", "faq", "opensim", "paths", "elastic-tendon", "uncertainty", "study", "performance",
                "comparison", "architecture", "abi", "style", "glossary"]


class Site:
    def __init__(self, source, work, programs):
        self.source, self.work, self.programs = Path(source).resolve(), Path(work).resolve(), Path(programs)
        self.pages = {}  # file in the tree -> page of the site
        self.broken = []

    def plan(self):
        self.pages[self.source / "README.md"] = "index.md"
        for page in sorted((self.source / "docs").glob("*.md")):
            self.pages[page] = page.name
        for readme in sorted((self.source / "plugins").glob("*/README.md")):
            self.pages[readme] = f"plugins/{readme.parent.name}.md"
        for readme in sorted((self.source / "models").glob("*/README.md")):
            self.pages[readme] = f"models/{readme.parent.name}.md"
        for notebook in sorted((self.source / "docs/notebook").glob("*.ipynb")):
            self.pages[notebook] = f"notebook-{notebook.stem}.md"
        for name in ("CONTRIBUTING.md", "CHANGELOG.md"):
            self.pages[self.source / name] = name.lower()

    def write(self, page, text):
        path = self.work / "pages" / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def moved_link(self, origin, page, target):
        """Where a link of `origin` leads once it is `page`; None: it stays text (a file that is no page)."""
        name, _, anchor = target.partition("#")
        if not name or re.match(r"[a-z]+:", target):
            return target
        if name.startswith("/"):  # made here, from the root of the pages
            return os.path.relpath(name, os.path.dirname("/" + page))
        file = (origin.parent / name).resolve()
        if file in self.pages:
            to = os.path.relpath(self.pages[file], os.path.dirname(page) or ".")
            return to + (f"#{anchor}" if anchor else "")
        if not file.exists():
            self.broken.append(f"{origin.relative_to(self.source)}: there is no {target}")
            return None
        if file.suffix in (".svg", ".png"):
            copy = self.work / "pages/pictures" / str(file.relative_to(self.source)).replace("/", "_")
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(file.read_bytes())
            return os.path.relpath(copy, (self.work / "pages" / page).parent)
        return None

    def page(self, origin, page):
        def link(found):
            to = self.moved_link(origin, page, found[3])
            return f"{found[1]}[{found[2]}]({to})" if to is not None else found[2]
        text = self.notebook(origin, page) if origin.suffix == ".ipynb" else origin.read_text()
        text = text.replace("<!-- findings -->", findings.table(self.source)) if "<!-- findings -->" in text else text
        parts = re.split(r"(```.*?```)", text, flags=re.S)
        for i in range(0, len(parts), 2):
            parts[i] = re.sub(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)", link, parts[i])
        return "".join(parts)

    def notebook(self, origin, page):
        """A notebook as a page: its cells, what they print, and their figures."""
        said = []
        for cell in json.loads(origin.read_text())["cells"]:
            source = "".join(cell["source"])
            said.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
            for output in cell.get("outputs", []):
                data = output.get("data", {})
                if "image/png" in data:
                    picture = self.work / f"pages/pictures/{origin.stem}-{len(said)}.png"
                    picture.parent.mkdir(parents=True, exist_ok=True)
                    picture.write_bytes(base64.b64decode(data["image/png"]))
                    said.append(f"![Figure of the cell above](/{picture.relative_to(self.work / 'pages')})")
                else:
                    text = "".join(output.get("text", data.get("text/plain", "")))
                    said.append(f"```text\n{text}\n```")
        return "\n\n".join(said) + "\n"

    def header(self, path):
        text = path.read_text()
        about = re.search(r"/\* ([\w]+\.h: .*?)\*/", text, re.S)
        body = text[about.end():] if about else text
        prose = re.sub(r"^ \* ?", "", about[1] if about else "", flags=re.M).strip()
        return f"# mhe/{path.name}\n\n```text\n{prose}\n```\n\n```c\n{body.strip()}\n```\n"

    def gather(self):
        self.plan()
        for origin, page in self.pages.items():
            self.write(page, self.page(origin, page))
        for header in sorted((self.source / "core/include/mhe").glob("*.h")):
            self.write(f"headers/{header.name.replace('.', '_')}.md", self.header(header))
        self.used = []
        for program in PROGRAMS:
            path = self.programs / program
            if path.exists():
                self.used.append(program)
                said = subprocess.run([path, "--help"], capture_output=True, text=True, check=True).stdout
                self.write(f"programs/{program}.md", f"# {program}\n\n```text\n{said}```\n")

    def listed(self, names):
        """Nav entries of the pages that are there."""
        return [page for page in (f"{name}.md" for name in names) if (self.work / "pages" / page).exists()]

    def below(self, folder):
        return sorted(f"{folder}/{page.name}" for page in (self.work / "pages" / folder).glob("*.md"))

    def nav(self):
        known = self.listed(TUTORIALS) + self.listed(HOW_TO) + self.listed(EXPLANATIONS) + ["index.md", "config.md", "contributing.md", "changelog.md"]
        rest = sorted(p.name for p in (self.work / "pages").glob("*.md") if p.name not in known)
        return [("Start", ["index.md"]), ("Tutorials", self.listed(TUTORIALS)), ("How to", self.listed(HOW_TO)), ("Understand", self.listed(EXPLANATIONS) + rest),
                ("Reference", ["config.md"] + [f"programs/{p}.md" for p in self.used]),
                ("Plugins", self.below("plugins")), ("Models", self.below("models")), ("Headers", self.below("headers")),
                ("Project", ["contributing.md", "changelog.md"])]

    def mend_theme(self):
        """Debian's theme names two scripts that it does not hold: jQuery, which lies elsewhere in Debian and opens the menu of a
        narrow window, and one of its own."""
        scripts = self.work / "pages/js"
        scripts.mkdir(parents=True, exist_ok=True)
        for name, path in (("jquery-3.6.0.min.js", Path("/usr/share/javascript/jquery/jquery.min.js")),
                           ("theme_extra.js", self.source / "docs/site/theme_extra.js")):
            if path.exists():
                (scripts / name).write_bytes(path.read_bytes())

    def build(self):
        self.mend_theme()
        nav = "".join(f"  - {title}:\n" + "".join(f"    - {page}\n" for page in pages) for title, pages in self.nav() if pages)
        (self.work / "mkdocs.yml").write_text(
            f"site_name: Myohorizon\nsite_url: ''\nuse_directory_urls: false\ndocs_dir: pages\nsite_dir: html\n"
            f"theme: {{name: readthedocs, locale: en, highlightjs: false, navigation_depth: 2}}\n"
            f"extra_css: [site.css]\nmarkdown_extensions: [tables, fenced_code, toc]\nplugins: [search]\nnav:\n{nav}")
        (self.work / "pages/site.css").write_text((self.source / "docs/site/site.css").read_text())
        done = subprocess.run(["/usr/bin/python3", "-m", "mkdocs", "build", "--strict", "--clean", "-q", "-f",
                               str(self.work / "mkdocs.yml")], capture_output=True, text=True)
        if done.returncode != 0 or self.broken:
            sys.exit("\n".join(self.broken) + done.stdout + done.stderr)
        search = self.work / "html/search"
        (search / "search_index.js").write_text(f"const search_index = {(search / 'search_index.json').read_text()};\n")
        (search / "main.js").write_text((self.source / "docs/site/search.js").read_text())
        (search / "worker.js").unlink()


def main(source, work, programs):
    site = Site(source, work, programs)
    subprocess.run(["rm", "-rf", str(site.work / "pages"), str(site.work / "html")], check=True)
    site.gather()
    site.build()
    print(f"{site.work}/html/index.html")


if __name__ == "__main__":
    main(*sys.argv[1:])
