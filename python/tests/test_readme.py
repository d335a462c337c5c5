"""What README.md shows runs."""

import pathlib
import re

README = pathlib.Path(__file__).parents[1] / "README.md"


def test_the_first_picture_of_the_readme_is_made(tmp_path, monkeypatch):
    text = README.read_text()
    assert len(text.splitlines()) <= 60
    program = re.search("```python\n(.*?)```", text, re.S)[1]
    assert len([line for line in program.splitlines() if line]) <= 24
    monkeypatch.chdir(tmp_path)
    exec(program, {})
    picture = (tmp_path / "first.pgm").read_bytes()
    # A ball: dark at the corners, and brighter towards the sun than below.
    rows = [picture[-480 * 352 + 480 * y:][:480] for y in range(352)]
    assert rows[2][2] == 0 and rows[110][170] > rows[300][260] + 50
