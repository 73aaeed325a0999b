"""Every address of the product."""

from django.urls import include, path

import arena.tasks  # noqa: F401 - pages send messages of the kinds that it registers

urlpatterns = [
    path("api/v1/", include("arena.site.api_urls")),
    path("", include("arena.site.urls")),
]

handler400 = "arena.config.faults.answer_unreadable"
handler403 = "arena.config.faults.answer_refused"
handler404 = "arena.config.faults.answer_missing"
handler500 = "arena.config.faults.answer_broken"
