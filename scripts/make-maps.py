#!/usr/bin/env python3
"""Writes maps, sound and broken, into a folder, and their list to stdout: make-maps.py FOLDER

A line of the list: name, "good" or "bad", and a regular expression of what a reader prints, with tabs between them.
"""
import os
import random
import struct
import sys
import zlib

WIDTH, HEIGHT = 16, 8
HEADER = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"


def pixels(width=WIDTH, height=HEIGHT):
    """RGBE, with repeats as runs need them, and none that looks like a run."""
    return [[(20 + 7 * (x // 3), 40 + y, 200, 128 + y % 3) for x in range(width)] for y in range(height)]


def value(pixel):
    r, g, b, e = pixel
    return [c * 2.0 ** (e - 136) if e else 0.0 for c in (r, g, b)]


def flat(row):
    return b"".join(bytes(p) for p in row)


def new_runs(row):
    out = bytes([2, 2, len(row) >> 8, len(row) & 255])
    for part in range(4):
        column = [p[part] for p in row]
        x = 0
        while x < len(column):
            run = 1
            while x + run < len(column) and run < 127 and column[x + run] == column[x]:
                run += 1
            out += bytes([128 + run, column[x]]) if run > 1 else bytes([1, column[x]])
            x += run
    return out


def old_runs(row):
    out, x = b"", 0
    while x < len(row):
        run = 1
        while x + run < len(row) and row[x + run] == row[x]:
            run += 1
        out += bytes(row[x])
        left = run - 1
        while left:
            out += bytes([1, 1, 1, left & 255])
            left >>= 8
        x += run
    return out


def size(width, height):
    return b"-Y %d +X %d\n" % (height, width)


def hdr(rows, encode=new_runs, line=None, header=HEADER):
    return header + (line or size(len(rows[0]), len(rows))) + b"".join(encode(row) for row in rows)


def exr(rows, channels="BGR", half=False, zipped=False, data=None, show=None):
    """Scan lines of an OpenEXR file; `rows` of RGB triples fill the window of data."""
    width, height = len(rows[0]), len(rows)
    data = data or (0, 0, width - 1, height - 1)
    listed = b"".join(c.encode() + b"\0" + struct.pack("<IIII", 1 if half else 2, 0, 1, 1) for c in channels) + b"\0"
    attributes = [
        ("channels", "chlist", listed),
        ("compression", "compression", bytes([2 if zipped else 0])),
        ("dataWindow", "box2i", struct.pack("<4i", *data)),
        ("displayWindow", "box2i", struct.pack("<4i", *(show or data))),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ]
    out = b"\x76\x2f\x31\x01" + struct.pack("<I", 2)
    for name, kind, content in attributes:
        out += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(content)) + content
    out += b"\0"
    chunks = []
    for y, row in enumerate(rows):
        raw = b""
        for channel in channels:
            index = {"R": 0, "G": 1, "B": 2}.get(channel, 0)
            raw += b"".join(struct.pack("<e" if half else "<f", p[index]) for p in row)
        if zipped:
            raw = deflated(raw)
        chunks.append(struct.pack("<iI", data[1] + y, len(raw)) + raw)
    offset = len(out) + 8 * height
    for chunk in chunks:
        out += struct.pack("<Q", offset)
        offset += len(chunk)
    return out + b"".join(chunks)


def deflated(raw):
    """OpenEXR's ZIPS: even bytes before odd ones, differences, zlib; plain where that is not shorter."""
    parted = raw[0::2] + raw[1::2]
    differences = bytes([parted[0]]) + bytes((b - a + 128) & 255 for a, b in zip(parted, parted[1:]))
    packed = zlib.compress(differences)
    return packed if len(packed) < len(raw) else raw


def printed(values):
    """What c-examples/maps/read.c prints of rows of RGB triples."""
    sums = [0.0, 0.0, 0.0]
    for row in values:
        for p in row:
            sums = [s + c for s, c in zip(sums, p)]
    numbers = ["%.9g" % n for n in sums + [values[0][0][0]]]
    text = "%d x %d: %s %s %s, first %s" % (len(values[0]), len(values), *numbers)
    return text.replace(".", r"\.").replace("+", r"\+") + "$"


def main(folder):
    os.makedirs(os.path.join(folder, "folder.hdr"), exist_ok=True)

    def put(name, content):
        with open(os.path.join(folder, name), "wb") as file:
            file.write(content)

    def listed(name, kind, pattern):
        print(name, kind, pattern, sep="\t")

    def bad(name, pattern, content=None):
        if content is not None:
            put(name, content)
        listed(name, "bad", pattern + ".*; wanted is a lat-long map")

    def good(name, values, content):
        put(name, content)
        listed(name, "good", printed(values))

    rows = pixels()
    rgb = [[value(p) for p in row] for row in rows]
    whole = hdr(rows)

    # What is no map.
    bad("absent.hdr", "No such file")
    bad("folder.hdr", "Is a directory")
    bad("empty.hdr", "an empty file", b"")
    bad("byte.hdr", "neither a Radiance nor an OpenEXR file", b"#")
    bad("text.hdr", "neither a Radiance nor an OpenEXR file", b"not a map\n")
    bad("zeros.hdr", "neither a Radiance nor an OpenEXR file", bytes(4096))
    bad("noise.hdr", "neither a Radiance nor an OpenEXR file", random.Random(1).randbytes(4096))
    bad("picture.hdr", "a PNG picture", b"\x89PNG\r\n\x1a\n" + bytes(64))
    bad("photograph.hdr", "a JPEG picture", b"\xff\xd8\xff\xe0" + bytes(64))
    bad("scan.hdr", "a TIFF picture", b"II*\0" + bytes(64))
    bad("page.hdr", "a page of HTML", b"<!doctype html><title>404</title>")

    # Headers.
    bad("header.hdr", "cut off in its header", HEADER[:20])
    bad("no-size.hdr", "cut off in its header", HEADER)
    bad("size.hdr", 'with "-Y eight .X 16" in place of a size', HEADER + b"-Y eight +X 16\n")
    bad("columns.hdr", 'with ".X 16 -Y 8" in place of a size', hdr(rows, line=b"+X 16 -Y 8\n"))
    bad("xyz.hdr", "FORMAT=32-bit_rle_xyze", hdr(rows, header=HEADER.replace(b"rgbe", b"xyze")))
    bad("none.hdr", "a map of 16 x 0 texels", hdr(rows, line=size(16, 0)))
    bad("less.hdr", "a map of 16 x -8 texels", hdr(rows, line=b"-Y -8 +X 16\n"))
    bad("huge.hdr", "a map of 99999999 x 99999999 texels", hdr(rows, line=size(99999999, 99999999)))
    bad("overflow.hdr", "a map of 999999999 x 8 texels", hdr(rows, line=b"-Y 8 +X 99999999999999999999999\n"))
    bad("wide.hdr", "a map of 65536 x 32768 texels", hdr(rows, line=size(65536, 32768)))
    bad("large.hdr", "row 1 of 16384 has another width|memory is out", hdr(rows, line=size(32767, 16384)))
    bad("cross.hdr", "a map of 12 x 16 texels, but a lat-long map", hdr(pixels(12, 16)))
    bad("square.hdr", "a map of 16 x 16 texels, but a lat-long map", hdr(pixels(16, 16)))

    # Rows.
    begin = len(HEADER + size(WIDTH, HEIGHT))
    length = len(new_runs(rows[0]))
    bad("no-rows.hdr", "row 1 of 8 is cut off", whole[:begin])
    bad("cut-first.hdr", "row 1 of 8 is cut off", whole[:begin + 9])
    bad("cut-middle.hdr", "row [45] of 8 is cut off", whole[:begin + (len(whole) - begin) // 2])
    bad("cut-last.hdr", "row 8 of 8 is cut off", whole[:-1])
    bad("cut-plain.hdr", "row 5 of 8 is cut off", hdr(rows, flat)[:begin + 4 * WIDTH * 9 // 2])
    bad("cut-old.hdr", "row 8 of 8 is cut off", hdr(rows, old_runs)[:-3])
    bad("no-length.hdr", "row 2 of 8 holds a run that does not fit",
        whole[:begin + length + 4] + b"\0" + whole[begin + length + 5:])
    bad("long-run.hdr", "row 1 of 8 holds a run that does not fit", whole[:begin + 4] + b"\xff" + whole[begin + 5:])
    bad("long-span.hdr", "row 1 of 8 holds a run that does not fit", whole[:begin + 4] + b"\x7f" + whole[begin + 5:])
    bad("other-width.hdr", "row 1 of 8 has another width", whole[:begin + 3] + b"\x11" + whole[begin + 4:])
    bad("old-first.hdr", "row 1 of 8 holds a run that does not fit", HEADER + size(16, 8) + b"\1\1\1\5" + bytes(600))
    bad("old-long.hdr", "row 1 of 8 holds a run that does not fit",
        HEADER + size(16, 8) + bytes([9, 9, 9, 128, 1, 1, 1, 16]) + bytes(600))
    bad("old-endless.hdr", "row 1 of 8 (holds a run that does not fit|is cut off)",
        HEADER + size(16, 8) + bytes([9, 9, 9, 128]) + b"\1\1\1\0" * 64)

    # Radiance files that are sound.
    good("plain.hdr", rgb, hdr(rows, flat))
    good("new.hdr", rgb, whole)
    good("old.hdr", rgb, hdr(rows, old_runs))
    good("comments.hdr", rgb, whole.replace(b"\nFORMAT", b"\n# by hand\nEXPOSURE=1\nFORMAT", 1))
    good("upwards.hdr", rgb[::-1], hdr(rows, line=b"+Y 8 +X 16\n"))
    good("mirrored.hdr", [row[::-1] for row in rgb], hdr(rows, line=b"-Y 8 -X 16\n"))
    even = [[(100, 90, 80, 129)] * 600 for _ in range(300)]
    good("old-far.hdr", [[value(p) for p in row] for row in even], hdr(even, old_runs))
    for name, width, height in [("narrow.hdr", 6, 3), ("short.hdr", 64, 31), ("odd.hdr", 63, 31), ("least.hdr", 2, 1)]:
        some = pixels(width, height)
        good(name, [[value(p) for p in row] for row in some], hdr(some, flat if width < 8 else new_runs))
    for name, pixel in [("black.hdr", (0, 0, 0, 0)), ("tiny.hdr", (87, 87, 87, 4)), ("denormal.hdr", (1, 1, 1, 1)),
                        ("bright.hdr", (255, 255, 255, 255))]:
        all_same = [[pixel] * WIDTH for _ in range(HEIGHT)]
        most = struct.unpack("<f", struct.pack("<f", 1e30))[0]
        good(name, [[[min(c, most) for c in value(p)] for p in row] for row in all_same], hdr(all_same))

    # OpenEXR.
    good("float.exr", rgb, exr(rgb))
    good("half.exr", rgb, exr(rgb, half=True, zipped=True))
    good("named-wrongly.hdr", rgb, exr(rgb, zipped=True))
    good("grey.exr", [[[p[0]] * 3 for p in row] for row in rgb], exr(rgb, "Y"))
    black = [0.0, 0.0, 0.0]
    inside = [[rgb[y - 2][x - 3] if 3 <= x < 19 and 2 <= y < 10 else black for x in range(24)] for y in range(12)]
    good("window.exr", inside, exr(rgb, data=(3, 2, 18, 9), show=(0, 0, 23, 11)))
    good("overscan.exr", [row[4:16] for row in rgb[2:8]], exr(rgb, data=(-4, -2, 11, 5), show=(0, 0, 11, 5)))
    odd = [[list(p) for p in row] for row in rgb]
    odd[0][0], odd[1][1], odd[2][2] = [float("inf")] * 3, [float("nan")] * 3, [-3.0, 1.0, float("-inf")]
    mended = [[list(p) for p in row] for row in odd]
    mended[0][0], mended[1][1], mended[2][2] = [65504.0] * 3, black, [0.0, 1.0, 0.0]
    good("odd-texels.exr", mended, exr(odd, half=True))
    refused = "an OpenEXR file that its library refuses"
    whole = exr(rgb)
    packed = exr(rgb, zipped=True)
    bad("magic.exr", refused, whole[:4])
    bad("header.exr", refused, whole[:100])
    bad("cut.exr", refused, whole[:len(whole) // 2])
    bad("cut-last.exr", refused, whole[:-1])
    bad("spoiled.exr", refused, packed[:-120] + bytes(120))
    bad("vast.exr", refused, exr(rgb, data=(0, 0, 2**30, 2**29)))
    bad("depth.exr", "without the channels R, G and B", exr(rgb, "Z"))
    bad("square.exr", "a map of 8 x 8 texels, but a lat-long map", exr([row[:8] for row in rgb]))


main(sys.argv[1])
