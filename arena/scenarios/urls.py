"""Addresses of the pages of scenes, scenarios and augmentations."""

from django.urls import URLPattern, path

from arena.scenarios.pages import augmentations, benchmarks, editor, scenarios, uploads

urlpatterns: list[URLPattern] = [
    path("scenes/", uploads.scenes_page, name="scenes"),
    path("scenes/send/", uploads.send_file, name="scene-send"),
    path("scenes/<uuid:code>/", editor.scene_page, name="scene"),
    path("scenes/<uuid:code>/check/", editor.check_change, name="edit-check"),
    path("uploads/<uuid:code>/", uploads.upload_page, name="upload"),
    path("uploads/<uuid:code>/show/", uploads.show_moment, name="upload-show"),
    path("uploads/<uuid:code>/remove/", uploads.remove, name="upload-remove"),
    path("scenarios/", scenarios.scenarios_page, name="scenarios"),
    path("scenarios/load/", scenarios.load_scenarios, name="catalogue-load"),
    path("scenarios/bulk/", scenarios.bulk_page, name="scenarios-bulk"),
    path("scenarios/<uuid:code>/prompts/", augmentations.prompts_page, name="prompts"),
    path(
        "scenarios/<uuid:code>/prompts/<int:number>.png",
        augmentations.prompt_image,
        name="prompt-image",
    ),
    path("scenarios/<uuid:code>/", scenarios.scenario_page, name="scenario"),
    path(
        "scenarios/<uuid:code>/delete/",
        scenarios.delete,
        {"kind": "scenario"},
        name="scenario-delete",
    ),
    path("scenes/<uuid:code>/delete/", scenarios.delete, {"kind": "scene"}, name="scene-delete"),
    path("scenarios/<uuid:code>/retired/", scenarios.set_retired, name="scenario-retired"),
    path("scenarios/<uuid:code>/edit/", editor.edit_page, name="scenario-edit"),
    path("scenarios/<uuid:code>/intent/", scenarios.set_intent, name="set-intent"),
    path("scenarios/<uuid:code>/read/", scenarios.read_instruction, name="intent-read"),
    path("scenarios/<uuid:code>/intent.json", scenarios.intent_file, name="intent"),
    path("benchmarks/", benchmarks.benchmarks_page, name="benchmarks"),
    path("benchmarks/new/", benchmarks.new_benchmark_page, name="benchmark-new"),
    path("benchmarks/<uuid:code>/", benchmarks.benchmark_page, name="benchmark"),
    path("benchmarks/<uuid:code>/write/", benchmarks.write_zip, name="benchmark-write"),
    path("benchmarks/<uuid:code>/file/", benchmarks.download_benchmark, name="benchmark-file"),
    path("benchmarks/<uuid:code>/retired/", benchmarks.retire_benchmark, name="benchmark-retired"),
    path("pictures/<slug:kind>/<uuid:code>.png", augmentations.picture, name="picture"),
    path("augmentations/<uuid:code>/", augmentations.augmentation_page, name="augmentation"),
    path("augmentations/<uuid:code>/correct/", editor.correct_page, name="correct"),
    path("augmentations/<uuid:code>/transcript.json", augmentations.transcript, name="transcript"),
    path("asked/<slug:digest>.png", augmentations.asked_image, name="asked-image"),
]
