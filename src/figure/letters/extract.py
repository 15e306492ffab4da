"""Writes open_sans.txt: outlines of the letters that figures use, from OpenSans-Regular.ttf (version 1.11, Apache License 2.0).

Needs fontTools: `python3 extract.py OpenSans-Regular.ttf > open_sans.txt`
"""

import sys

from fontTools.pens.basePen import BasePen
from fontTools.ttLib import TTFont

CHARACTERS = [*range(0x20, 0x7F), *range(0xA0, 0x180), *map(ord, "ȘșȚțΔΩαβγδεηθλμπρστφχψω–—‘’“”•…‰∆∑−√∞≈≠≤≥")]

HEAD = """\
# Outlines of letters of Open Sans Regular 1.11, digitised data copyright (c) 2010-2011 Google Corporation, under the Apache
# License 2.0 (https://www.apache.org/licenses/LICENSE-2.0). Made by extract.py.
# Each line: code point, advance width, path (M, L, Q, Z of SVG, absolute); 2048 units are the size of the type, y points down.
"""


class PathPen(BasePen):
    def __init__(self, glyphs):
        super().__init__(glyphs)
        self.parts = []

    def add(self, command, *points):
        numbers = " ".join(f"{round(x)} {round(-y)}" for x, y in points)
        self.parts.append(command + numbers)

    def _moveTo(self, point):
        self.add("M", point)

    def _lineTo(self, point):
        self.add("L", point)

    def _qCurveToOne(self, control, point):
        self.add("Q", control, point)

    def _curveToOne(self, *points):
        raise ValueError("TrueType outlines are quadratic")

    def _closePath(self):
        self.parts.append("Z")


font = TTFont(sys.argv[1])
assert font["head"].unitsPerEm == 2048
glyphs, names = font.getGlyphSet(), font.getBestCmap()
print(HEAD, end="")
for character in CHARACTERS:
    if character in names:
        glyph = glyphs[names[character]]
        pen = PathPen(glyphs)
        glyph.draw(pen)
        print(f"{character:04X} {round(glyph.width)} {''.join(pen.parts)}".rstrip())
    else:
        print(f"missing: {chr(character)}", file=sys.stderr)
