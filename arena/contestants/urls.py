"""Addresses of the pages of contestants, endpoints and models."""

from django.urls import URLPattern, path

from arena.contestants import pages

urlpatterns: list[URLPattern] = [
    path("contestants/", pages.contestants_page, name="contestants"),
    path("contestants/new/", pages.new_contestant_page, name="contestant-new"),
    path("contestants/<uuid:code>/", pages.contestant_page, name="contestant"),
    path("contestants/<uuid:code>/retired/", pages.set_retired, name="contestant-retired"),
    path("endpoints/", pages.endpoints_page, name="endpoints"),
    path("endpoints/new/", pages.new_endpoint_page, name="endpoint-new"),
    path("endpoints/<uuid:code>/", pages.endpoint_page, name="endpoint"),
    path("endpoints/<uuid:code>/models/", pages.new_model, name="endpoint-model-new"),
    path("endpoints/<uuid:code>/listed/", pages.listed_models, name="endpoint-listed"),
    path("models/<uuid:code>/", pages.model_page, name="endpoint-model"),
    path("models/<uuid:code>/probe/", pages.probe_model, name="endpoint-probe"),
]
