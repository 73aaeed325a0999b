"""Access to pages, and the response to an act that a service refuses."""

from collections.abc import Callable
from functools import partial, wraps
from typing import Concatenate, ParamSpec, cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.http import HttpRequest, HttpResponse, HttpResponseBase
from django.http.response import HttpResponseRedirectBase
from django.middleware.csrf import CSRF_TOKEN_LENGTH
from django.shortcuts import redirect, render
from django.urls import NoReverseMatch
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.errors import StillUnderWay
from arena.shell.accounts import top_role
from arena.shell.receipts import StoredAnswer, answer_once, digest_body
from augment.errors import AugmentError

P = ParamSpec("P")
View = Callable[Concatenate[HttpRequest, P], HttpResponseBase]

ADMIN, RESEARCHER, EXPERT, ENTRANT = "admin", "researcher", "expert", "entrant"

STAFF = (ADMIN, RESEARCHER)
"""Who may know which contestant made what."""

BENCHMARK_READERS = (*STAFF, ENTRANT)
"""Who may look at benchmarks and get their folders, which hold no reference of the test."""

BACKEND = "arena.people.queries.AccountBackend"
FORM_METHODS = ["GET", "HEAD", "POST"]
CSRF_FIELD = "csrfmiddlewaretoken"
CREATED = 201
"""The status of a page that shows this once what a form made, such as a link."""

GONE = 410
"""The status of a link that is over."""


def allow_only(*roles: str) -> Callable[[View[P]], View[P]]:
    """Refuse other roles with 403, and carry out once what a form sends.

    Django's middleware stops who is not signed in.
    """

    def wrap(view: View[P]) -> View[P]:
        @wraps(view)
        def guard(request: HttpRequest, /, *args: P.args, **kwargs: P.kwargs) -> HttpResponseBase:
            if top_role(request.user) not in roles:
                raise PermissionDenied
            return _answer_once(request, partial(view, request, *args, **kwargs))

        return guard

    return wrap


def page_for(*roles: str) -> Callable[[View[P]], View[P]]:
    """Decorate a page that is only looked at."""
    return lambda view: allow_only(*roles)(require_safe(view))


def form_for(*roles: str) -> Callable[[View[P]], View[P]]:
    """Decorate a page with a form that is sent to the same address."""
    return lambda view: allow_only(*roles)(require_http_methods(FORM_METHODS)(view))


def act_for(
    *roles: str, back: str
) -> Callable[[Callable[Concatenate[HttpRequest, P], HttpResponseBase | None]], View[P]]:
    """Decorate a POST: what a service refuses becomes a message on the page it came from.

    Args:
        roles: Who may do it.
        back: The name of that page, which has the same `code` in its address, or none. A view
            that returns None leads there as well.
    """

    def wrap(view: Callable[Concatenate[HttpRequest, P], HttpResponseBase | None]) -> View[P]:
        @wraps(view)
        def act(request: HttpRequest, /, *args: P.args, **kwargs: P.kwargs) -> HttpResponseBase:
            answer = None
            try:
                answer = view(request, *args, **kwargs)
            except AugmentError as error:
                messages.error(request, str(error))
            return answer or _lead_to(back, kwargs.get("code"))

        return allow_only(*roles)(require_POST(act))

    return wrap


def _answer_once(request: HttpRequest, act: Callable[[], HttpResponseBase]) -> HttpResponseBase:
    """Answer a form as it was shown and filled in once; sent again, it shows what it made.

    Every page that is shown has a CSRF token of its own, which says which form it is.
    """
    token = request.POST.get(CSRF_FIELD, "")
    if request.method != "POST" or len(token) != CSRF_TOKEN_LENGTH:
        return act()
    sent = [(name, values) for name, values in request.POST.lists() if name != CSRF_FIELD]
    body = digest_body(sent) + digest_body(request.FILES)
    context: dict[str, object] = {"is_whole": not request.FILES, "sent": sent}
    try:
        key = f"form {request.user.pk} {request.get_full_path()} {token} {body}"
        answer = answer_once(key, digest_body(key), act, _pack)
    except StillUnderWay:
        return render(request, "sent.html", context, status=409)
    if not isinstance(answer, StoredAnswer):
        return answer
    if answer.status == CREATED:
        return HttpResponse(answer.content, status=CREATED)
    made = answer.content.decode()
    if answer.is_late:
        return render(request, "sent.html", context | {"made": made})
    return redirect(made)


def _pack(answer: HttpResponseBase) -> tuple[int, bytes] | None:
    """Return the address that a form led to, or the page that shows this once what it made."""
    if isinstance(answer, HttpResponseRedirectBase):
        return answer.status_code, answer.url.encode()
    if isinstance(answer, HttpResponse) and answer.status_code == CREATED:
        return CREATED, answer.content
    return None


def _lead_to(page: str, code: object) -> HttpResponse:
    try:
        return redirect(page, code=code)
    except NoReverseMatch:
        return redirect(page)


def get_user(request: HttpRequest) -> User:
    """Return who is signed in, for a view that others can't reach."""
    return cast(User, request.user)


def keep_secret(answer: HttpResponse) -> HttpResponse:
    """Let nobody learn the address of a page that is a key: no referrer, no search engine.

    With "no-referrer" browsers hide the origin of the page's form as well, and it is refused.
    """
    answer["Referrer-Policy"] = "strict-origin"
    answer["X-Robots-Tag"] = "noindex, nofollow"
    return answer
