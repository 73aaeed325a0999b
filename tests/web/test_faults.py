"""Pages of faults look like the product, and nothing on any page is inline."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from django.conf import settings
from django.test import RequestFactory

from arena.web.faults import answer_broken
from tests.web.cast import people, signed_in

TEMPLATES = Path(settings.BASE_DIR) / "templates"


@pytest.mark.django_db
def test_a_missing_page_is_said_in_the_products_own_words() -> None:
    answer = signed_in(people()["expert"]).get("/nowhere/")
    assert answer.status_code == 404
    assert "There is nothing here" in answer.content.decode()


@pytest.mark.django_db
def test_a_refused_page_is_said_in_the_products_own_words() -> None:
    answer = signed_in(people()["expert"]).get("/jobs/")
    assert "not for your account" in answer.content.decode()


def test_the_page_for_our_own_fault_asks_no_database() -> None:
    answer = answer_broken(RequestFactory().get("/"))
    assert answer.status_code == 500
    assert "Something broke on our side" in answer.content.decode()


@pytest.mark.django_db
def test_a_page_allows_nothing_but_its_own_files() -> None:
    policy = signed_in(people()["expert"]).get("/").headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy


NO_PAGE = TEMPLATES / "exports" / "study_readme.md"
"""A file of an export, in Markdown: no browser shows it, and nothing in it is escaped."""
SHOWN = sorted(set(TEMPLATES.rglob("*.*")) - {NO_PAGE})


@pytest.mark.parametrize("path", SHOWN, ids=lambda path: path.name)
def test_no_template_has_anything_inline_or_unescaped(path: Path) -> None:
    text = path.read_text()
    assert not re.search(r"\sstyle=|<style|\son\w+=|<script(?![^>]*\ssrc=)", text)
    assert not re.search(r"\|\s*safe\b|autoescape off|mark_safe", text)
