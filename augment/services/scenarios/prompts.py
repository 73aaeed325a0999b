"""What a variant would send for a stored scenario. Nobody is asked."""

from __future__ import annotations

from augment.errors import Conflict, UnknownName
from augment.models import Scenario
from augment.scene.modification import Modification
from augment.services.scenarios.scenes import reference_of, scene_of
from augment.variants.recipes import Tools, find_recipe
from augment.variants.showing import Shown, roles_of, shown_prompt
from augment.variants.transcript import ModelRole


def prompt_of(
    *, scenario: str, variant: str, role: ModelRole, native_tools: bool = False
) -> Shown:
    """The first messages to that role; reviewers judge the scenario's reference.

    Args:
        scenario: A slug.
        variant: The name of a recipe, in any case.
        role: Whose messages.
        native_tools: Whether the modifier calls natively.

    Raises:
        UnknownName: No such scenario or variant.
        Conflict: Nobody plays that role in the variant, or it is to call natively and has no tool.
    """
    recipe = find_recipe(variant)
    if role not in roles_of(recipe):
        played = ", ".join(roles_of(recipe))
        raise Conflict(f"Nobody plays the {role} in {recipe.slug}; its roles: {played}.")
    if native_tools and (role is not ModelRole.MODIFIER or recipe.tools is Tools.NONE):
        raise Conflict(f"The {role} of {recipe.slug} calls no function, natively or otherwise.")
    row = Scenario.objects.select_related("base_scene").filter(slug=scenario).first()
    if row is None:
        known = Scenario.objects.values_list("slug", flat=True)
        raise UnknownName("scenario", scenario, list(known))
    return shown_prompt(
        recipe,
        role,
        scene_of(row),
        row.instruction,
        reference_of(row) or Modification(),
        native_tools=native_tools,
    )
