"""The stand-in's list of intents: the scenarios that are stored."""

import pytest

from augment.scene.intent import Shape
from augment.services.scenarios.prompts import StoredIntents
from tests.intents import cones
from tests.jobs.rows import INSTRUCTION, add_scenario

pytestmark = pytest.mark.django_db(transaction=True)


def test_an_intent_is_found_by_the_text_of_its_instruction_however_it_is_spaced() -> None:
    look_up = StoredIntents()
    assert look_up(INSTRUCTION) is None
    add_scenario("street")
    assert look_up(f"  {INSTRUCTION.replace(' ', '  ')}\n") == cones(20.0, 1, Shape.LINE)
    assert look_up("Paint the sky green.") is None
