# SPDX-License-Identifier: Apache-2.0
"""What README.md and docs/*.md tell a reader to type.

    snippets.py SOURCE_DIR PROGRAMS

Blocks of ```python are run, each by itself from the source folder; those of ```octave, where Octave and the gateway are
there. Commands in indented blocks: their programs and options must exist, their files in models/ too, and what `mhe-run` is
to run passes --check with the same keys. "<!-- not run: why -->" before a block leaves it out. Skipped (77) are blocks
whose language is missing.
"""
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

source, programs = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
build = programs.parent
failures, counts = [], {"python": 0, "octave": 0, "command": 0, "checked": 0}
helps = {}


def fail(page, line, text):
    failures.append(f"{page}:{line}: {text}")


def run(page, line, words, code):
    environment = {**os.environ, "PYTHONPATH": str(build / "python"), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(words, input=code, text=True, capture_output=True, cwd=source, env=environment)
    if done.returncode != 0:
        fail(page, line, f"the block ends with status {done.returncode}:\n{done.stdout[-500:]}{done.stderr[-1500:]}")


def run_block(page, line, language, code):
    if language == "python" and (build / "python/myohorizon/_binding.py").exists():
        counts["python"] += 1
        run(page, line, ["/usr/bin/python3", "-"], code)
    octave = shutil.which("octave-cli")
    if language == "octave" and octave and (build / "matlab/mhe_gateway.mex").exists():
        counts["octave"] += 1
        run(page, line, [octave, "--norc", "--no-gui", "--path", str(build / "matlab"), "--eval", code], "")


def help_of(program):
    if program not in helps:
        helps[program] = subprocess.run([programs / program, "--help"], capture_output=True, text=True).stdout
    return helps[program]


def check_command(page, line, text):
    try:
        words = shlex.split(text, comments=True)
    except ValueError:
        return  # a formula
    while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
        words = words[1:]
    name = Path(words[0]).name if words else ""
    if not name.startswith("mhe-"):
        return
    if not (programs / name).exists():
        fail(page, line, f"there is no program {name}")
        return
    counts["command"] += 1
    for word in words[1:]:
        if word.startswith("--") and not re.search(rf"{re.escape(word)}\b", help_of(name)):
            fail(page, line, f"{name} knows no {word}")
        if word.startswith("models/") and not (source / word).exists():
            fail(page, line, f"there is no {word}")
    configs = [word for word in words[1:] if word.startswith("models/") and word.endswith(".yaml")]
    if name == "mhe-run" and len(configs) == 1 and "--describe" not in words:
        sets = [x for i, word in enumerate(words) if word == "--set" for x in ("--set", words[i + 1])]
        done = subprocess.run([programs / name, "--check", configs[0], *sets], cwd=source, capture_output=True, text=True)
        counts["checked"] += 1
        if done.returncode != 0:
            fail(page, line, f"{text}: {done.stderr.strip()}")


def read(page):
    text = (source / page).read_text()
    lines = text.splitlines()
    number, left_out = 0, False
    while number < len(lines):
        line = lines[number]
        fence = re.match(r" *```(\w*)", line)
        if fence:
            end = next(k for k in range(number + 1, len(lines)) if lines[k].strip() == "```")
            if not left_out:
                run_block(page, number + 1, fence[1], "\n".join(lines[number + 1:end]) + "\n")
            number, left_out = end + 1, False
            continue
        if line.startswith("    ") and line.strip():
            begin, command = number, line.strip()
            while command.endswith("\\") and number + 1 < len(lines):
                number += 1
                command = command[:-1] + " " + lines[number].strip()
            if not left_out:
                check_command(page, begin + 1, command)
        elif line.strip():
            left_out = line.startswith("<!-- not run:")
        number += 1


def main():
    work = tempfile.mkdtemp()
    os.environ["XDG_CACHE_HOME"] = work
    pages = ["README.md", *sorted(f"docs/{page.name}" for page in (source / "docs").glob("*.md"))]
    for page in pages:
        read(page)
    shutil.rmtree(work)
    print(", ".join(f"{n} {what}" for what, n in counts.items()))
    if failures:
        sys.exit("\n".join(failures))
    if counts["command"] == 0:
        sys.exit("no commands were found")


main()
