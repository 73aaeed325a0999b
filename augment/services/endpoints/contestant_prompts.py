"""What a contestant would send for a stored scenario, by its own options. Nobody is asked."""

from __future__ import annotations

from augment.errors import Conflict
from augment.models import Contestant, Scenario
from augment.services.endpoints.treatments import options_of, other_prompts, respondents_of
from augment.services.scenarios.prompts import Preview, preview_prompt
from augment.variants.options import ToolProtocol
from augment.variants.recipes import Tools, find_recipe
from augment.variants.transcript import ModelRole


def asking_contestants() -> list[Contestant]:
    """Those that ask a model, by name; who is retired comes last."""
    rows = Contestant.objects.exclude(endpoint=None).select_related("endpoint")
    return sorted(rows, key=lambda row: (row.retired_at is not None, row.name, row.pk))


def preview_contestant(scenario: Scenario, contestant: Contestant, *, role: str) -> Preview:
    """The first messages to a role, as the contestant's options have them.

    Options are those of its first run; of one that has not run yet, those that it would run with
    now.

    Raises:
        Conflict: It asks no model, nobody plays that role, an endpoint of it is gone, or it asks
            with prompts that are not installed any more.
        UnknownName: Its variant is none of ours any more, or there is no such role.
    """
    if not respondents_of(contestant):
        raise Conflict(f"{contestant.slug} asks no model.")
    options = options_of(contestant)
    if (unlike := other_prompts(contestant.slug, options)) is not None:
        raise Conflict(unlike)
    calls = find_recipe(contestant.variant).tools is not Tools.NONE
    is_native = options.protocol is ToolProtocol.NATIVE
    return preview_prompt(
        scenario,
        variant=contestant.variant,
        role=role,
        native_tools=calls and is_native and role == ModelRole.MODIFIER,
        options=options,
    )
