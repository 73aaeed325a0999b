"""How a contestant asks, beyond its model and its variant: a frozen value.

None means: left open, so that the default counts, or what is known of the model. Names, checks,
documents, labels and slugs all derive from the fields of `ContestantOptions`.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from typing import Any

from augment.errors import InvalidDocument
from augment.variants.recipes import Recipe, Tools
from augment.variants.respondents import Sampling
from augment.variants.reviews import Limits

EFFORTS = ("none", "minimal", "low", "medium", "high", "xhigh", "max")
"""What endpoints call how long a model thinks; not every one takes each."""

HIGHEST_SEED = 2**31 - 1
MOST_SAMPLES = 100
MOST_ROUNDS = 10
_LIMITS = Limits()


class ToolProtocol(StrEnum):
    """How a modifier calls its function: by a line of its answer, or on the wire's own way."""

    PROMPT = "prompt"
    NATIVE = "native"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rule:
    """What is to know of an option besides its name.

    Attributes:
        words: A value in a name for people.
        slug: A value as a part of a slug.
        kind: What a value is.
        least, most: The range of a number.
        choices: The values of a text, where these are few.
        pattern: What a text looks like, where there are no choices.
        default: What counts where it is left open; None where nothing does.
        without: Why a recipe has no use for it; empty where all have one.
    """

    words: str
    slug: str
    kind: type = int
    least: float = 0
    most: float = 0
    choices: tuple[str, ...] = ()
    pattern: str = ""
    default: object = None
    without: str = ""

    def read(self, value: Any) -> Any:
        """Return the value as what it is.

        Raises:
            ValueError: It can't be; the text says what may be.
        """
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if self.choices:
            fits, allowed = value in self.choices, f"one of {', '.join(self.choices)}"
        elif self.pattern:
            fits = isinstance(value, str) and re.fullmatch(self.pattern, value) is not None
            allowed = "twelve hexadecimal digits"
        else:
            is_kind = self.kind is float or isinstance(value, int)
            fits = is_number and is_kind and self.least <= value <= self.most
            noun = "number" if self.kind is float else "whole number"
            allowed = f"a {noun} from {self.least} to {self.most}"
        if not fits:
            raise ValueError(f"{value!r} must be {allowed}")
        return self.kind(value)


def _option(words: str, slug: str, **rule: Any) -> Any:
    return field(default=None, metadata={"rule": _Rule(words=words, slug=slug, **rule)})


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

    temperature: float | None = _option("temperature {:g}", "t{:g}", kind=float, least=0, most=2)
    seed: int | None = _option("seed {}", "s{}", most=HIGHEST_SEED - MOST_SAMPLES)
    reasoning_effort: str | None = _option("effort {}", "{}-effort", kind=str, choices=EFFORTS)
    max_output_tokens: int | None = _option(
        "answers to {} tokens",
        "{}-tokens",
        least=1,
        most=1_000_000,
        default=_LIMITS.max_output_tokens,
    )
    protocol: ToolProtocol | None = _option(  # noqa: RUF009
        "{} calls",
        "{}",
        kind=ToolProtocol,
        choices=tuple(ToolProtocol),
        default=ToolProtocol.PROMPT,
        without="calls no function, so it has no protocol",
    )
    rounds: int | None = _option(
        "{} rounds",
        "{}-rounds",
        least=1,
        most=MOST_ROUNDS,
        default=_LIMITS.rounds,
        without="has no review, so it has one round",
    )
    accepted_from: float | None = _option(
        "content from {:g}",
        "from-{:g}",
        kind=float,
        least=1,
        most=5,
        default=_LIMITS.accepted_from,
        without="has no text review, so nothing is rated",
    )
    radius_m: float | None = _option(
        "{:g} m", "{:g}m", kind=float, least=20, most=300, default=_LIMITS.radius_m
    )
    prompt_version: str | None = _option("prompts {}", "p{}", kind=str, pattern="[0-9a-f]{12}")
    picture_px: int | None = _option(
        "pictures {} px",
        "{}px",
        least=300,
        most=2400,
        default=_LIMITS.picture_px,
        without="shows no picture",
    )

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
        """Return what was chosen or fixed, ready for JSON; what is open is not in it."""
        values = {name: getattr(self, name) for name in NAMES}
        return {
            name: str(value) if isinstance(value, StrEnum) else value
            for name, value in values.items()
            if value is not None
        }

    def sampling(self, sample: int = 1) -> Sampling:
        """Return what the requests of one sample are sent with; sample k has the seed + k - 1."""
        return Sampling(
            temperature=self.temperature,
            seed=None if self.seed is None else self.seed + sample - 1,
            reasoning_effort=self.reasoning_effort,
        )

    def key(self, sample: int = 1) -> dict[str, Any]:
        """Return what keeps the answers of these options and this sample apart from all others.

        A default is no option of its own: so variants that ask the very same share the answer.
        """
        chosen = {
            name: value
            for name, value in self.to_document().items()
            if name != "prompt_version" and value != RULES[name].default
        }
        return chosen | ({"sample": sample} if sample > 1 else {})

    def describe(self) -> str:
        """Return what was chosen in a few words, for names; empty where nothing was."""
        chosen = self.to_document().items()
        return ", ".join(RULES[name].words.format(value) for name, value in chosen)

    def slug(self) -> str:
        """Return the same as a part of a slug."""
        chosen = self.to_document().items()
        parts = [RULES[name].slug.format(value) for name, value in chosen]
        return "-".join(parts).lower().replace(".", "p")


RULES: dict[str, _Rule] = {one.name: one.metadata["rule"] for one in fields(ContestantOptions)}
NAMES = tuple(RULES)


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
    allowed = names_for(recipe)
    problems = [
        (f"options.{name}", f"{recipe.slug} {RULES[name].without}")
        for name in options.to_document()
        if name not in allowed
    ]
    if problems:
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
    return options_from_document(usual | options.to_document())


def recipe_with(recipe: Recipe, options: ContestantOptions) -> Recipe:
    """Return the recipe within the limits of these options."""
    known = {one.name for one in fields(Limits)}
    chosen = {name: value for name, value in options.to_document().items() if name in known}
    return replace(recipe, limits=replace(recipe.limits, **chosen))
