"""What has to hold of the words and numbers on every page."""

from __future__ import annotations

import re
from collections.abc import Callable
from html import unescape

import pytest

from tests.web.every_page import ShownPage, pages_of_a_rated_study, pages_of_an_open_study

# What programs wrote, or will read, stands as it is.
AS_IT_IS = re.compile(r"<(script|style|pre|code|textarea|template)\b.*?</\1>|<!--.*?-->", re.S)
FAULTS = {
    "a hyphen for a minus sign": re.compile(r"(?<![\w.,:/#+-])-\d"),
    "a plural of one": re.compile(
        r"(?<![\w.,:/-])1 (?!(?:is|was|has|as|this|does)\b)[a-z]+s\b(?<! s)"
    ),
    "one with a decimal": re.compile(r"(?<![\d.,])1\.0 [a-z]{2,}s\b"),
    "no number": re.compile(r"\b(?:nan|NaN|inf|Infinity)\b|^(?:None|True|False|-?inf)$"),
}


def texts_of(html: str) -> list[str]:
    """The runs of text that a person reads, without what is for programs."""
    body = AS_IT_IS.sub("", html[html.index("<body") :])
    spaced = re.sub(r"</?(?:b|i|a|em|strong|abbr)\b[^>]*>", "", body)
    runs = (" ".join(unescape(run).split()) for run in re.split(r"<[^>]*>", spaced))
    return [run for run in runs if run]


def faults_in(html: str) -> list[str]:
    return [
        f"{fault}: {run[max(found.start() - 40, 0) : found.end() + 20]}"
        for run in texts_of(html)
        for fault, pattern in FAULTS.items()
        if (found := pattern.search(run))
    ]


@pytest.mark.parametrize(
    ("text", "is_wrong"),
    [
        ("<td>-3</td>", True),
        ("<td>−3 of place-3, 2026-11-22</td>", False),
        ("<td>(-108 to +31)</td>", True),
        ("<p>1 <b>votes</b></p>", True),
        ("<p>21 votes, 1 vote is 1 s</p>", False),
        ("<p>1.0 votes weigh as much</p>", True),
        ("<td>None</td>", True),
        ("<p>None was left out.</p>", False),
        ("<td>nan</td>", True),
        ("<code>-1 nan</code>", False),
    ],
)
def test_the_search_finds_what_it_looks_for(text: str, is_wrong: bool) -> None:
    assert bool(faults_in(f"<body>{text}")) is is_wrong


@pytest.mark.django_db
@pytest.mark.parametrize("pages", [pages_of_an_open_study, pages_of_a_rated_study])
def test_every_page_has_minus_signs_plurals_and_numbers(
    pages: Callable[[], list[ShownPage]],
) -> None:
    shown = pages()
    assert len(shown) > 12
    wrong = {one.url: faults for one in shown if (faults := faults_in(one.html))}
    assert not wrong, wrong
