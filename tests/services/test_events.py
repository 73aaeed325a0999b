from __future__ import annotations

import pytest

from augment.models import Event
from augment.services.events import log_event


@pytest.mark.django_db
def test_a_line_says_what_the_machine_did() -> None:
    log_event(actor=None, verb="close", object_kind="study", object_code=7, after={"n": 1})
    line = Event.objects.get()
    assert (line.actor, line.verb, line.object_code, line.before) == (None, "close", "7", None)
    with pytest.raises(TypeError):
        line.delete()
