#!/usr/bin/env python3
"""Puts the page, its modules and the WebAssembly module into one file, which works from a disk: bundle.py WASM OUTPUT"""
import base64, json, pathlib, re, sys

page = pathlib.Path(__file__).parent / "page"


def module(name):
    """A module without imports and exports: all of them share one script."""
    text = re.sub(r"^import .*\n", "", (page / name).read_text(), flags=re.M)
    return re.sub(r"^export (async |function|const)", r"\1", text, flags=re.M)


wasm = base64.b64encode(pathlib.Path(sys.argv[1]).read_bytes()).decode()
script = "\n".join(module(name) for name in ("maps.js", "score.js", "app.js"))
script += f"\nstart({json.dumps(wasm)}, {json.dumps((page / 'worker.js').read_text())});\n"
html = (page / "index.html").read_text()
html = html.replace('<link rel="stylesheet" href="style.css">', f"<style>\n{(page / 'style.css').read_text()}</style>")
html = re.sub(r'(<script type="module">\n).*?(?=</script>)', lambda m: m[1] + script, html, flags=re.S)
pathlib.Path(sys.argv[2]).write_text(html)
