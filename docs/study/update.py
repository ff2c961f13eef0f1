#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes over the tables and figures of studies and fills the page of the comparison with the paper from them.

    update.py [DIR]...          DIR: a folder that mhe-study report has been through; PAGE is ../study.md
    update.py --check           exit status 1 where the page is not what the tables say
    update.py --to FOLDER ...   the page FOLDER/study.md and tables in FOLDER/study instead

Tables (.csv) and figures go to study/<name of the study without 'study-'>. In the page, what stands between
"<!-- study NAME -->" and "<!-- /study -->" is replaced by what sections.py and compare.py make of the tables.
"""
import os
import re
import shutil
import sys

sys.dont_write_bytecode = True
import compare  # noqa: E402
import sections  # noqa: E402

BLOCK = re.compile(r"<!-- study ([a-z-]+) -->\n.*?<!-- /study -->", re.DOTALL)


def take(folder, to):
    """What a report made, and a row a trial; what was there before of the same study goes."""
    report = os.path.join(folder, "report")
    if not os.path.isfile(os.path.join(report, "summary.csv")):
        raise OSError(f"{folder}: holds no report; make it with: mhe-study report {folder}")
    with open(os.path.join(folder, "study.json"), encoding="utf-8") as file:
        name = compare.study_name(file.read())
    target = os.path.join(to, name)
    shutil.rmtree(target, ignore_errors=True)
    os.makedirs(target)
    for made in sorted(os.listdir(report)):
        if made.endswith((".csv", ".pdf", ".png")) and made != "noise_example.csv":
            shutil.copyfile(os.path.join(report, made), os.path.join(target, made))
    shutil.copyfile(os.path.join(folder, "results.csv"), os.path.join(target, "results.csv"))
    print(f"{target}: {sum(os.path.getsize(os.path.join(target, f)) for f in os.listdir(target)) / 1e6:.2f} MB")


def filled(page, tables):
    def replace(match):
        name = match.group(1)
        if name not in sections.BLOCKS:
            raise OSError(f"study.md: unknown block '{name}' (valid: {', '.join(sorted(sections.BLOCKS))})")
        return f"<!-- study {name} -->\n{sections.block(name, tables)}<!-- /study -->"

    return BLOCK.sub(replace, page)


def main(words):
    here = os.path.dirname(os.path.abspath(__file__))
    docs, check, folders = os.path.dirname(here), False, []
    while words:
        word = words.pop(0)
        if word == "--check":
            check = True
        elif word == "--to" and words:
            docs = words.pop(0)
        elif word.startswith("-"):
            print(__doc__, file=sys.stderr)
            return 2
        else:
            folders.append(word)
    path = os.path.join(docs, "study.md")
    try:
        for folder in folders:
            take(folder, os.path.join(docs, "study"))
        with open(path, encoding="utf-8") as file:
            page = file.read()
        fresh = filled(page, os.path.join(docs, "study"))
    except (OSError, compare.WrongTable) as why:
        print(f"update.py: {why}", file=sys.stderr)
        return 2
    if check:
        if fresh != page:
            print(f"{path} is stale; '{os.path.relpath(__file__)}' renews it")
        return int(fresh != page)
    if fresh != page:
        with open(path, "w", encoding="utf-8") as file:
            file.write(fresh)
        print(f"updated {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
