"""A changed prompt is a visible change: look at it, then write the file anew.

python -m tests.prompts.test_golden
"""

from pathlib import Path

import pytest

from augment.prompts.calls import Tools
from augment.prompts.fill import (
    make_user_message,
    regenerate_messages,
    result_text,
    viewer_messages,
)
from augment.prompts.vectors import LaneFormat
from augment.scene.entities import Modification
from augment.scene.planned_motion import LanePath, NearEgo, PlannedMotion
from augment.variants.pipeline import modifier_options
from augment.variants.recipes import RECIPES, VQA
from augment.variants.respondents import ModelRole
from augment.variants.showing import ShownPrompt, build_prompt
from tests.scenes import junction, pedestrian, vehicle

GOLDEN = Path(__file__).parent / "golden"
WISH = "Add a parked car 21.4 m ahead of the ego.\nIt stands 0.5 m left of the lane centre."
TURNS = PlannedMotion(
    path=LanePath(lane_ids=("Lane1", "Connector2")),
    speeds=((1.5, 3.0),),
    start=NearEgo(within_m=12.0),
)
DONE = Modification(
    added=(
        vehicle("Agent2", 21.4, 0.5),
        pedestrian("Agent3", 24.0, -5.0, (24.0, 5.0)),
        vehicle("Agent4", 12.0, 0.0, speed_mps=6.0, lane_id="Lane1", motion=TURNS),
    )
)

CASES = [
    *(("otm", ModelRole.MODIFIER, False), ("fc", ModelRole.MODIFIER, False)),
    *(("fc", ModelRole.MODIFIER, True), ("fc-plus", ModelRole.MODIFIER, False)),
    *(("fc-plus", ModelRole.MODIFIER, True), ("tqa", ModelRole.REVIEWER, False)),
    *(("vqa", ModelRole.ENGINEER, False), ("vqa", ModelRole.VIEWER, False)),
]


def shown(variant: str, role: ModelRole, native: bool) -> str:
    made: ShownPrompt = build_prompt(
        RECIPES[variant], role, junction(), WISH, DONE, native_tools=native
    )
    parts = [f"=== {m.speaker}\n{m.text}\n" for m in made.messages]
    return "\n".join(parts)


def name(variant: str, role: ModelRole, native: bool) -> str:
    return f"{variant}-{role}{'-native' if native else ''}.txt"


@pytest.mark.parametrize("case", CASES, ids=lambda case: name(*case))
def test_the_prompt_is_what_the_golden_file_says(case: tuple[str, ModelRole, bool]) -> None:
    assert shown(*case) == (GOLDEN / name(*case)).read_text(encoding="utf-8")


def test_what_is_said_between_two_answers_is_what_the_golden_file_says() -> None:
    assert between() == (GOLDEN / "between.txt").read_text(encoding="utf-8")


def between() -> str:
    """Results and feedback, which come in the middle of a conversation."""
    told = [
        make_user_message(result_text(['{"x_m": 1.0}', '{"error": "no"}'], is_over=False)),
        make_user_message(result_text(['{"error": "no call is left"}'], is_over=True)),
        *regenerate_messages(
            (), ["It is in Lane2. Reason: a. Corrective action: b."], is_measured=False
        ),
        *regenerate_messages((), ["Wrong: Agent2 overlaps Agent3."], is_measured=True),
    ]
    return "\n".join(f"=== {message.speaker}\n{message.text}\n" for message in told)


def test_every_recipe_shows_one_of_these_prompts() -> None:
    for one in RECIPES.values():
        options = modifier_options(one)
        assert (options.lanes is LaneFormat.BEZIER) is (options.tools is not Tools.NONE)
        if one.review is VQA.review:
            (_, task) = viewer_messages(["a?", "b?", "c?"], [b"one", b"two"])
            assert task.images == (b"one", b"two")


if __name__ == "__main__":
    for one in CASES:
        (GOLDEN / name(*one)).write_text(shown(*one), encoding="utf-8")
    (GOLDEN / "between.txt").write_text(between(), encoding="utf-8")
