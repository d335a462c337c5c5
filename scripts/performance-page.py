#!/usr/bin/env python3
"""Fills scripts/performance.md with numbers of the measured pages: performance-page.py [--check]

{PAGE: ROW: COLUMN} is the cell of the first table of docs/PAGE.md that has both; ROW is how the line begins, +N after the column N cells
further right. {FILE says TEXT} is the text, which the file must have. {commit of PAGE} is that of the run that wrote it. What stands
behind a line "=== NAME" goes between the marks of that name in README.md. What a page no longer has fails the script.
"""
import os
import re
import sys

os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
faults = []


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def cell(page, row, column):
    column, _, more = column.partition(" +")
    at, is_header = None, True
    for line in read(f"docs/{page}.md").splitlines():
        if not line.startswith("|"):
            at, is_header = None, True
            continue
        cells = [text.replace("**", "").strip() for text in line.strip("|").split("|")]
        if is_header:
            at, is_header = cells.index(column) if column in cells else None, False
        elif at is not None and line.startswith(f"| {row} |"):
            return cells[at + int(more or 0)]
    faults.append(f"docs/{page}.md has no '{column}' of '{row}'")
    return ""


def says(path, text):
    lines = re.sub(r"\s+", " ", re.sub(r"\n\s*///", " ", read(path)))
    if text not in lines:
        faults.append(f"{path} does not say '{text}'")
    return text


def commit(page):
    found = re.search(r"Commit ([0-9a-f]{7,})", read(f"docs/{page}.md"))
    return found.group(1) if found else "not recorded"


def fill(text):
    text = re.sub(r"\{commit of ([^{}]*)\}", lambda m: commit(m.group(1)), text)
    text = re.sub(r"\{(\S*) says ([^{}]*)\}", lambda m: says(*m.groups()), text)
    return re.sub(r"\{([a-z]*): ([^{}]*): ([^{}]*)\}", lambda m: cell(*m.groups()), text)


page, *blocks = re.split(r"^=== (\w+)\n", fill(read("scripts/performance.md")), flags=re.M)
readme = read("README.md")
for name, text in zip(blocks[::2], blocks[1::2]):
    readme = re.sub(rf"(<!-- {name}: .*\n)[\s\S]*(<!-- end of {name} -->)", lambda m: m.group(1) + text + m.group(2), readme)
if faults:
    sys.exit("\n".join(f"performance-page: {fault}" for fault in faults))
written = {"docs/performance.md": page, "README.md": readme}
if sys.argv[1:] == ["--check"]:
    stale = [path for path, text in written.items() if read(path) != text]
    print(f"stale {', '.join(stale)}: make performance" if stale else "ok    docs/performance.md and what README.md takes from pages")
    sys.exit(bool(stale))
for path, text in written.items():
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
