"""A contestant of chosen options at a server that says the same few things again and again."""

from typing import Any

from augment.models import Augmentation, Contestant, EndpointModel
from augment.services.endpoints import contestants
from augment.services.endpoints.contestants import ContestantRequest
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.running import jobs, runner
from augment.services.running.jobs import JobRequest
from tests.jobs.rows import add_scenario
from tests.llm.json_server import JsonServer
from tests.scenes import cone, scene
from tests.variants.playing import car, questions, rating, verdict

CAR = car(21.4, id="Agent9")
MEAN_3 = rating(3, 3, 3, "Too far left.")
SCRIPTS = {
    "otm": [CAR],
    "fc": [CAR],
    "fc-plus": [CAR],
    "tqa": [CAR, MEAN_3],
    "vqa": [CAR, questions(), "1. yes\n2. yes\n3. yes", verdict()],
}

Bodies = list[dict[str, Any]]


class Scripted(JsonServer):
    """Says the same few things again and again, refuses some parameters, keeps what it got."""

    def __init__(
        self,
        *script: str,
        refuses: tuple[str, ...] = (),
        usage: dict[str, int | None] | None = None,
    ) -> None:
        super().__init__()
        self.refuses = set(refuses)
        self.script = list(script or [CAR])
        self.usage = usage
        self.bodies: Bodies = []

    def answer(self, body: dict[str, Any]) -> tuple[int, dict[str, Any]]:
        for name in sorted(self.refuses & body.keys()):
            refused = {"code": "unsupported_parameter", "param": name}
            return 400, {"error": {"message": f"Unsupported parameter: {name!r}."} | refused}
        said = self.script[len(self.bodies) % len(self.script)]
        if said == CAR:  # another one in each round, so that no review is asked for twice
            said = car(20.0 + len(self.bodies), id="Agent9")
        self.bodies.append(body)
        message = {"role": "assistant", "content": said}
        choice = {"index": 0, "finish_reason": "stop", "message": message}
        made = {"id": "1", "object": "chat.completion", "created": 0, "model": body["model"]}
        usage = {} if self.usage is None else {"usage": self.usage}
        return 200, made | {"choices": [choice]} | usage


def add(server: Scripted, slug: str, variant: str = "otm", **options: object) -> Contestant:
    ensure_endpoint(EndpointRequest(label="here", base_url=server.url))
    server.script = SCRIPTS[variant]
    made = contestants.add_contestant(
        ContestantRequest(slug=slug, variant=variant, endpoint="here", model="m", options=options)
    )
    assert made.endpoint is not None
    EndpointModel.objects.filter(endpoint=made.endpoint, model="m").update(vision=True)
    return made


def run(*slugs: str, samples: int = 1) -> list[Augmentation]:
    """The rows of a job on one street, by contestant and sample."""
    if not Augmentation.objects.exists():
        far = scene(agents=(cone("far", 60.0, 0.0),))
        add_scenario(
            "street", scene=far, keep_traffic=True, reference=None, intent=None, intent_origin=""
        )
    job = jobs.launch(
        JobRequest(name="J", contestants=slugs, scenarios=["street"], samples=samples)
    )
    for row in job.augmentations.order_by("contestant__slug", "sample"):
        runner.AUGMENTATIONS.perform(row.pk)
    return list(job.augmentations.order_by("contestant__slug", "sample"))
