"""Options of a contestant's requests beyond its model and its variant: a frozen value.

None means: left open, so that the default counts, or what is known of the model.
"""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from typing import Any

from augment.errors import InvalidDocument
from augment.prompts.calls import Tools
from augment.variants.recipes import Recipe
from augment.variants.reviews import BlockForm, Limits

EFFORTS = ("none", "minimal", "low", "medium", "high", "xhigh", "max")
"""What endpoints call how long a model thinks; not every one takes each."""

HIGHEST_SEED = 2**31 - 1
MOST_SAMPLES = 100
MOST_ROUNDS = 10


class ToolProtocol(StrEnum):
    """Protocol of function calls: by a line of the answer, or on the wire's own way."""

    PROMPT = "prompt"
    NATIVE = "native"


@dataclass(frozen=True, slots=True)
class Rule:
    """Rule of an option besides its name.

    Attributes:
        label: What people call it, with its unit.
        words: A value in a name for people.
        slug: A value as a part of a slug.
        kind: What a value is.
        least, most: The range of a number; how long a text is.
        choices: The values of a text, where these are few.
        without: Why a recipe may have no use for it; empty where all have one.
    """

    label: str
    words: str
    slug: str
    kind: type = int
    least: float = 0
    most: float = 0
    choices: tuple[str, ...] = ()
    without: str = ""

    def read(self, value: Any) -> Any:
        """Return the value as what it is.

        Raises:
            ValueError: It can't be; the text says what may be.
        """
        if self.choices:
            fits, allowed = value in self.choices, f"one of {', '.join(self.choices)}"
        elif self.kind is str:
            fits = isinstance(value, str) and re.fullmatch("[0-9a-f]{12}", value) is not None
            allowed = "twelve hexadecimal digits"
        else:
            kinds = (int, float) if self.kind is float else (int,)
            is_kind = isinstance(value, kinds) and not isinstance(value, bool)
            fits = is_kind and self.least <= value <= self.most
            allowed = f"a{' whole' * (self.kind is int)} number from {self.least} to {self.most}"
        if not fits:
            raise ValueError(f"{value!r} must be {allowed}")
        return self.kind(value)


RULES = {
    "temperature": Rule("Temperature", "temperature {:g}", "t{:g}", float, 0, 2),
    "seed": Rule("Seed", "seed {}", "s{}", most=HIGHEST_SEED - MOST_SAMPLES),
    "reasoning_effort": Rule("Reasoning effort", "effort {}", "{}-effort", str, choices=EFFORTS),
    "max_output_tokens": Rule(
        "Longest answer, tokens", "answers to {} tokens", "{}-tokens", int, 1, 1_000_000
    ),
    "protocol": Rule(
        "Function calls: native, or written in the prompt's form",
        "{} calls",
        "{}",
        ToolProtocol,
        choices=tuple(ToolProtocol),
        without="calls no function, so it has no protocol",
    ),
    "rounds": Rule(
        "Rounds at most",
        *("{} rounds", "{}-rounds", int, 1, MOST_ROUNDS),
        without="has no review, so it has one round",
    ),
    "accepted_from": Rule(
        "Mean rating that the reviewer accepts",
        *("content from {:g}", "from-{:g}", float, 1, 5),
        without="has no text review, so nothing is rated",
    ),
    "radius_m": Rule("Radius of the scene in the prompt, m", "{:g} m", "{:g}m", float, 20, 300),
    "prompt_version": Rule("Prompt version", "prompts {}", "p{}", str, most=12),
    "picture_px": Rule(
        "Width of the viewer's picture, px",
        *("pictures {} px", "{}px", int, 300, 2400),
        without="shows no picture",
    ),
    "block": Rule(
        "Block: within the answer, or by a schema in a call of its own",
        *("block by {}", "{}-block", BlockForm),
        choices=tuple(BlockForm),
    ),
}
NAMES = tuple(RULES)
_DEFAULTS: dict[str, Any] = {**asdict(Limits()), "protocol": ToolProtocol.PROMPT}


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
        block: How the modifier writes its block.

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
    block: BlockForm | None = None

    def __post_init__(self) -> None:
        problems = []
        for name, value in self.to_document().items():
            try:
                object.__setattr__(self, name, RULES[name].read(value))
            except ValueError as fault:
                problems.append((name, str(fault)))
        if problems:
            raise InvalidDocument("set of options", problems)

    def to_document(self) -> dict[str, Any]:
        """Return the chosen or fixed options, ready for JSON, without open ones."""
        values = {name: getattr(self, name) for name in NAMES}
        return {
            name: str(value) if isinstance(value, StrEnum) else value
            for name, value in values.items()
            if value is not None
        }

    def sampling(self, sample: int = 1) -> dict[str, Any]:
        """Return the sampling parameters of one sample; sample k has the seed + k - 1."""
        seed = None if self.seed is None else self.seed + sample - 1
        effort = self.reasoning_effort
        return {"temperature": self.temperature, "seed": seed, "reasoning_effort": effort}

    def key(self, sample: int = 1) -> dict[str, Any]:
        """Return the part of the cache key that sets these options and this sample apart.

        A default is no option of its own: so variants that ask the very same share the answer.
        """
        chosen = {
            name: value
            for name, value in self.to_document().items()
            if name != "prompt_version" and value != _DEFAULTS.get(name)
        }
        return chosen | ({"sample": sample} if sample > 1 else {})

    def describe(self) -> str:
        """Return the chosen options in a few words, for names; empty if there are none."""
        chosen = self.to_document().items()
        return ", ".join(RULES[name].words.format(value) for name, value in chosen)

    def slug(self) -> str:
        """Return the same as a part of a slug."""
        chosen = self.to_document().items()
        parts = [RULES[name].slug.format(value) for name, value in chosen]
        return "-".join(parts).lower().replace(".", "p")


def options_from_document(document: Mapping[str, Any]) -> ContestantOptions:
    """Return the options that a JSON document holds.

    Raises:
        InvalidDocument: A name is none of an option, or a value can't be.
    """
    unknown = [str(name) for name in document if name not in NAMES]
    if unknown:
        problem = f"is no option; there are {', '.join(NAMES)}"
        raise InvalidDocument("set of options", [(name, problem) for name in unknown])
    return ContestantOptions(**document)


def names_for(recipe: Recipe) -> tuple[str, ...]:
    """Return the options that a recipe has a use for."""
    useful = {"rounds", *recipe.review.options} if recipe.review else set[str]()
    if recipe.tools is not Tools.NONE:
        useful.add("protocol")
    return tuple(name for name in NAMES if name in useful or not RULES[name].without)


def check_options(recipe: Recipe, options: ContestantOptions) -> None:
    """Refuse options that would change nothing of a recipe.

    Raises:
        InvalidDocument: One is chosen.
    """
    useless = [name for name in options.to_document() if name not in names_for(recipe)]
    if useless:
        problems = [
            (f"options.{name}", f"{recipe.slug} {RULES[name].without}") for name in useless
        ]
        raise InvalidDocument("contestant", problems)


def complete_options(
    options: ContestantOptions, recipe: Recipe, *, native_tools: bool | None, prompt_version: str
) -> ContestantOptions:
    """Return the options with which a recipe runs, nothing of ours left open.

    Args:
        options: What was chosen.
        recipe: The variant.
        native_tools: What is known of the modifier's model.
        prompt_version: Of the texts that there are.
    """
    usual = {name: getattr(recipe.limits, name, None) for name in names_for(recipe)}
    if "protocol" in usual:
        usual["protocol"] = ToolProtocol.NATIVE if native_tools is True else ToolProtocol.PROMPT
    usual["prompt_version"] = prompt_version
    return ContestantOptions(**usual | options.to_document())


def recipe_with(recipe: Recipe, options: ContestantOptions) -> Recipe:
    """Return the recipe within the limits of these options."""
    limits = asdict(recipe.limits)
    chosen = {name: getattr(options, name) for name in options.to_document() if name in limits}
    return replace(recipe, limits=replace(recipe.limits, **chosen))
