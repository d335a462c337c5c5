#!/usr/bin/env python3
"""Fills scripts/performance.md and scripts/papers.md with what the measured pages say: performance-page.py [--check]

{PAGE: ROW: COLUMN} is the cell of the first table of a page that has both. Pages are those of docs/measurements, gallery and renderers. ROW is how the
line begins; +N after the column N cells further right. Rows and columns may have several names, separated by " // ".
{FILE says TEXT} is the text, which the file must have. {commit of PAGE} is that of the run that wrote the page, {version of PAGE} the version of wis there.
{size of LIBRARY} is that on record in scripts/check-size.sh. {instructions of CALL} and {earlier of CALL} are those on record in scripts/check-instructions.sh, of this version and the one before.
{claims of PAGE} are the rows of a paper's claims, {holding of PAGE ...} how many of how many hold, {N VERDICT of PAGE ...} how many have another verdict. 
What is behind a line "=== NAME PATH" goes between the marks of that name in the file of that path. What a page no longer has fails the script.
"""
import os
import re
import subprocess
import sys

os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
faults = []


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def path_of(page):
    measured = f"docs/measurements/{page}.md"
    return measured if os.path.exists(measured) else f"docs/{page}.md"


def rows_of(path):
    """Of each row of each table of a page: the cells of the table's head, the line, and its cells."""
    head = None
    for line in read(path).splitlines():
        cells = [text.replace("**", "").strip() for text in line.strip("|").split("|")]
        if not line.startswith("|"):
            head = None
        elif head is None:
            head = cells
        else:
            yield head, line, cells


def cell(page, row, column):
    column, _, more = column.partition(" +")
    rows = tuple(f"| {begin} |" for begin in row.split(" // "))
    for head, line, cells in rows_of(path_of(page)):
        at = next((head.index(name) for name in column.split(" // ") if name in head), None)
        if at is not None and line.startswith(rows):
            return cells[at + int(more or 0)]
    faults.append(f"{path_of(page)} has no '{column}' of '{row}'")
    return ""


def says(path, text):
    lines = re.sub(r"\s+", " ", re.sub(r"\n\s*///", " ", read(path)))
    if text not in lines:
        faults.append(f"{path} does not say '{text}'")
    return text


def commit(page):
    text = read(path_of(page))
    found = re.search(r"[Cc]ommit ([0-9a-f]{7,})", text) or re.search(r"Written\s+by\s+`make [a-z]*`\s+at\s+([0-9a-f]{7,})", text)
    return found.group(1) if found else "not recorded"


def version(page):
    manifest = subprocess.run(["git", "show", f"{commit(page)}:Cargo.toml"], capture_output=True, text=True, check=False).stdout
    found = re.search(r'^version = "(\d+\.\d+)', manifest, flags=re.M)
    return found.group(1) if found else "not recorded"


def recorded(script, name, column):
    """Of the row of that name in a check's table of what is on record."""
    found = re.search(rf"^{' +'.join(name.split())} +(\d.*)$", read(f"scripts/{script}.sh"), flags=re.M)
    if not found:
        faults.append(f"scripts/{script}.sh has no '{name}'")
    return found.group(1).split()[column] if found else "0"


def size(name):
    return f"{round(int(recorded('check-size', name, 2)), -3) // 1000} kB"


def claims(page):
    """Of each claim: the claim, what the paper says, what was measured, the verdict, and the cause if it does not hold."""
    rows = [cells[:5] for head, line, cells in rows_of(path_of(page)) if head[0] == "claim" and not line.startswith("|---")]
    if not rows:
        faults.append(f"{path_of(page)} has no claims")
    return rows


def listed(page):
    return "\n".join("| " + " | ".join([page[-4:], *row[:3], ": ".join(row[3:])]) + " |" for row in claims(page))


def holding(pages):
    rows = [row for page in pages.split() for row in claims(page)]
    return f"{sum(row[3] == 'holds' for row in rows)} of {len(rows)}"


def judged(verdict, pages):
    return str(sum(row[3] == verdict for page in pages.split() for row in claims(page)))


FILLED = {
    r"claims of ([^{}]*)": listed,
    r"holding of ([^{}]*)": holding,
    r"N ([^{}]*?) of ([^{}]*)": judged,
    r"instructions of ([^{}]*)": lambda call: recorded("check-instructions", call, 2),
    r"earlier of ([^{}]*)": lambda call: recorded("check-instructions", call, 3),
    r"size of ([^{}]*)": size,
    r"commit of ([^{}]*)": commit,
    r"version of ([^{}]*)": version,
    r"(\S*) says ([^{}]*)": says,
    r"([a-z-]*): ([^{}]*?): ([^{}:]*)": cell,
}


def fill(text):
    for pattern, of in FILLED.items():
        text = re.sub(r"\{" + pattern + r"\}", lambda m, of=of: of(*m.groups()), text)
    return text


page, *blocks = re.split(r"^=== (\w+) (\S+)\n", fill(read("scripts/performance.md")), flags=re.M)
written = {"docs/performance.md": page, "docs/papers.md": fill(read("scripts/papers.md"))}
for name, path, text in zip(blocks[::3], blocks[1::3], blocks[2::3]):
    around = written.get(path) or read(path)
    if f"<!-- {name}: " not in around:
        faults.append(f"{path} has no place for '{name}'")
    written[path] = re.sub(rf"(<!-- {name}: .*\n)[\s\S]*(<!-- end of {name} -->)", lambda m: m.group(1) + text + m.group(2), around)
if faults:
    sys.exit("\n".join(f"performance-page: {fault}" for fault in faults))
if sys.argv[1:] == ["--check"]:
    stale = [path for path, text in written.items() if read(path) != text]
    print(f"stale {', '.join(stale)}: make performance" if stale else "ok    what pages by hand take from measured ones")
    sys.exit(bool(stale))
for path, text in written.items():
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
