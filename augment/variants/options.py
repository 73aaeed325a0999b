"""How a contestant asks, beyond its model and its variant: a frozen value.

In: what an admin chose. Out: a run's complete options (`complete_options`), the recipe with them
(`recipe_with`), what is sent with every request (`ContestantOptions.sampling`) and what keeps
stored answers apart (`ContestantOptions.key`). None means: left open, so that the default counts,
or what is known of the model.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from enum import StrEnum
from typing import Any

from augment.errors import InvalidDocument
from augment.variants.recipes import Recipe, Tools
from augment.variants.respondents import Sampling
from augment.variants.review import Limits

EFFORTS = ("none", "minimal", "low", "medium", "high", "xhigh", "max")
"""What endpoints call how long a model thinks; not every one takes each."""

HIGHEST_SEED = 2**31 - 1
MOST_SAMPLES = 100
MOST_ROUNDS = 10


class ToolProtocol(StrEnum):
    """How a modifier calls its function: by a line of its answer, or on the wire's own way."""

    PROMPT = "prompt"
    NATIVE = "native"


@dataclass(frozen=True, slots=True, kw_only=True)
class ContestantOptions:
    """The options of a contestant.

    Attributes:
        temperature, seed, reasoning_effort: Sent in every role to models that take them; None is
            not sent (for the effort: what the model's row says).
        max_output_tokens: The length limit of one answer.
        protocol: How the function is called; None for native where the model is known to do so.
        rounds: At most so many, the first one included.
        accepted_from: The mean rating from which a text review is content.
        radius_m: How far around the ego the scene is written down.
        prompt_version: Of the texts that the prompts are made from.
        picture_px: The width of the picture that a viewer is shown.

    Raises:
        InvalidDocument: A value is out of its range.
    """

    temperature: float | None = None
    seed: int | None = None
    reasoning_effort: str | None = None
    max_output_tokens: int | None = None
    protocol: ToolProtocol | None = None
    rounds: int | None = None
    accepted_from: float | None = None
    radius_m: float | None = None
    prompt_version: str | None = None
    picture_px: int | None = None

    def __post_init__(self) -> None:
        problems = [
            (name, f"{getattr(self, name)!r} must be {rule.says}")
            for name, rule in _RULES.items()
            if getattr(self, name) is not None and not rule.allows(getattr(self, name))
        ]
        if problems:
            raise InvalidDocument("set of options", problems)

    def to_document(self) -> dict[str, Any]:
        """What was chosen or fixed, ready for JSON; what is open is not in it."""
        chosen = {name: value for name, value in asdict(self).items() if value is not None}
        return chosen | ({"protocol": self.protocol.value} if self.protocol else {})

    def sampling(self, sample: int = 1) -> Sampling:
        """What the requests of one sample are sent with: sample k has the seed + k - 1."""
        return Sampling(
            temperature=self.temperature,
            seed=None if self.seed is None else self.seed + sample - 1,
            reasoning_effort=self.reasoning_effort,
        )

    def key(self, sample: int = 1) -> dict[str, Any]:
        """What keeps the answers of these options and this sample apart from all others.

        A default is no option of its own: so variants that ask the very same share the answer.
        """
        chosen = {
            name: value
            for name, value in self.to_document().items()
            if name != "prompt_version" and value != _RULES[name].default
        }
        return chosen | ({"sample": sample} if sample > 1 else {})

    def describe(self) -> str:
        """What was chosen in a few words, for names; empty where nothing was."""
        return ", ".join(
            _RULES[name].words.format(value) for name, value in self.to_document().items()
        )

    def slug(self) -> str:
        """The same as a part of a slug."""
        parts = [_RULES[name].slug.format(value) for name, value in self.to_document().items()]
        return "-".join(parts).lower().replace(".", "p")


def options_from_document(document: Mapping[str, object]) -> ContestantOptions:
    """The options that a JSON document holds.

    Raises:
        InvalidDocument: A name is none of an option, or a value can't be.
    """
    problems = [
        (str(name), f"is no option; there are {', '.join(NAMES)}")
        for name in document
        if name not in NAMES
    ]
    if problems:
        raise InvalidDocument("set of options", problems)
    values: dict[str, Any] = {}
    for name, value in document.items():
        rule = _RULES[name]
        if value is None:
            continue
        if not rule.allows(value):
            problems.append((name, f"{value!r} must be {rule.says}"))
        else:
            values[name] = rule.read(value)
    if problems:
        raise InvalidDocument("set of options", problems)
    return ContestantOptions(**values)


def names_for(recipe: Recipe) -> tuple[str, ...]:
    """The options that a recipe has a use for."""
    useful = {"rounds", *recipe.review.options} if recipe.review else set[str]()
    if recipe.tools is not Tools.NONE:
        useful.add("protocol")
    return tuple(name for name in NAMES if name in useful or not _RULES[name].without)


def check_options(recipe: Recipe, options: ContestantOptions) -> None:
    """Refuse options that would change nothing of a recipe.

    Raises:
        InvalidDocument: One is chosen.
    """
    allowed = names_for(recipe)
    problems = [
        (f"options.{name}", f"{recipe.slug} {_RULES[name].without}")
        for name in options.to_document()
        if name not in allowed
    ]
    if problems:
        raise InvalidDocument("contestant", problems)


def complete_options(
    options: ContestantOptions, recipe: Recipe, *, native_tools: bool | None, prompt_version: str
) -> ContestantOptions:
    """The options with which a recipe runs, nothing of ours left open.

    Args:
        options: What was chosen.
        recipe: The variant.
        native_tools: What is known of the modifier's model.
        prompt_version: Of the texts that there are.
    """
    native = ToolProtocol.NATIVE if native_tools is True else ToolProtocol.PROMPT
    limits = recipe.limits
    usual: dict[str, Any] = {
        "max_output_tokens": limits.max_tokens,
        "protocol": native,
        "rounds": limits.regenerations + 1,
        "accepted_from": limits.accepted_from,
        "radius_m": limits.radius_m,
        "prompt_version": prompt_version,
        "picture_px": limits.picture_px,
    }
    allowed = names_for(recipe)
    return options_from_document(
        {name: value for name, value in usual.items() if name in allowed} | options.to_document()
    )


def recipe_with(recipe: Recipe, options: ContestantOptions) -> Recipe:
    """The recipe within the limits of these options."""
    changes: dict[str, Any] = {
        "radius_m": options.radius_m,
        "max_tokens": options.max_output_tokens,
        "regenerations": None if options.rounds is None else options.rounds - 1,
        "accepted_from": options.accepted_from,
        "picture_px": options.picture_px,
    }
    given = {name: value for name, value in changes.items() if value is not None}
    return replace(recipe, limits=replace(recipe.limits, **given))


# --- Private -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rule:
    """What is to know of an option.

    Attributes:
        says: What a value may be, in words.
        allows: Whether a value may be.
        read: How it is read once it may be.
        words: A value in a name for people.
        slug: A value as a part of a slug.
        default: What counts where it is left open; None where nothing does.
        without: Why a recipe has no use for it; empty where all have one.
    """

    says: str
    allows: Callable[[Any], bool]
    words: str
    slug: str
    read: Callable[[Any], Any] = lambda value: value
    default: object = None
    without: str = ""


def _number(low: float, high: float, **more: Any) -> _Rule:
    def allows(value: object) -> bool:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return is_number and math.isfinite(value) and low <= value <= high  # type: ignore[arg-type,operator]

    return _Rule(says=f"a number from {low:g} to {high:g}", allows=allows, read=float, **more)


def _whole(low: int, high: int, **more: Any) -> _Rule:
    def allows(value: object) -> bool:
        return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high

    return _Rule(says=f"a whole number from {low} to {high}", allows=allows, **more)


def _one_of(*words: str, read: Callable[[Any], Any] = str, **more: Any) -> _Rule:
    return _Rule(
        says=f"one of {', '.join(words)}", allows=lambda value: value in words, read=read, **more
    )


_LIMITS = Limits()
_RULES: dict[str, _Rule] = {
    "temperature": _number(0, 2, words="temperature {:g}", slug="t{:g}"),
    "seed": _whole(0, HIGHEST_SEED - MOST_SAMPLES, words="seed {}", slug="s{}"),
    "reasoning_effort": _one_of(*EFFORTS, words="effort {}", slug="{}-effort"),
    "max_output_tokens": _whole(
        1, 1_000_000, words="answers to {} tokens", slug="{}-tokens", default=_LIMITS.max_tokens
    ),
    "protocol": _one_of(
        *(protocol.value for protocol in ToolProtocol),
        read=ToolProtocol,
        words="{} calls",
        slug="{}",
        default=ToolProtocol.PROMPT.value,
        without="calls no function, so it has no protocol",
    ),
    "rounds": _whole(
        1,
        MOST_ROUNDS,
        words="{} rounds",
        slug="{}-rounds",
        default=_LIMITS.regenerations + 1,
        without="has no review, so it has one round",
    ),
    "accepted_from": _number(
        1,
        5,
        words="content from {:g}",
        slug="from-{:g}",
        default=_LIMITS.accepted_from,
        without="has no text review, so nothing is rated",
    ),
    "radius_m": _number(20, 300, words="{:g} m", slug="{:g}m", default=_LIMITS.radius_m),
    "prompt_version": _Rule(
        says="twelve hexadecimal digits",
        allows=lambda value: (
            isinstance(value, str) and re.fullmatch("[0-9a-f]{12}", value) is not None
        ),
        words="prompts {}",
        slug="p{}",
    ),
    "picture_px": _whole(
        300,
        2400,
        words="pictures {} px",
        slug="{}px",
        default=_LIMITS.picture_px,
        without="shows no picture",
    ),
}

NAMES = tuple(field.name for field in fields(ContestantOptions))
