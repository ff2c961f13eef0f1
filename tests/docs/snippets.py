# SPDX-License-Identifier: Apache-2.0
"""Does what the pages tell a reader to do (README.md, CONTRIBUTING.md, docs/, the READMEs of plugins and models): every block
of theirs is run, checked or compiled.

    snippets.py SOURCE_DIR PROGRAMS [PAGE]...

A page's blocks are done in their order, in a folder of its own that looks like a clone with a build in build/release and the
files of a reader beside it (scene.py). A fenced block says what it is (sh, yaml, python, octave, csv, json, text); an indented one
is commands where its first word is one, else YAML. Commands are run; YAML passes `mhe-run --check`. Remarks before a block:

    <!-- not run: WHY -->     nothing is run; programs, options and files in models/ must be there
    <!-- file: PATH -->       a file that another test compiles; docs.sh keeps the block equal to it
    <!-- with: ARGUMENTS -->  each command of ours gets these too, so that it ends soon
    <!-- save: NAME -->       the block is that file; later blocks use it
    <!-- do: COMMAND -->      of a saved block, instead of mhe-run --check
    <!-- like: CONFIG -->     YAML that is a part of a config: its keys are set in CONFIG, which is then checked
    <!-- each: CONFIG -->     the same of each line: one or the other

A block that is none of these fails. What needs a program that is missing here is counted as skipped.
"""
import collections
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import scene

try:
    import yaml
except ImportError:
    print("skipped: python3-yaml is missing")
    sys.exit(77)

source, programs = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
# YAML 1.1 as the library reads it, and not as PyYAML does: 1e-3 is a number.
yaml.SafeLoader.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
                                      list("-+.0123456789"))
build = programs.parent
failures, counts, helps = [], collections.Counter(), {}
COMMANDS = re.compile(r"([A-Z_]+=\S+ )*(\./bootstrap|\S*/?mhe-[a-z]+|cp|cmake|ctest|octave|mex|export|docs/|tests/|for|apt|perf|podman)\b")


class Block:
    def __init__(self, page, line, kind, text, remarks):
        self.page, self.line, self.kind, self.text, self.remarks = page, line, kind, text, remarks

    def fail(self, text):
        failures.append(f"{self.page}:{self.line}: {text}")


def blocks_of(page, text):
    """Fenced and indented blocks with the remarks before them. What is indented in a list is a block after a blank line."""
    lines = text.splitlines()
    k, remarks, at_list, after_blank = 0, {}, False, True
    while k < len(lines):
        line = lines[k]
        fence = re.match(r"( *)```(\w*)", line)
        if fence:
            end = next(j for j in range(k + 1, len(lines)) if lines[j].strip() == "```")
            body = "\n".join(x[len(fence[1]):] for x in lines[k + 1:end]) + "\n"
            yield Block(page, k + 1, fence[2] or "?", body, remarks)
            k, remarks, after_blank = end + 1, {}, False
            continue
        depth = len(line) - len(line.lstrip())
        if after_blank and line.strip() and depth >= (6 if at_list else 4):
            end = k
            while end < len(lines) and (not lines[end].strip() or len(lines[end]) - len(lines[end].lstrip()) >= depth):
                end += 1
            body = "\n".join(x[depth:] for x in lines[k:end]).rstrip() + "\n"
            yield Block(page, k + 1, "sh" if COMMANDS.match(body) else "yaml", body, remarks)
            k, remarks, after_blank = end, {}, True
            continue
        remark = re.match(r" *<!-- ([a-z ]+?)(?:: (.*?))? -->$", line)
        if remark:
            remarks[remark[1]] = remark[2] or ""
        elif line.strip():
            remarks = {}
            at_list = bool(re.match(r" *(\d+\.|[-*]) ", line)) or (at_list and depth > 0)
        after_blank = not line.strip() or remark is not None
        k += 1


def run(block, folder, words, given=""):
    environment = {**os.environ, "PYTHONPATH": str(build / "python"), "PYTHONDONTWRITEBYTECODE": "1",
                   "PATH": f"{programs}:{os.environ['PATH']}"}
    done = subprocess.run(words, input=given, text=True, capture_output=True, cwd=folder, env=environment)
    if done.returncode != 0:
        block.fail(f"ends with status {done.returncode}:\n{done.stdout[-500:]}{done.stderr[-1500:]}")


def help_of(program):
    if program not in helps:
        helps[program] = subprocess.run([programs / program, "--help"], capture_output=True, text=True).stdout
    return helps[program]


def commands_of(text):
    for line in text.replace("\\\n", " ").splitlines():
        try:
            words = shlex.split(line, comments=True)
        except ValueError:
            continue
        while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
            words = words[1:]
        if words and Path(words[0]).name.startswith("mhe-"):
            yield Path(words[0]).name, words[1:]


def look_at_commands(block):
    """Programs, options and files of what is not run."""
    for name, words in commands_of(block.text):
        if not (programs / name).exists():
            block.fail(f"there is no program {name}")
            continue
        for word in words:
            if word.startswith("--") and not re.search(rf"{re.escape(word)}\b", help_of(name)):
                block.fail(f"{name} knows no {word}")
            if word.startswith("models/") and "*" not in word and not (source / word).exists():
                block.fail(f"there is no {word}")
        counts["commands looked at"] += 1


def run_commands(block, folder):
    if re.match(r"octave\b", block.text) and not shutil.which("octave"):
        counts["skipped"] += 1
        return
    text = block.text
    if "with" in block.remarks:
        text = re.sub(r"^(\S*(?:mhe-\w+|octave)\b.*?)( +#.*)?$", lambda m: f"{m[1]} {block.remarks['with']}", text, flags=re.M)
    run(block, folder, ["bash", "-eu", "-o", "pipefail", "-c", text])
    counts["commands run"] += 1


def check_yaml(block, folder):
    if "each" in block.remarks:
        for line in block.text.splitlines():
            check_yaml(Block(block.page, block.line, "yaml", line, {"like": block.remarks["each"]}), folder)
        return
    try:
        config = yaml.safe_load(block.text)
    except yaml.YAMLError as error:
        block.fail(f"this is no YAML, and no command: {error}")
        return
    counts["configs"] += 1
    if "like" in block.remarks:
        sets = [word for key, value in config.items() for word in ("--set", f"{key}={json.dumps(value)}")]
        run(block, folder, [programs / "mhe-run", "--check", block.remarks["like"], *sets])
        return
    name = block.remarks.get("save", "config.yaml")
    (folder / name).write_text(block.text)
    if "do" in block.remarks:
        run(block, folder, ["bash", "-euc", block.remarks["do"]])
    else:
        run(block, folder, [programs / "mhe-run", "--check", name])


def do(block, folder):
    if "not run" in block.remarks:
        look_at_commands(block)
        counts["not run"] += 1
    elif "file" in block.remarks:
        counts["compiled elsewhere"] += 1
        if not (source / block.remarks["file"]).exists():
            block.fail(f"there is no {block.remarks['file']}")
    elif block.kind == "sh":
        run_commands(block, folder)
    elif block.kind == "yaml":
        check_yaml(block, folder)
    elif block.kind in ("csv", "json") and "save" in block.remarks:
        (folder / block.remarks["save"]).write_text(block.text)
    elif block.kind == "python":
        if not (build / "python/myohorizon/_binding.py").exists():
            counts["skipped"] += 1
            return
        run(block, folder, ["/usr/bin/python3", "-"], block.text)
        counts["python"] += 1
    elif block.kind == "octave":
        if not shutil.which("octave-cli") or not (build / "matlab/mhe_gateway.mex").exists():
            counts["skipped"] += 1
            return
        run(block, folder, ["octave-cli", "--norc", "--no-gui", "--path", str(build / "matlab"), "--eval", block.text])
        counts["octave"] += 1
    elif block.kind != "text":
        block.fail(f"a block of '{block.kind}' says nothing of what it is (tests/docs/snippets.py)")


def main():
    work = Path(tempfile.mkdtemp())
    os.environ["XDG_CACHE_HOME"] = str(work / "cache")
    pages = sys.argv[3:] or [str(page.relative_to(source)) for pattern in ("README.md", "CONTRIBUTING.md", "docs/*.md", "*s/*/README.md")
                             for page in sorted(source.glob(pattern)) if page.parts[-3] in ("plugins", "models") or "*s" not in pattern]
    try:
        for page in pages:
            folder = scene.make(work / page.replace("/", "_"), page, source, build)
            for block in blocks_of(page, (source / page).read_text()):
                do(block, folder)
    finally:
        shutil.rmtree(work)
    print(", ".join(f"{n} {what}" for what, n in sorted(counts.items())))
    if failures:
        sys.exit("\n".join(failures))
    if not sys.argv[3:] and not all(counts[what] > 3 for what in ("commands run", "commands looked at", "configs")):
        sys.exit("the blocks are not found")


main()
