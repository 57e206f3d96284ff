"""Every picture of the pages can be read: on a page 720 pixels wide, on a light one and on a dark one."""

import re
from pathlib import Path

import matplotlib
import pytest
import svg_texts
from matplotlib.figure import Figure
from sample import sample

from contactfpga import picture_style

DOCS = Path(__file__).resolve().parents[2] / "docs"
PICTURES = sorted(DOCS.rglob("*.svg"))
LEAST_PX = 11
"""That a letter's size is on the page."""

every_picture = pytest.mark.parametrize("path", PICTURES, ids=lambda path: path.stem)


@pytest.mark.slow
@every_picture
def test_words_are_whole_and_large_enough(path):
    picture = svg_texts.read(path)
    page = picture_style.WIDTH_PX / picture.width
    assert picture.words
    for one in picture.words:
        assert one.pixels * page >= LEAST_PX - 0.01, one.text
        assert one.corners.min() >= 0, one.text
        assert (one.corners.max(axis=0) <= (picture.width, picture.height)).all(), one.text


@pytest.mark.parametrize("path", sample(PICTURES, quick=PICTURES[::8], slow=PICTURES), ids=lambda path: path.stem)
def test_no_words_lie_on_others(path):
    assert not svg_texts.overlapping(svg_texts.read(path))


@every_picture
def test_what_is_drawn_lies_on_a_card_that_is_dark_on_dark_pages(path):
    text = path.read_text(encoding="utf-8")
    light, dark = re.split(r"@media \(prefers-color-scheme: dark\)", text)
    if 'class="ground"' in text:  # a drawing with classes
        assert re.search(r"\.ground { fill: #ffffff; }", light)
        assert re.search(r"\.ground { fill: #14181d; }", dark)
        return
    assert re.search(r'<(?:rect|path)[^>]*?fill(?:="|: )(#\w+)', text)[1] == picture_style.CARD
    rules, _, _ = dark.partition("</style>")
    assert re.search(rf'fill(?:="|: ){picture_style.CARD}"\][^{{]*{{fill:#14181d', rules)


def brightness(color):
    """As the contrast of WCAG 2 has it."""
    parts = [int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [one / 12.92 if one <= 0.03928 else ((one + 0.055) / 1.055) ** 2.4 for one in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    dark, light = sorted(map(brightness, (one, other)))
    return (light + 0.05) / (dark + 0.05)


def test_words_and_lines_are_seen_on_a_dark_page():
    dark = picture_style.DARK
    for word in (picture_style.INK, picture_style.SOFT):
        for ground in (picture_style.CARD, picture_style.SHEET):
            assert contrast(dark[word], dark[ground]) >= 4.5, (word, ground)
    for line in picture_style.PALETTE:
        assert contrast(dark.get(line, line), dark[picture_style.CARD]) >= 3, line


def test_a_picture_is_in_other_colors_on_a_dark_page_and_the_same_on_a_light_one():
    light = f'<svg viewBox="0 0 1 1"><rect fill="{picture_style.CARD}"/><text style="fill: {picture_style.INK}"/></svg>'
    both = picture_style.for_dark_pages(light)
    style = re.search(r"\n<style>.*</style>", both, re.DOTALL)[0]
    assert both.replace(style, "") == light
    assert style.count("!important") == 2
    assert picture_style.DARK[picture_style.INK] in style
    assert picture_style.for_dark_pages('<svg><rect fill="#efe9d8"/></svg>') == '<svg><rect fill="#efe9d8"/></svg>'


def test_ids_do_not_depend_on_the_last_digit_of_a_coordinate(tmp_path):
    def drawn(left):
        with matplotlib.rc_context(picture_style.SETTINGS):
            figure = Figure((4, 2))
            figure.add_axes((left, 0.2, 0.5, 0.5)).plot([0, 1])
            return picture_style.save(figure, tmp_path / "one.svg").read_text(encoding="utf-8")

    assert drawn(0.2) == drawn(0.2 + 1e-15)
    assert drawn(0.2) != drawn(0.3)
    assert {"i0", "i1", "i2"} == set(re.findall(r'id="(i\d+)"', drawn(0.2)))


def test_words_that_lie_on_others_are_seen(tmp_path):
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 100" font-size="10">'
    (tmp_path / "one.svg").write_text(
        f'{head}<text x="10" y="20">first</text><text x="25" y="22">second</text>'
        '<g transform="translate(100 0)"><text x="10" y="20">third</text></g>'
        '<text x="10" y="60" transform="rotate(-90 10 60)">along</text></svg>'
    )
    first, second, third, along = svg_texts.read(tmp_path / "one.svg").words
    assert svg_texts.overlap(first, second)
    assert svg_texts.overlapping(svg_texts.read(tmp_path / "one.svg")) == [("first", "second")]
    assert not svg_texts.overlap(first, third)
    assert not svg_texts.overlap(first, along)
    assert third.corners.min(axis=0)[0] == pytest.approx(110, abs=1)
    assert along.corners.max(axis=0)[1] == pytest.approx(60, abs=1)
