# SPDX-License-Identifier: Apache-2.0
"""The table of findings, made from the calls that report them, for the site's page "Why is my estimate bad?".

    findings.py SOURCE_DIR      prints it

A call is mhi_findings_add(list, WEIGHT, remedy, text, ...): its literals are taken as they stand, numbers and names as "…".
"""
import re
import sys
from pathlib import Path

ABOUT = {"believe_model": "Of the model", "believe_markers": "Of the markers", "believe_angles": "Of the angles", "believe_emg": "Of the EMG",
         "believe_loads": "Of the loads", "believe_fit": "Of model and markers together", "exchange": "Of exchanged labels",
         "believe_reference": "Of the reference", "judge": "Of the estimates"}
WEIGHT = {"MHI_FINDING_NOTE": "note", "MHI_FINDING_DOUBTFUL": "doubtful", "MHI_FINDING_USELESS": "not usable"}
LITERAL = r'"(?:[^"\\]|\\.)*"'


def arguments(text, begin):
    """The arguments of a call whose parenthesis opens before `begin`."""
    found, depth, at, quoted = [], 0, begin, False
    for k in range(begin, len(text)):
        c = text[k]
        if quoted:
            quoted = c != '"' or text[k - 1] == "\\"
        elif c == '"':
            quoted = True
        elif c in "([{":
            depth += 1
        elif c in ")]}" and depth > 0:
            depth -= 1
        elif (c == "," or c == ")") and depth == 0:
            found.append(text[at:k].strip())
            at = k + 1
            if c == ")":
                return found
    return found


def words(expression):
    """What the literals of an expression say; alternatives of a condition by a slash."""
    bare = re.sub(LITERAL, lambda m: '"' + "x" * (len(m[0]) - 2) + '"', expression)
    said, at = [], 0
    for cut in [m.start() for m in re.finditer(r"\?| : ", bare)] + [len(bare)]:
        literal = "".join(x[1:-1] for x in re.findall(LITERAL, expression[at:cut]))
        literal = literal.replace('\\"', '"').replace("\\n", " ").replace("%%", "\0")
        literal = re.sub(r"%[-+ #0]*[\d.*]*(?:l|z|h)*[a-zA-Z]", "…", literal).replace("\0", "%")
        literal = re.sub(r"…(?:[ ,]*…)+", "…", literal).strip()
        if re.search(r"[a-zA-Z]{2}", literal):
            said.append(literal)
        at = cut
    return " / ".join(said)


def rows(path):
    text = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.S)
    found = []
    for call in re.finditer(r"\b(?:mhi_findings_(add|advise)|tell)\(", text):
        given = arguments(text, call.end())
        if call[1] is None and len(given) == 6 and given[2] in WEIGHT:  # of believe_model.c: (list, model, weight, remedy, what, ...)
            found.append(["…: " + words(given[4]) + ": …", WEIGHT[given[2]], words(given[3])])
        if call[1] == "add" and len(given) >= 4:
            weight = next((said for name, said in WEIGHT.items() if given[1] == name), "as severe as it is")
            if words(given[3]):
                found.append([words(given[3]), weight, words(given[2])])
        elif call[1] == "advise" and found and len(given) >= 2 and words(given[1]):
            found[-1][2] = words(given[1])
    return found


def table(source):
    lines = []
    for name, title in ABOUT.items():
        these = rows(source / f"core/src/believe/{name}.c")
        if not these:
            continue
        lines += [f"**{title}**", "", "| it says | weight | what helps |", "|---|---|---|"]
        for said, weight, remedy in these:
            cells = [x.replace("|", "\\|") for x in (said, weight, remedy or "said with it: it depends on the case")]
            lines.append("| " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(Path(sys.argv[1])))
