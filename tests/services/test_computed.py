"""Files of what is computed once: used again, in no backup, and deleted when they are old."""

import io
import os
from datetime import timedelta

import pytest
from django.core.files.storage import default_storage
from django.core.management import call_command
from django.utils import timezone

from arena.management.backups import find_media
from augment.errors import MediaFault
from augment.services.judging import COMPUTED, compute_once, delete_computed


def test_what_was_computed_is_kept_until_it_is_old() -> None:
    asked: list[str] = []

    def ask(*parts: str) -> None:
        for part in parts:

            def compute(part: str = part) -> bytes:
                asked.append(part)
                return part.encode()

            assert compute_once("txt", compute, part) == part.encode()

    delete_computed(before=timezone.now())  # where nothing was computed yet
    ask("a", "a", "b")
    assert asked == ["a", "b"]
    assert not [name for name in find_media() if name.startswith(COMPUTED)]
    for name in default_storage.listdir(COMPUTED)[1]:
        os.utime(default_storage.path(f"{COMPUTED}/{name}"), (0, 0))
    ask("c")
    delete_computed(before=timezone.now() - timedelta(days=1))
    ask("a", "c")
    assert asked == ["a", "b", "c", "a"]


@pytest.mark.django_db
def test_what_is_served_can_be_prepared_while_no_old_chart_can_be_deleted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(**_: object) -> None:
        raise MediaFault("list", "s3://pictures", "gone")

    prepare, err = "arena.management.commands.prepare", io.StringIO()
    monkeypatch.setattr(f"{prepare}.delete_computed", refuse)
    called: list[str] = []
    monkeypatch.setattr(f"{prepare}.call_command", lambda name, **_: called.append(name))
    monkeypatch.setattr(f"{prepare}.compile_catalogue", lambda: None)
    call_command("prepare", stderr=err)
    assert called == ["migrate", "clearsessions", "collectstatic"]
    assert "Old charts stay: The storage of pictures failed" in err.getvalue()
