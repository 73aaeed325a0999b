"""Prompts of a variant for a stored scenario. No model is asked."""

from django.db import connection

from augment.errors import Conflict, check_names
from augment.fake_llm.sight import same_text
from augment.models import Scenario
from augment.prompts.calls import Tools
from augment.prompts.fill import prompt_version as prompt_version
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Intent
from augment.services.scenarios.scenes import LoadedScenario
from augment.variants.options import ContestantOptions, recipe_with
from augment.variants.recipes import RECIPES, Recipe, find_recipe
from augment.variants.respondents import ModelRole
from augment.variants.showing import ShownPrompt as ShownPrompt
from augment.variants.showing import build_prompt


def list_recipes() -> list[Recipe]:
    """Return the recipe of every variant."""
    return list(RECIPES.values())


def preview_prompt(
    scenario: Scenario, *, variant: str, role: str, native_tools: bool = False
) -> ShownPrompt:
    """Return the first messages to a role; reviewers judge the scenario's reference.

    Args:
        scenario: With its scene.
        variant: The name of a recipe, in any case.
        role: Whose messages.
        native_tools: Whether the modifier calls natively.

    Raises:
        UnknownName: No such variant or role.
        Conflict: Nobody plays that role in the variant, or it is to call natively and has no tool.
    """
    check_names("role", [role], [role_choice.value for role_choice in ModelRole])
    recipe = recipe_with(find_recipe(variant), ContestantOptions())
    if role not in recipe.roles:
        played = ", ".join(recipe.roles)
        raise Conflict(f"Nobody plays the {role} in {recipe.slug}; its roles: {played}.")
    if native_tools and (role != ModelRole.MODIFIER or recipe.tools is Tools.NONE):
        raise Conflict(f"The {role} of {recipe.slug} calls no function, natively or otherwise.")
    loaded = LoadedScenario(scenario)
    return build_prompt(
        recipe,
        ModelRole(role),
        loaded.scene,
        scenario.instruction,
        loaded.reference or Modification(),
        native_tools=native_tools,
    )


def find_stored_tasks(instruction: str) -> list[tuple[Scene, Intent]]:
    """Return scene and intent of the scenarios with that instruction, for the stand-in model.

    Asked from the threads of a server: each leaves no connection behind.
    """
    try:
        rows = Scenario.objects.exclude(intent=None).order_by("-pk")
        texts = rows.values_list("pk", "instruction")
        pks = [pk for pk, text in texts if same_text(text) == same_text(instruction)]
        alike = map(LoadedScenario, rows.filter(pk__in=pks).select_related("base_scene"))
        return [(loaded.scene, loaded.intent) for loaded in alike if loaded.intent]
    finally:
        connection.close()
