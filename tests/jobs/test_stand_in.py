"""The stand-in's list of tasks: the scenarios that are stored."""

import pytest

from augment.scene.intent import Shape
from augment.services.scenarios.prompts import find_stored_tasks
from augment.services.scenarios.scenes import LoadedScenario
from tests.intents import cones
from tests.jobs.rows import INSTRUCTION, add_scenario

pytestmark = pytest.mark.django_db(transaction=True)


def test_a_task_is_found_by_the_text_of_its_instruction_however_it_is_spaced() -> None:
    assert find_stored_tasks(INSTRUCTION) == []
    row = add_scenario("street")
    spaced = f"  {INSTRUCTION.replace(' ', '  ')}\n"
    assert find_stored_tasks(spaced) == [(LoadedScenario(row).scene, cones(20.0, 1, Shape.LINE))]
    assert find_stored_tasks("Paint the sky green.") == []
