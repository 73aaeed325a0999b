"""Whoever only looks changes nothing: a GET writes no row."""

import re

import pytest
from django.db import connection
from django.test.utils import CaptureQueriesContext

from tests.web.addresses import address
from tests.web.cast import people, signed_in, world
from tests.web.test_access import PAGES

pytestmark = pytest.mark.django_db

WRITES = re.compile(r'^(?:INSERT(?: OR \w+)? INTO|UPDATE|DELETE FROM) "(\w+)"')
ALLOWED = {"django_session"}
"""What a look may write: that its session goes on."""


def test_no_page_of_staff_writes_a_row_when_it_is_read() -> None:
    """An admin opens whatever a researcher opens."""
    here, client, wrote = world(), signed_in(people()["admin"]), {}
    for name in (name for name, answers in PAGES.items() if answers[0] == 200):
        url = address(name, here)
        with CaptureQueriesContext(connection) as seen:
            answer = client.get(url)
            if answer.streaming:
                b"".join(answer)
        written = {found[1] for one in seen if (found := WRITES.match(one["sql"]))}
        if written - ALLOWED:
            wrote[name] = written - ALLOWED
    assert wrote == {}
