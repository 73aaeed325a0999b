"""Scenes and scenarios: how they come in, and how their rows are read as values."""

import hashlib
import json
import random
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction

from augment.baselines.rule_placer import list_open
from augment.checks import Ground
from augment.checks.derived import classify_change, describe_change
from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.formats.interplan.file import follow_rules, goal_place
from augment.llm.messages import shorten
from augment.models import BaseScene, Scenario
from augment.models.scenes import GOALS
from augment.scene import codec, entities
from augment.scene.density import keep_clear, spawn_traffic
from augment.scene.entities import ScenarioType as ScenarioType
from augment.scene.entities import in_type_order as in_type_order
from augment.scene.intent import Intent, IntentOrigin
from augment.scene.lane_graph import LaneGraph
from augment.scene.planned_mover import check_motions
from augment.scene.recording import Recording
from augment.services.events import log_change
from augment.services.scenarios.choosing import find_type, label_for
from augment.services.texts import SLUG_LENGTH, check_prose, check_slug, free_slug
from augment.simulation.expected import expect_recording

INSTRUCTION_LENGTH = 2_000
"""An instruction is read above the pictures, and by models: a few sentences."""


def placeable_intent(document: object) -> dict[str, Any]:
    """Return an intent as it is stored; whoever enters or accepts one comes through here.

    Raises:
        InvalidDocument: It breaks the format, or leaves open what the rule placer would refuse.
    """
    intent = codec.intent_from_document(document)
    problems = [
        (f"requests[{n}]", problem)
        for n, request in enumerate(intent.requests)
        for problem in list_open(request)
    ]
    if problems:
        raise InvalidDocument("intent", problems)
    return codec.intent_to_document(intent)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioContent:
    """The words and the drawing of a scenario, as they are entered.

    Attributes:
        type: The value of a `ScenarioType`, or a slug of one's own.
        instruction: What is to be changed, in the user's words.
        reference: A modification document that fits the scene.
        keep_traffic: Whether the recorded traffic stays.
        density: Of the traffic that is spawned where the recorded one is cleared; empty for none.
        goal: Where the ego's way turns; empty where nobody says.
        derives: Whether the reference says what is asked for, see `derive_intent`.
    """

    type: str
    instruction: str
    reference: Any = None
    keep_traffic: bool = False
    density: str = ""
    goal: str = ""
    derives: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class NewScenario(ScenarioContent):
    """A scenario that is to be added.

    Attributes:
        scene: The slug of a stored scene.
        slug: The scenario's name; made from the scene's and the type's when None.
        intent: An intent document.
        intent_origin: Where that comes from.
        traffic: Who is spawned, where that is known already; None to spawn it.
        interplan: The parts of interPlan's file that it comes from, with a generated instruction.
        follows: The slug of one on the scene whose results it changes further, in its traffic.
        variant_of: The slug of a scenario that it was made from: both are in one split.
    """

    scene: str
    slug: str | None = None
    intent: object = None
    intent_origin: IntentOrigin = IntentOrigin.ENTERED
    traffic: Sequence[entities.TrafficAgent] | None = None
    interplan: dict[str, Any] | None = None
    follows: str = ""
    variant_of: str = ""


@transaction.atomic
def add_scenario(new: NewScenario, *, actor: User | None = None) -> Scenario:
    """Keep an instruction for a scene, with its intent and reference if there are any.

    Raises:
        UnknownName: No such scene, or no such scenario on it.
        InvalidDocument: One of these breaks its format.
        InvalidModification: The reference does not fit the scene.
        Conflict: The slug is taken, or traffic is to be kept and spawned.
    """
    scenario = _new_scenario(_find_scene(new.scene), new.type, new.slug, new.follows)
    is_generated = new.interplan is not None
    scenario.origin = scenario_named(new.variant_of).origin if new.variant_of else None
    if (first := scenario.follows) is not None:
        new = replace(
            new,
            interplan=first.interplan,
            traffic=_read_spawned(first),
            keep_traffic=first.keep_traffic,
            density=first.traffic_density,
            goal=first.goal,
        )
    scenario.interplan = new.interplan
    surroundings = new.keep_traffic, new.density, new.goal
    _set_surroundings(scenario, *surroundings, new.traffic, new.reference)
    type, instruction = new.type, new.instruction
    if new.derives:
        type, instruction = derive_intent(scenario, type, instruction)
    set_wording(scenario, instruction, type)
    scenario.instruction_is_generated |= is_generated
    if new.intent is not None:
        _set_intent(scenario, new.intent, new.intent_origin)
    _insert(scenario, actor)
    return scenario


def add_variant(
    scenario: Scenario,
    *,
    difference: str,
    reference: entities.Modification,
    intent: Intent | None,
    actor: User | None = None,
) -> Scenario:
    """Keep a scenario that asks for the same with other numbers, named after the first.

    Args:
        scenario: Whose scene, traffic, goal and type it has.
        difference: What its instruction says beyond the first one's.
        reference: What is changed with these numbers.
        intent: With these numbers, None where nobody has written it down.
        actor: Who did it.
    """
    copied = ("base_scene", "type", "type_label", "keep_traffic", "traffic_density", "goal")
    more = ("spawned", "interplan", "language", "follows", "origin")
    variant = Scenario(
        slug=_number_slug(scenario.slug),
        instruction=shorten(f"{scenario.instruction} ({difference})", INSTRUCTION_LENGTH),
        reference=codec.modification_to_document(reference),
        instruction_is_generated=True,
        **{name: getattr(scenario, name) for name in (*copied, *more)},
    )
    if intent is not None:
        variant.intent = codec.intent_to_document(intent)
        variant.intent_origin = IntentOrigin.DERIVED
    _insert(variant, actor)
    return variant


def _find_scene(slug: str) -> BaseScene:
    row = BaseScene.objects.filter(slug=slug).first()
    if row is None:
        raise UnknownName("scene", slug, list(BaseScene.objects.values_list("slug", flat=True)))
    if row.retired_at is not None:
        raise Conflict(f"The scene “{row.slug}” is retired; offer it again first.")
    return row


def _new_scenario(scene: BaseScene, type: str, slug: str | None, follows: str) -> Scenario:
    if slug is not None:
        check_slug(slug, what="scenario")
    if not follows:
        return Scenario(slug=slug or _free_slug(scene, type), base_scene=scene)
    first = scene.scenarios.filter(slug=follows).first()
    if first is None:
        slugs = list(scene.scenarios.values_list("slug", flat=True))
        raise UnknownName(f"scenario of the scene “{scene.slug}”", follows, slugs)
    slug = slug or _number_slug(f"{first.slug}-then")
    return Scenario(slug=slug, base_scene=scene, follows=first)


def _set_intent(scenario: Scenario, intent: object, origin: IntentOrigin) -> None:
    # The catalogue leaves some open on purpose: the rule placer refuses them, models do not.
    if origin is IntentOrigin.ENTERED:
        scenario.intent = placeable_intent(intent)
    else:
        scenario.intent = codec.intent_to_document(codec.intent_from_document(intent))
    scenario.intent_origin = origin


def _insert(scenario: Scenario, actor: User | None) -> None:
    try:
        with transaction.atomic():
            scenario.save(force_insert=True)
    except IntegrityError:
        problem = f"There is a scenario called {scenario.slug!r} already; choose another slug."
        raise Conflict(problem) from None
    after = {
        "slug": scenario.slug,
        "scene": scenario.base_scene.slug,
        "type": scenario.type,
        "has_reference": scenario.reference is not None,
        "keep_traffic": scenario.keep_traffic,
        "intent": scenario.intent_origin or None,
        **({"follows": scenario.follows.slug} if scenario.follows else {}),
    }
    log_change(scenario, "add", actor, after=after)


def derive_intent(scenario: Scenario, type: str, instruction: str) -> tuple[str, str]:
    """Set what a scenario asks for, without saving, by what its reference changes.

    Args:
        scenario: With its reference; without one nothing derived is left.
        type: Of the scenario, empty for the one that the drawing looks like.
        instruction: In the user's words, empty where the drawing is to say it all.

    Returns:
        Type and instruction, both filled in.
    """
    loaded = LoadedScenario(scenario)
    reference, scene = loaded.reference, loaded.scene
    if reference is None or reference.is_empty:
        if scenario.intent_origin == IntentOrigin.DERIVED:
            scenario.intent, scenario.intent_origin = None, ""
        return type, instruction
    type = type or classify_change(reference, scene).value
    sentence, intent = describe_change(find_type(type), reference, scene)
    scenario.intent = None if intent is None else codec.intent_to_document(intent)
    scenario.intent_origin = "" if intent is None else IntentOrigin.DERIVED
    if not instruction.strip():
        scenario.instruction, scenario.instruction_is_generated = sentence, True
    return type, instruction.strip() or sentence


def set_wording(scenario: Scenario, instruction: str, type: str) -> None:
    """Set type and instruction without saving; an instruction that changes is a person's own.

    Raises:
        InvalidDocument: The type or the instruction breaks its format.
    """
    check_prose("instruction", instruction, what="scenario", longest=INSTRUCTION_LENGTH)
    scenario.type, scenario.type_label = type, label_for(type)
    scenario.instruction_is_generated &= scenario.instruction == instruction.strip()
    scenario.instruction = instruction.strip()


def change_surroundings(
    scenario: Scenario, *, keep_traffic: bool, density: str, goal: str
) -> None:
    """Set traffic and goal of a scenario that was never asked, without saving.

    Raises:
        InvalidDocument: There is no such density or goal.
        InvalidModification: The reference does not fit any more.
        Conflict: Traffic is to be kept and spawned, or it follows another scenario.
    """
    before = scenario.keep_traffic, scenario.traffic_density
    is_same_traffic = before == (keep_traffic, density or entities.TrafficDensity.NONE)
    if is_same_traffic and scenario.goal == goal:
        return
    if scenario.follows is not None:
        first = scenario.follows.slug
        raise Conflict(f"It follows “{first}”: its traffic and goal are that one's.")
    traffic = (_read_spawned(scenario) or None) if is_same_traffic else None
    if scenario.interplan and "built" in scenario.interplan and not is_same_traffic:
        # Other traffic takes other boxes, and nobody knows them.
        scenario.interplan = {**scenario.interplan, "built": {}}
    _set_surroundings(scenario, keep_traffic, density, goal, traffic, scenario.reference)
    scenario.original_image, scenario.windows = "", {}


def _read_spawned(scenario: Scenario) -> tuple[entities.TrafficAgent, ...]:
    spawned = scenario.spawned
    return () if spawned is None else codec.modification_from_document(spawned).added


def _set_surroundings(
    scenario: Scenario,
    keep_traffic: bool,
    density: str,
    goal: str,
    traffic: Sequence[entities.TrafficAgent] | None,
    reference: dict[str, Any] | None,
) -> None:
    """Keep them and the reference; spawned traffic stays whatever becomes of the reference."""
    choices = {"density": (density, [*entities.TrafficDensity]), "goal": (goal, [*GOALS])}
    problems = [
        (name, f"{value!r} must be one of {', '.join(allowed)}")
        for name, (value, allowed) in choices.items()
        if value and value not in allowed
    ]
    if problems:
        raise InvalidDocument("scenario", problems)
    spawned = entities.TrafficDensity(density or entities.TrafficDensity.NONE)
    if keep_traffic and spawned is not entities.TrafficDensity.NONE:
        raise Conflict("Spawned traffic replaces the recorded one: choose one of the two.")
    scenario.keep_traffic, scenario.traffic_density = keep_traffic, spawned.value
    scenario.goal = entities.TurnType(goal).value if goal else ""
    change = None if reference is None else codec.modification_from_document(reference)
    if traffic is None:
        base = scenario.base_scene
        bare = entities.without_traffic(codec.scene_from_document(base.document))
        traffic = spawn_traffic(bare, spawned, rng=random.Random(base.slug)).agents
        traffic = keep_clear(traffic, () if change is None else change.added)
    scenario.spawned = None
    if traffic:
        scenario.spawned = codec.modification_to_document(
            entities.Modification(added=tuple(traffic))
        )
    if change is not None:
        check_reference(LoadedScenario(scenario).scene, change)
        scenario.reference = codec.modification_to_document(change)


def scenario_named(slug: str) -> Scenario:
    """Return a scenario.

    Raises:
        UnknownName: There is none.
    """
    row = Scenario.objects.select_related("base_scene").filter(slug=slug).first()
    if row is None:
        raise UnknownName("scenario", slug, list(Scenario.objects.values_list("slug", flat=True)))
    return row


class LoadedScenario:
    """Documents of a stored scenario as values, each read once, when it is first asked for.

    Args:
        row: With its scene; it must not change meanwhile.

    Raises:
        InvalidDocument: By each of the values, where what is stored can't be read.
    """

    def __init__(self, row: Scenario) -> None:
        self.row = row

    @cached_property
    def scene(self) -> entities.Scene:
        """Scene that contestants are asked to change, with the scenario's own traffic and goal."""
        row, scene = self.row, codec.scene_from_document(self.row.base_scene.document)
        scene = follow_rules(scene, row.interplan)
        if not row.keep_traffic:
            scene = entities.without_traffic(scene)
        if row.spawned is not None:
            scene = entities.apply(scene, codec.modification_from_document(row.spawned))
        options = scene.options
        if not row.keep_traffic:
            options = replace(options, density=entities.TrafficDensity(row.traffic_density))
        if row.goal:
            place_m = goal_place(row.interplan, row.goal, scene)
            options = replace(options, goal=entities.TurnType(row.goal), goal_m=place_m)
        return replace(scene, options=options)

    @cached_property
    def recording(self) -> Recording | None:
        """Recording after t0, None for none; the ego's alone if traffic is cleared."""
        document = self.row.base_scene.recording
        recording = None if document is None else codec.recording_from_document(document)
        return recording.ego_alone if recording and not self.row.keep_traffic else recording

    @cached_property
    def ground(self) -> Ground:
        """Ground of the scene, whose recording is read where something moves."""
        return Ground.of(self.scene, self.expect)

    @cached_property
    def reference(self) -> entities.Modification | None:
        """Human modification, None for a scenario without one."""
        document = self.row.reference
        return None if document is None else codec.modification_from_document(document)

    @cached_property
    def intent(self) -> Intent | None:
        """Intent of the instruction, None if nobody has written it down."""
        return None if self.row.intent is None else codec.intent_from_document(self.row.intent)

    def expect(
        self, scene: entities.Scene, modification: entities.Modification
    ) -> Recording | None:
        """Return `expect_recording` of the scenario's scene."""
        return expect_recording(scene, modification, self.recording)


def scene_key(scenario: Scenario) -> str:
    """A digest of all that a scene is read from; two scenarios of one key have the same scene."""
    scene = scenario.base_scene
    parts = [
        scene.content_hash or content_hash(scene.document),
        scenario.keep_traffic,
        scenario.traffic_density,
        scenario.goal,
        scenario.spawned,
        scenario.interplan if scenario.goal else None,
    ]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def content_hash(document: dict[str, Any]) -> str:
    """Return a hash that is equal for scene documents differing in name and provenance alone."""
    content = {key: value for key, value in document.items() if key not in ("name", "provenance")}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def scenario_seed(slug: str) -> int:
    """The seed of a scenario: the same in every job, another for every slug."""
    return int.from_bytes(hashlib.sha256(slug.encode()).digest()[:4], "big")


def check_reference(scene: entities.Scene, modification: entities.Modification) -> None:
    """Raise unless a modification fits the scene, with its lanes and motions.

    Raises:
        InvalidModification: An agent does not fit, or can't move as it is to.
        InvalidDocument: An agent names a lane that the scene does not have.
    """
    check_motions(scene, modification)
    lanes = LaneGraph(scene).lanes
    problems = [
        (f"{agent.id}.lane_id", f"{agent.lane_id!r} is not a lane or connector of the scene")
        for agent in modification.changed
        if agent.lane_id is not None and agent.lane_id not in lanes
    ]
    if problems:
        raise InvalidDocument("modification", problems)


# Private


def _free_slug(base_scene: BaseScene, name: str) -> str:
    kind = find_type(name)
    stem = (name if kind is None else kind.name).lower().replace("_", "-")
    return _number_slug(f"{base_scene.slug[: SLUG_LENGTH - len(stem) - 10].strip('-')}-{stem}")


def _number_slug(stem: str) -> str:
    return free_slug(Scenario.objects, stem, otherwise="scenario", starts_at=1)
