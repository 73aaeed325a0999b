"""Scenes, scenarios and the catalogue as rows, and their pictures."""

from augment.services.scenarios.catalogue import load_catalogue
from augment.services.scenarios.choosing import (
    LONGEST_TYPE,
    resolve_scenarios,
    type_choices,
    type_label,
    types_named,
)
from augment.services.scenarios.editing import (
    accept_reading,
    enter_intent,
    intent_statements,
    last_reading,
    waiting_reading,
)
from augment.services.scenarios.pair_pictures import draw_pair
from augment.services.scenarios.pictures import (
    SceneView,
    camera_key,
    film_document,
    film_name,
    is_drawn,
    legends_of_changes,
    list_marks,
    load_camera,
    picture_view,
    redraw,
    reference_picture,
    scene_picture,
)
from augment.services.scenarios.prompts import (
    ShownPrompt,
    list_recipes,
    preview_prompt,
    prompt_version,
)
from augment.services.scenarios.scene_imports import note_sentences
from augment.services.scenarios.scenes import (
    INSTRUCTION_LENGTH,
    NewScenario,
    ScenarioType,
    add_scenario,
    in_type_order,
)
from augment.services.scenarios.thumbnails import THUMBNAILS, WIDTHS_PX, shrink
from augment.services.scenarios.uploads import most_megabytes
