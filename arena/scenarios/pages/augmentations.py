"""Pages of single augmentations and of the prompts that lead to them, with all pictures."""

import re
import uuid

from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render

from arena.contestants.queries import show_options
from arena.scenarios.queries import modification_lines, step_changes
from arena.shell import access, acts, forms, pictures
from augment.errors import AugmentError
from augment.models import Augmentation, BaseScene, Scenario, Simulation, UploadMoment
from augment.services import read_request, running, scenarios, to_inputs
from augment.services.judging import check_augmentation
from augment.services.judging.displacement import of_rows
from augment.services.running.calls import IMAGES

State = Augmentation.State


class FollowUpForm(forms.RequestForm):
    """Next instruction of a conversation, and its caps."""

    inputs = to_inputs(running.FollowUpRequest)


@access.page_for(*access.STAFF)
def augmentation_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one augmentation with everything that led to it."""
    augmentation = _augmentation(code)
    can_go_on = augmentation.is_answer and augmentation.contestant.endpoint is not None
    tries, checked = running.list_tries(augmentation), check_augmentation(augmentation)
    context = {
        "augmentation": augmentation,
        "lines": modification_lines(augmentation.modification),
        **acts.wait_for_workers(waits=augmentation.state in Augmentation.UNDER_WAY),
        "steps": _steps(augmentation),
        "follow_ups": augmentation.follow_ups.select_related("scenario"),
        "form": FollowUpForm() if can_go_on else None,
        "corrections": augmentation.corrections.select_related("contestant", "made_by"),
        "drive": augmentation.simulations.filter(state=Simulation.State.DONE).first(),
        "nuplan_results": augmentation.nuplan_results.all(),
        "measured": of_rows([augmentation.pk])[0],
        "checked": checked,
        "tries": tries,
        "asking": show_options(augmentation.contestant, augmentation.options),
        "totals": running.sum_totals(tries),
    }
    return render(request, "jobs/augmentation.html", context)


@access.act_for(access.ADMIN, back="augmentation")
def follow_up(request: HttpRequest, code: uuid.UUID) -> HttpResponse | None:
    """Have the contestant change its own answer further."""
    form = FollowUpForm(request.POST)
    if not form.is_valid():
        acts.tell_errors(request, form)
        return None
    wish = read_request(running.FollowUpRequest, form.cleaned_data)
    made = running.ask_follow_up(_augmentation(code), wish, actor=access.get_user(request))
    acts.send_later(request, made)
    return redirect("augmentation", code=made.code)


def _steps(row: Augmentation) -> list[tuple[Augmentation, list[str]]]:
    """Return the steps up to this one, each with what it changed of the step before."""
    steps = running.steps_to(row)
    before = [None, *(step.modification for step in steps)]
    return [
        (step, step_changes(was, step.modification) if step.modification else [])
        for was, step in zip(before, steps, strict=False)
    ]


def _augmentation(code: uuid.UUID) -> Augmentation:
    rows = Augmentation.objects.select_related(
        *("job", "scenario__base_scene", "contestant__endpoint", "made_by"),
        *("corrects__contestant", "follows__scenario"),
    )
    return get_object_or_404(rows.defer("scenario__base_scene__recording"), code=code)


@access.page_for(*access.STAFF)
def transcript(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Answer with the whole record of an augmentation as one JSON file."""
    answer = JsonResponse(
        running.full_transcript(_augmentation(code)),
        json_dumps_params={"indent": 2, "ensure_ascii": False},
    )
    answer["Content-Disposition"] = f'attachment; filename="transcript-{code}.json"'
    answer["Cache-Control"] = "private, no-store"
    return answer


@access.page_for(*access.STAFF)
def show_asked_image(request: HttpRequest, digest: str) -> HttpResponseBase:
    """Answer with an image that a language model was shown, by the hash in its request."""
    if not re.fullmatch(r"[0-9a-f]{64}", digest):
        raise Http404
    return pictures.picture_response(f"{IMAGES}/{digest}.png")


@access.page_for(*access.STAFF)
def picture(request: HttpRequest, kind: str, code: uuid.UUID) -> HttpResponseBase:
    """Answer with a picture by what it shows; experts' pictures have other addresses."""
    match kind:
        case "original":
            name = get_object_or_404(
                Scenario.objects.only("original_image"), code=code
            ).original_image
        case "augmentation":
            name = get_object_or_404(Augmentation.objects.only("image"), code=code).image
        case "change":
            row = _augmentation(code)
            return pictures.resize_picture(request, row.image, row)
        case "labelled":
            return _draw_labels(code)
        case "moment":
            name = get_object_or_404(UploadMoment.objects.only("picture"), code=code).picture
        case "reference":
            name = scenarios.pictures.reference_picture(find_scenario(code))
        case _ if kind in set(scenarios.pictures.SceneView):
            scene = get_object_or_404(BaseScene.objects.defer("recording"), code=code)
            name = scenarios.pictures.scene_picture(scene, scenarios.pictures.SceneView(kind))
        case _:
            raise Http404
    return pictures.resize_picture(request, name)


def _draw_labels(code: uuid.UUID) -> HttpResponse:
    try:
        png = scenarios.pictures.draw_with_ids(_augmentation(code))
    except AugmentError as error:
        raise Http404 from error
    return HttpResponse(png, content_type="image/png")


# --- Prompts -----------------------------------------------------------------------------------


@access.page_for(*access.STAFF)
def prompts_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show the exact messages of a variant's role, with about how many tokens they are."""
    scenario = find_scenario(code)
    problem, shown = "", None
    try:
        shown = _preview(request, scenario)
    except AugmentError as error:
        problem = str(error)
    role, variant = request.GET.get("role", "modifier"), request.GET.get("variant", "otm")
    choices = scenarios.list_recipes()
    context = {
        "scenario": scenario,
        "choices": choices,
        "chosen": next((choice for choice in choices if choice.slug == variant), None),
        "role": role,
        "is_native": "native" in request.GET,
        "shown": shown,
        "version": scenarios.prompt_version(),
        "problem": problem,
        "query": request.GET.urlencode(),
    }
    return render(request, "scenarios/prompts.html", context)


@access.page_for(*access.STAFF)
def prompt_image(request: HttpRequest, code: uuid.UUID, number: int) -> HttpResponse:
    """Answer with a picture that the viewer of a variant would be shown."""
    try:
        shown = _preview(request, find_scenario(code))
    except AugmentError as error:
        raise Http404 from error
    images = shown.messages[-1].images
    if number >= len(images):
        raise Http404
    return HttpResponse(images[number], content_type="image/png")


def find_scenario(code: uuid.UUID) -> Scenario:
    """Return a scenario without its scene's recording, or raise 404."""
    rows = Scenario.objects.select_related("base_scene").defer("base_scene__recording")
    return get_object_or_404(rows, code=code)


def _preview(request: HttpRequest, scenario: Scenario) -> scenarios.ShownPrompt:
    return scenarios.preview_prompt(
        scenario,
        variant=request.GET.get("variant", "otm"),
        role=request.GET.get("role", "modifier"),
        native_tools="native" in request.GET,
    )
