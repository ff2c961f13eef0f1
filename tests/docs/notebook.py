# SPDX-License-Identifier: Apache-2.0
"""The notebooks of docs/notebook run from their first cell to their last, and their figures show something.

    notebook.py check|update SOURCE_DIR PYTHON_PACKAGE      skipped (77) where matplotlib or pandas is missing

The cells are executed as they stand, in one interpreter and in the notebook's folder; `update` keeps what they print and draw in
the file.
"""
import ast
import base64
import contextlib
import io
import json
import os
import sys
import traceback
from pathlib import Path

mode = sys.argv.pop(1)
source = Path(sys.argv[1]).resolve()
sys.path.insert(0, sys.argv[2])
try:
    import matplotlib
    import numpy as np
    import pandas  # noqa: F401
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)
if not (Path(sys.argv[2]) / "myohorizon/_binding.py").exists():
    print("skipped: the Python package is not built")
    sys.exit(77)
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def look_at(figure, path):
    """Every panel has lines with numbers that move."""
    for axis in figure.axes:
        lines = [np.asarray(line.get_ydata(), float) for line in axis.lines]
        if not lines or any(np.isfinite(y).sum() < 20 or np.ptp(y[np.isfinite(y)]) == 0 for y in lines):
            sys.exit(f"{path}: a panel shows nothing")


def execute(source, names, label):
    """Runs a cell; returns the value of its last line, where that is an expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, label, "exec"), names)
    return eval(compile(ast.Expression(last.value), label, "eval"), names) if last is not None else None


def outputs_of(cell, names, path, number):
    printed = io.StringIO()
    try:
        with contextlib.redirect_stdout(printed):
            value = execute("".join(cell["source"]), names, f"{path.name}, cell {number}")
    except Exception:
        sys.exit(f"{path}: cell {number}:\n{traceback.format_exc()}")
    outputs = []
    if printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue().splitlines(keepends=True)})
    for figure in map(plt.figure, plt.get_fignums()):
        look_at(figure, path)
        png = io.BytesIO()
        figure.savefig(png, dpi=80, metadata={"Software": None})
        outputs.append({"output_type": "display_data", "metadata": {},
                        "data": {"image/png": base64.b64encode(png.getvalue()).decode(), "text/plain": ["<Figure>"]}})
    plt.close("all")
    if value is not None:
        outputs.append({"output_type": "execute_result", "execution_count": number, "metadata": {},
                        "data": {"text/plain": repr(value).splitlines(keepends=True)}})
    return outputs


def kinds(outputs):
    return [(output["output_type"], sorted(output.get("data", {}))) for output in outputs]


def run(path):
    os.chdir(path.parent)
    book = json.loads(path.read_text())
    names, figures, number = {"__name__": "__main__"}, 0, 0
    for cell in book["cells"]:
        if cell["cell_type"] != "code":
            continue
        number += 1
        outputs = outputs_of(cell, names, path, number)
        if mode == "check" and kinds(outputs) != kinds(cell["outputs"]):
            sys.exit(f"{path}: cell {number} gives other kinds of outputs than the file keeps; 'notebook.py update' renews them")
        cell["outputs"], cell["execution_count"] = outputs, number
        figures += sum("image/png" in output.get("data", {}) for output in outputs)
    if mode == "update":
        path.write_text(json.dumps(book, indent=1, ensure_ascii=False) + "\n")
    return figures


notebooks = sorted((source / "docs/notebook").glob("*.ipynb"))
if not notebooks:
    sys.exit("there is no notebook")
for notebook in notebooks:
    n = run(notebook)
    print(f"{notebook.name}: {n} figures")
    if n < 3:
        sys.exit(f"{notebook.name}: figures are missing")
