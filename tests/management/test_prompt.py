import io
import re

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.prompts.fill import modifier_messages
from tests.jobs.rows import add_scenario
from tests.scenes import scene

pytestmark = pytest.mark.django_db


def printed(*args: str) -> str:
    out = io.StringIO()
    call_command("prompt", *args, stdout=out)
    return out.getvalue()


def test_the_messages_are_printed_as_they_would_be_sent() -> None:
    row = add_scenario("street-1")
    text = printed("street-1", "OTM")
    for message in modifier_messages(scene(), row.instruction):
        assert message.text in text
    found = re.search(r"About (\d+) tokens of text", text)
    assert found is not None
    assert 1500 < int(found.group(1)) < 6000


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("street-1", "otm", "--role", "viewer"), "Nobody plays the viewer in otm"),
        (("street-1", "zero-shot"), "Unknown variant 'zero-shot'"),
        (("street-1", "otm", "--native-tools"), "The modifier of otm calls no function"),
        (("nowhere", "otm"), "Unknown scenario 'nowhere'. Known: street-1."),
    ],
)
def test_what_does_not_exist_is_said(args: tuple[str, ...], said: str) -> None:
    add_scenario("street-1")
    with pytest.raises(CommandError, match=re.escape(said)):
        printed(*args)
