// SPDX-License-Identifier: Apache-2.0
// The theme's style sheet knows tables by a class that Markdown does not give them.
document.querySelectorAll("div.rst-content table").forEach((table) => table.classList.add("docutils"));
