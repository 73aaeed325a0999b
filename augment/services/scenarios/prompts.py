"""What a variant would send for a stored scenario. Nobody is asked."""

import hashlib
import json
from dataclasses import dataclass
from typing import Any

from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.db import connection

from augment.errors import Conflict, UnknownName
from augment.fake_llm.sight import same_text
from augment.models import Contestant, Scenario
from augment.prompts.fill import prompt_version
from augment.render.camera import LOOK
from augment.scene.codec import intent_from_document
from augment.scene.entities import Modification
from augment.scene.intent import Intent
from augment.services.scenarios.pictures import store
from augment.services.scenarios.scenes import reference_of, scene_key, scene_of
from augment.variants.options import ContestantOptions, recipe_with
from augment.variants.recipes import RECIPES, Tools, find_recipe
from augment.variants.respondents import ModelRole
from augment.variants.reviews import pictures
from augment.variants.showing import Shown, shown_prompt

FOLDER = "prompts"
"""Where pictures lie that a viewer would be shown."""


def prompt_of(
    *,
    scenario: str,
    variant: str,
    role: ModelRole,
    native_tools: bool = False,
    images: tuple[bytes, ...] | None = None,
    options: ContestantOptions | None = None,
) -> Shown:
    """Return the first messages to that role; reviewers judge the scenario's reference.

    Args:
        scenario: A slug.
        variant: The name of a recipe, in any case.
        role: Whose messages.
        native_tools: Whether the modifier calls natively.
        images: What the viewer is shown, where it is drawn already.
        options: Of whoever asks; without them the variant's own.

    Raises:
        UnknownName: No such scenario or variant.
        Conflict: Nobody plays that role in the variant, or it is to call natively and has no tool.
    """
    recipe = recipe_with(find_recipe(variant), options or ContestantOptions())
    if role not in recipe.roles:
        played = ", ".join(recipe.roles)
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
        images=images,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class PromptChoice:
    """A variant, and the roles whose first messages can be shown.

    Attributes:
        calls: Whether its modifier can call a tool natively.
    """

    slug: str
    title: str
    roles: tuple[str, ...]
    calls: bool


def list_choices() -> list[PromptChoice]:
    """Return every variant."""
    return [
        PromptChoice(
            slug=recipe.slug,
            title=recipe.title,
            roles=tuple(role.value for role in recipe.roles),
            calls=recipe.tools is not Tools.NONE,
        )
        for recipe in RECIPES.values()
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Preview:
    """The first messages of a role, for a page; None while a worker has still to draw.

    Attributes:
        images: Names of pictures in the media storage, in the order of the messages.
    """

    shown: Shown | None
    images: tuple[str, ...] = ()
    version: str = ""

    def to_document(self) -> dict[str, Any]:
        """Return messages and tools as the body of the request has them."""
        if self.shown is None:
            return {}
        tools = [json.loads(tool) for tool in self.shown.tools]
        messages = [one.to_document() for one in self.shown.messages]
        return {"messages": messages} | ({"tools": tools} if tools else {})


def preview_prompt(
    scenario: Scenario,
    *,
    variant: str,
    role: str,
    native_tools: bool = False,
    options: ContestantOptions | None = None,
) -> Preview:
    """Return what would be sent, without asking or drawing anything; see `prompt_of`.

    Raises:
        UnknownName: No such variant or role.
        Conflict: Nobody plays that role, or it is to call natively and has no tool.
    """
    if role not in list(ModelRole):
        raise UnknownName("role", role, [one.value for one in ModelRole])
    names: tuple[str, ...] = ()
    recipe = recipe_with(find_recipe(variant), options or ContestantOptions())
    if role == ModelRole.VIEWER and ModelRole.VIEWER in recipe.roles:
        names = _drawn(scenario, recipe.limits.picture_px)
        if not names:
            return Preview(shown=None)
    shown = prompt_of(
        scenario=scenario.slug,
        variant=variant,
        role=ModelRole(role),
        native_tools=native_tools,
        images=tuple(map(_bytes, names)) or None,
        options=options,
    )
    return Preview(shown=shown, images=names, version=prompt_version())


def draw_prompts(scenario_pk: int) -> None:
    """Draw the pictures that viewers are shown of a scenario's reference; a worker's task.

    One of each width that a variant or a contestant asks for.

    Raises:
        InvalidDocument: The stored scene or reference can't be read.
    """
    row = Scenario.objects.select_related("base_scene").get(pk=scenario_pk)
    seeing = [one for one in RECIPES.values() if ModelRole.VIEWER in one.roles]
    widths = {recipe.limits.picture_px for recipe in seeing}
    asked = Contestant.objects.exclude(endpoint=None).values_list("options", "frozen_options")
    for documents in asked:
        widths |= {one["picture_px"] for one in documents if one and one.get("picture_px")}
    for width_px in sorted(widths):
        if not _drawn(row, width_px):
            made = pictures(scene_of(row), reference_of(row) or Modification(), width_px=width_px)
            names = [store(png, folder=FOLDER) for png in made]
            listed = ContentFile(json.dumps(names).encode())
            default_storage.save(_list_name(row, width_px), listed)


def _list_name(scenario: Scenario, width_px: int) -> str:
    """The file that names the pictures; its own name says what is on them."""
    shown = [LOOK, prompt_version(), scene_key(scenario), scenario.reference, width_px]
    digest = hashlib.sha256(json.dumps(shown, sort_keys=True).encode()).hexdigest()
    return f"{FOLDER}/{digest}.json"


def _drawn(scenario: Scenario, width_px: int) -> tuple[str, ...]:
    """The names of a viewer's pictures, none where they are not drawn yet."""
    name = _list_name(scenario, width_px)
    return tuple(json.loads(_bytes(name))) if default_storage.exists(name) else ()


def _bytes(name: str) -> bytes:
    with default_storage.open(name) as file:
        found: bytes = file.read()
    return found


class StoredIntents:
    """The intents of all scenarios, by the texts of their instructions, for the stand-in model.

    Asked from the threads of a server: each leaves no connection behind. What was found once is
    remembered; what was not is looked for again, because scenarios and intents come later.
    """

    def __init__(self) -> None:
        self._found: dict[str, Intent] = {}

    def __call__(self, instruction: str) -> Intent | None:
        """Return the intent of the first scenario with that instruction, None for none."""
        text = same_text(instruction)
        if text not in self._found:
            try:
                rows = Scenario.objects.exclude(intent=None).order_by("-pk")
                for words, document in rows.values_list("instruction", "intent"):
                    self._found[same_text(words)] = intent_from_document(document)
            finally:
                connection.close()
        return self._found.get(text)
