"""Addresses of the pages of contestants, endpoints and models."""

from __future__ import annotations

from django.urls import URLPattern, path

from arena.contestants.pages import contestants, endpoints

urlpatterns: list[URLPattern] = [
    path("contestants/", contestants.contestants_page, name="contestants"),
    path("contestants/new/", contestants.new_contestant_page, name="contestant-new"),
    path("contestants/<uuid:code>/", contestants.contestant_page, name="contestant"),
    path("contestants/<uuid:code>/retired/", contestants.set_retired, name="contestant-retired"),
    path("endpoints/", endpoints.endpoints_page, name="endpoints"),
    path("endpoints/new/", endpoints.new_endpoint_page, name="endpoint-new"),
    path("endpoints/<uuid:code>/", endpoints.endpoint_page, name="endpoint"),
    path("endpoints/<uuid:code>/models/", endpoints.add_model, name="endpoint-model-new"),
    path("models/<uuid:code>/", endpoints.model_page, name="endpoint-model"),
    path("models/<uuid:code>/probe/", endpoints.probe_model, name="endpoint-probe"),
]
