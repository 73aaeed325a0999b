"""The wire alone: the pages' view of an image is stood in for."""

from django.http import HttpRequest, HttpResponse
from django.urls import include, path


def image(request: HttpRequest, token: str) -> HttpResponse:
    return HttpResponse(status=204)


urlpatterns = [
    path("api/v1/", include("arena.site.api_urls")),
    path("i/<str:token>", image, name="matchup-image"),
]
