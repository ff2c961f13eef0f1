# SPDX-License-Identifier: Apache-2.0
"""Tables as Markdown and HTML, and the one page that holds a study."""
import base64
import html
import math
import numbers


def cell(value):
    """A number as people write it."""
    if isinstance(value, (bool,)) or type(value).__name__ == "bool_":
        return "yes" if value else ""
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        value = float(value)
        if math.isnan(value):
            return ""
        return "< 1e-16" if 0 < value < 1e-16 else f"{value:.4g}"
    return str(value)


def markdown(table):
    names = [str(c) for c in table.columns]
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    for row in table.itertuples(index=False):
        lines.append("| " + " | ".join(cell(v) for v in row) + " |")
    return "\n".join(lines) + "\n"


def as_html(table):
    head = "".join(f"<th>{html.escape(str(c))}</th>" for c in table.columns)
    rows = []
    for row in table.itertuples(index=False):
        cells = "".join(f"<td{'' if isinstance(v, str) else ' class=n'}>{html.escape(cell(v))}</td>" for v in row)
        rows.append(f"<tr>{cells}</tr>")
    return f"<div class=t><table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"


STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}
h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em;border-bottom:1px solid #ddd}
img{max-width:100%}table{border-collapse:collapse;font-size:13px}td,th{padding:2px 9px;border-bottom:1px solid #eee;
text-align:left}td.n{text-align:right;font-variant-numeric:tabular-nums}.t{overflow:auto;max-height:32em}
pre{background:#f6f6f6;padding:1em;overflow:auto;font-size:12px}.s{color:#555}
"""


class Page:
    """Sections in the order in which they are added."""

    def __init__(self, title):
        self.title = title
        self.parts = []

    def heading(self, text):
        self.parts.append(f"<h2>{html.escape(text)}</h2>")

    def text(self, text):
        self.parts.append(f"<p class=s>{html.escape(text)}</p>")

    def table(self, table):
        self.parts.append(as_html(table))

    def code(self, text):
        self.parts.append(f"<pre>{html.escape(text)}</pre>")

    def figure(self, png, caption):
        with open(png, "rb") as file:
            data = base64.b64encode(file.read()).decode("ascii")
        self.parts.append(f'<figure><img alt="{html.escape(caption)}" src="data:image/png;base64,{data}">'
                          f"<figcaption class=s>{html.escape(caption)}</figcaption></figure>")

    def write(self, path):
        with open(path, "w", encoding="utf-8") as file:
            file.write(f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(self.title)}</title>'
                       f"<style>{STYLE}</style></head><body><h1>{html.escape(self.title)}</h1>\n"
                       + "\n".join(self.parts) + "\n</body></html>\n")
