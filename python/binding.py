# SPDX-License-Identifier: Apache-2.0
"""Makes myohorizon/_binding.py from the public headers: what libmhe.so offers, as cffi reads it.

    binding.py OUT.py COMPILER INCLUDE_DIR...

The headers are preprocessed by the compiler that built the library. Of the result only what comes from mhe/*.h is kept,
without inline functions and attributes; numeric macros MHE_* are added as constants. The module holds no code of a
machine: it loads the library when it is imported, in a tenth of the time that parsing the headers then would take.
"""
import re
import subprocess
import sys

from cffi import FFI

HEADERS = ["abi", "config", "cost", "emg", "estimator", "findings", "host", "inspect", "layout", "library", "live",
           "outbox", "plugin", "recording", "table", "version"]


def preprocess(compiler, folders, *flags):
    includes = [f"-I{folder}" for folder in folders]
    source = "".join(f"#include <mhe/{name}.h>\n" for name in HEADERS)
    done = subprocess.run([compiler, "-std=c11", "-E", *flags, *includes, "-x", "c", "-"], input=source, text=True,
                          capture_output=True, check=True)
    return done.stdout


def ours(text):
    """The lines that come from mhe/*.h."""
    kept, inside = [], False
    for line in text.splitlines():
        marker = re.match(r'# \d+ "([^"]*)"', line)
        if marker:
            inside = re.search(r"(^|/)mhe/[a-z]+\.h$", marker.group(1)) is not None
        elif inside:
            kept.append(line)
    return "\n".join(kept)


def without_attributes(text):
    """Without __attribute__((...)), whose parentheses nest."""
    while True:
        begin = text.find("__attribute__")
        if begin < 0:
            return text
        depth, end = 0, text.index("(", begin)
        while True:
            depth += {"(": 1, ")": -1}.get(text[end], 0)
            end += 1
            if depth == 0:
                break
        text = text[:begin] + text[end:]


def without_inline(text):
    """Without the functions that are defined in the headers: they exist in no library."""
    while True:
        found = re.search(r"static inline[^;{]*\{", text)
        if not found:
            return text
        depth, end = 1, found.end()
        while depth > 0:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        text = text[:found.start()] + text[end:]


def constants(text):
    """#define MHE_X 3 and MHE_X 1u; texts come as Python strings."""
    numbers, texts = {}, {}
    for name, value in re.findall(r"^#define (MHE_\w+) (.+)$", text, re.M):
        if re.fullmatch(r"\d+u?|0x[0-9a-f]+u?", value):
            numbers[name] = int(value.rstrip("u"), 0)
        elif re.fullmatch(r'"[^"]*"', value):
            texts[name] = value[1:-1]
    return numbers, texts


def main(out, compiler, *folders):
    declarations = without_inline(without_attributes(ours(preprocess(compiler, folders))))
    numbers, texts = constants(preprocess(compiler, folders, "-dM"))
    # An array's length must be a number.
    declarations = re.sub(r"\bMHE_[A-Z_]+\b", lambda m: str(numbers.get(m.group(0), m.group(0))), declarations)
    # The functions that Python lends to the library.
    declarations += """
        typedef void (*python_log)(const mhe_host *, int32_t, const char *);
        typedef const void *(*python_service)(const mhe_host *, const char *);
        typedef const mhe_cost_ops *(*python_find)(const mhe_own_costs *, const char *, void **);
        typedef mhe_status (*python_layout)(const void *, const mhe_problem *, mhe_cost_layout *, mhe_error *);
        typedef mhe_status (*python_evaluate)(const void *, const mhe_stage *, double *, mhe_error *);
    """
    ffi = FFI()
    ffi.set_source("_binding", None)
    ffi.cdef(declarations + "".join(f"\n#define {name} {value}" for name, value in sorted(numbers.items())))
    ffi.emit_python_code(out)
    with open(out, "a", encoding="utf-8") as file:
        file.write(f"\ntexts = {texts!r}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
