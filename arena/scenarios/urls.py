"""Addresses of the pages of scenes, scenarios and augmentations."""

from django.urls import URLPattern, path

from arena.scenarios.pages import augmentations, forms, scenarios, uploads

urlpatterns: list[URLPattern] = [
    path("scenes/", uploads.scenes_page, name="scenes"),
    path("scenes/send/", uploads.send_file, name="scene-send"),
    path("scenes/<uuid:code>/", uploads.scene_page, name="scene"),
    path("uploads/<uuid:code>/", uploads.upload_page, name="upload"),
    path("uploads/<uuid:code>/show/", uploads.show_moment, name="upload-show"),
    path("uploads/<uuid:code>/remove/", uploads.remove, name="upload-remove"),
    path("moments/<uuid:code>/keep/", uploads.keep_moment, name="moment-keep"),
    path("scenarios/", scenarios.scenarios_page, name="scenarios"),
    path("scenarios/load/", scenarios.load_scenarios, name="catalogue-load"),
    path("scenarios/bulk/", forms.bulk_page, name="scenarios-bulk"),
    path("scenes/<uuid:code>/new/", forms.new_scenario_page, name="scenario-new"),
    path("scenarios/<uuid:code>/prompts/", augmentations.prompts_page, name="prompts"),
    path(
        "scenarios/<uuid:code>/prompts/<int:number>.png",
        augmentations.prompt_image,
        name="prompt-image",
    ),
    path("scenarios/<uuid:code>/", scenarios.scenario_page, name="scenario"),
    path("scenarios/<uuid:code>/reference/", forms.reference_page, name="reference-edit"),
    path("scenarios/<uuid:code>/check/", forms.check_change, name="edit-check"),
    path(
        "scenarios/<uuid:code>/delete/",
        scenarios.delete,
        {"kind": "scenario"},
        name="scenario-delete",
    ),
    path("scenes/<uuid:code>/delete/", scenarios.delete, {"kind": "scene"}, name="scene-delete"),
    path("scenarios/<uuid:code>/retired/", scenarios.set_retired, name="scenario-retired"),
    path("scenarios/<uuid:code>/edit/", forms.edit_page, name="scenario-edit"),
    path("scenarios/<uuid:code>/intent/fields/", forms.intent_page, name="intent-edit"),
    path("scenarios/<uuid:code>/intent/", scenarios.set_intent, name="set-intent"),
    path("scenarios/<uuid:code>/read/", scenarios.read_instruction, name="intent-read"),
    path("scenarios/<uuid:code>/intent.json", scenarios.intent_file, name="intent"),
    path("pictures/<slug:kind>/<uuid:code>.png", augmentations.picture, name="picture"),
    path("augmentations/<uuid:code>/", augmentations.augmentation_page, name="augmentation"),
    path("augmentations/<uuid:code>/correct/", forms.correct_page, name="correct"),
    path("augmentations/<uuid:code>/transcript.json", augmentations.transcript, name="transcript"),
    path("asked/<slug:digest>.png", augmentations.asked_image, name="asked-image"),
]
