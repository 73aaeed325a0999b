"""All settings, read from the environment; docs/deploying.md lists the variables.

The defaults let a newcomer run at once: SQLite and files under var/ and media/.
"""

import hashlib
import re
import secrets
import tempfile
from datetime import timedelta
from pathlib import Path
from typing import Any

from csp.constants import NONE, SELF

from arena.config.env import BASE_DIR as BASE_DIR
from arena.config.env import close_folder, make_sqlite_file, read_environment
from arena.exports.files import write_once

ENV = read_environment()
VAR_DIR = ENV.ARENA_VAR_DIR
close_folder(VAR_DIR)

# --- Who may reach it --------------------------------------------------------------------------

DEBUG = ENV.ARENA_DEBUG
ALLOWED_HOSTS = ENV.ARENA_HOSTS
CSRF_TRUSTED_ORIGINS = ENV.ARENA_ORIGINS
HTTPS = ENV.ARENA_HTTPS


def _secret_key() -> str:
    """From the environment, else a key that is made once and kept in var/."""
    path = VAR_DIR / "secret_key"
    if ENV.ARENA_SECRET_KEY:
        return ENV.ARENA_SECRET_KEY
    if not path.exists():
        # The server and its workers start at once: the first key made is the key of all.
        write_once(path, secrets.token_urlsafe(50).encode())
    return path.read_text()


SECRET_KEY = _secret_key()
SESSION_COOKIE_SECURE = CSRF_COOKIE_SECURE = HTTPS
SECURE_SSL_REDIRECT = HTTPS
SECURE_REDIRECT_EXEMPT = [r"^(healthz|readyz|metrics)$"]  # asked from inside, without the proxy
SECURE_HSTS_SECONDS = 31_536_000 if HTTPS else 0
SECURE_PROXY_SSL_HEADER = ("HTTP_X_FORWARDED_PROTO", "https") if HTTPS else None
PROXIES = ENV.ARENA_PROXIES
SESSION_COOKIE_AGE = 30 * 24 * 3600
CONTENT_SECURITY_POLICY = {
    "DIRECTIVES": {
        **{f"{kind}-src": [SELF] for kind in ("script", "style", "font", "connect")},
        "form-action": [SELF],
        "default-src": [NONE],
        "base-uri": [NONE],
        "frame-ancestors": [NONE],
        "img-src": [SELF, "blob:"],
    }
}

# Wrong passwords lock an account for the address that sent them, not for the whole world: nobody
# can lock out somebody else. Far more of them, whatever the accounts, lock the address.
# Kept in the database, so it holds for every web server.
AXES_HANDLER = "arena.config.login.LoginLimit"
ADDRESS_FAILURE_LIMIT = ENV.ARENA_LOGIN_FAILURES_ADDRESS
AXES_LOCKOUT_PARAMETERS = [["username", "ip_address"]]
AXES_FAILURE_LIMIT = 5
AXES_COOLOFF_TIME = timedelta(minutes=15)
AXES_RESET_COOL_OFF_ON_FAILURE_DURING_LOCKOUT = False
AXES_RESET_ON_SUCCESS = True
AXES_DISABLE_ACCESS_LOG = True
AXES_VERBOSE = False
AXES_CLIENT_IP_CALLABLE = "arena.config.login.client_address"
AXES_LOCKOUT_CALLABLE = "arena.config.faults.answer_locked"

# --- What it is made of ------------------------------------------------------------------------

INSTALLED_APPS = [
    "django.contrib.auth",
    "django.contrib.contenttypes",
    "django.contrib.sessions",
    "django.contrib.messages",
    "django.forms",
    "whitenoise.runserver_nostatic",
    "django.contrib.staticfiles",
    "axes",
    "csp",
    "rest_framework",
    "augment",
    "arena",
]
MIDDLEWARE = [
    "arena.config.middleware.HeaderMiddleware",
    "django.middleware.security.SecurityMiddleware",
    "csp.middleware.CSPMiddleware",
    "whitenoise.middleware.WhiteNoiseMiddleware",
    "django.contrib.sessions.middleware.SessionMiddleware",
    "arena.site.language.VoterLanguageMiddleware",
    "django.middleware.common.CommonMiddleware",
    "django.middleware.csrf.CsrfViewMiddleware",
    "django.contrib.auth.middleware.AuthenticationMiddleware",
    "arena.config.middleware.SignInMiddleware",
    "django.contrib.messages.middleware.MessageMiddleware",
    "django.middleware.clickjacking.XFrameOptionsMiddleware",
    "axes.middleware.AxesMiddleware",
    "arena.config.middleware.FaultMiddleware",
]
ROOT_URLCONF = "arena.config.urls"
TEMPLATES = [
    {
        "BACKEND": "django.template.backends.django.DjangoTemplates",
        "DIRS": [BASE_DIR / "templates"],
        "APP_DIRS": True,
        "OPTIONS": {
            "context_processors": [
                "django.template.context_processors.request",
                "django.contrib.auth.context_processors.auth",
                "django.contrib.messages.context_processors.messages",
            ]
        },
    }
]
CSRF_FAILURE_VIEW = "arena.config.faults.answer_forged"
LOGIN_URL = "login"
LOGIN_REDIRECT_URL = "home"
LOGOUT_REDIRECT_URL = "login"
AUTHENTICATION_BACKENDS = [
    "axes.backends.AxesStandaloneBackend",  # refuses before a password is looked at
    "arena.people.queries.AccountBackend",
]
PASSWORD_RESET_TIMEOUT = 14 * 24 * 3600  # how long a link to set a password works
AUTH_PASSWORD_VALIDATORS = [
    {"NAME": "django.contrib.auth.password_validation.MinimumLengthValidator"},
    {"NAME": "django.contrib.auth.password_validation.CommonPasswordValidator"},
]
LANGUAGE_CODE = "en"
LANGUAGES = [("en", "English"), ("de", "Deutsch")]
LOCALE_PATHS = [VAR_DIR / "locale"]  # where `prepare` compiles the catalogue
FORM_RENDERER = "arena.shell.forms.PageRenderer"
FORMAT_MODULE_PATH = ["arena.config.formats"]
TIME_ZONE = "UTC"
DEFAULT_AUTO_FIELD = "django.db.models.BigAutoField"

REST_FRAMEWORK = {
    "DEFAULT_AUTHENTICATION_CLASSES": [
        "arena.api.access.BearerToken",
        "rest_framework.authentication.SessionAuthentication",
    ],
    "DEFAULT_RENDERER_CLASSES": ["rest_framework.renderers.JSONRenderer"],
    "DEFAULT_SCHEMA_CLASS": "arena.api.views.ArenaSchema",
    "EXCEPTION_HANDLER": "arena.api.errors.answer_error",
    "UNICODE_JSON": False,  # a refused value is named, and UTF-8 has no lone surrogate
}
SPECTACULAR_SETTINGS = {
    "TITLE": "Scenario Arena",
    "VERSION": "1",
    "OAS_VERSION": "3.1.1",
    "SCHEMA_PATH_PREFIX": "/api/v1/",
    "POSTPROCESSING_HOOKS": [],  # what a field may be is said where the field is
    "ENUM_GENERATE_CHOICE_DESCRIPTION": False,
}

# --- Where things are kept ---------------------------------------------------------------------


def _database() -> dict[str, object]:
    """The database; SQLite gets what concurrent votes need.

    Django's defaults lose 38 to 61 % of concurrent votes to "database is locked": a deferred
    transaction that turns into a writer can't wait. IMMEDIATE ones queue up instead, and WAL lets
    readers go on meanwhile. FULL: what is confirmed is on the disk, also after a power cut; it
    costs a vote 0.3 ms.
    """
    engine: dict[str, object] = ENV.DATABASE_URL or {
        "ENGINE": "django.db.backends.sqlite3",
        "NAME": str(VAR_DIR / "arena.sqlite3"),  # not every path can be written as a URL
    }
    if engine["ENGINE"] == "django.db.backends.sqlite3":
        engine["OPTIONS"] = {
            "timeout": 20,
            "transaction_mode": "IMMEDIATE",
            # Else INSERT OR REPLACE would pass by the triggers that refuse to delete.
            "init_command": "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; "
            "PRAGMA recursive_triggers=ON;",
        }
        # Tests run on a file as well: threads that vote at once need what a memory database lacks.
        engine["TEST"] = {"NAME": str(VAR_DIR / "test.sqlite3")}
        make_sqlite_file(Path(str(engine["NAME"])))
    else:
        engine["CONN_HEALTH_CHECKS"] = True
    # Opening a connection for every request would cost as much as a vote, on SQLite as well.
    engine["CONN_MAX_AGE"] = 600
    return engine


DATABASES = {"default": _database()}
MEDIA_ROOT = ENV.ARENA_MEDIA_DIR
if "OPTIONS" not in ENV.ARENA_MEDIA_URL:  # no bucket
    close_folder(MEDIA_ROOT)
STATIC_ROOT = VAR_DIR / "static"
STATIC_URL = "static/"
STATICFILES_DIRS = [BASE_DIR / "static"]
STORAGES: dict[str, dict[str, Any]] = {
    "default": ENV.ARENA_MEDIA_URL,
    "staticfiles": {"BACKEND": "arena.config.storage.ModuleStorage"},
}
WHITENOISE_KEEP_ONLY_HASHED_FILES = True

# Files by which somebody sends something; larger ones are let pass by unread.
UPLOAD_MB = ENV.ARENA_UPLOAD_MB
SUBMISSIONS_A_DAY = ENV.ARENA_SUBMISSIONS_A_DAY
FILE_UPLOAD_HANDLERS = [
    "arena.config.uploads.BoundedUpload",
    "django.core.files.uploadhandler.MemoryFileUploadHandler",
    "django.core.files.uploadhandler.TemporaryFileUploadHandler",
]

# --- Background work ---------------------------------------------------------------------------

# Without REDIS_URL every process of this folder meets on one socket, where `manage.py serve`
# starts a private Redis: a second terminal reaches the running one. Sockets have short paths only,
# and the path is part of a URL, in which some signs mean something else.
PRIVATE_REDIS_SOCKET = VAR_DIR / "redis.sock"
if not re.fullmatch(r"[A-Za-z0-9/._ -]{1,100}", str(PRIVATE_REDIS_SOCKET)):
    digest = hashlib.sha256(str(VAR_DIR).encode()).hexdigest()[:16]
    PRIVATE_REDIS_SOCKET = Path(tempfile.gettempdir()) / f"arena-{digest}.sock"
REDIS_IS_PRIVATE = not ENV.REDIS_URL
REDIS_URL = ENV.REDIS_URL or f"redis+socket://{PRIVATE_REDIS_SOCKET}"
CELERY_BROKER_URL = REDIS_URL
CELERY_TASK_IGNORE_RESULT = True
CELERY_TASK_ACKS_LATE = True
CELERY_TASK_REJECT_ON_WORKER_LOST = True
CELERY_WORKER_PREFETCH_MULTIPLIER = 1
CELERY_BROKER_CONNECTION_RETRY_ON_STARTUP = True
# Asking models is waiting, drawing and driving is computing: each can have workers of its own.
CELERY_TASK_DEFAULT_QUEUE = "models"
# The last is what messages of earlier releases may still wait in.
CELERY_TASK_QUEUES: dict[str, dict[str, str]] = {"models": {}, "drawing": {}, "celery": {}}
CELERY_TASK_ROUTES = {
    "augment.draw": {"queue": "drawing"},
    "arena.draw_checks": {"queue": "drawing"},
}
CELERY_BROKER_TRANSPORT_OPTIONS = {"visibility_timeout": 3600, "socket_connect_timeout": 5}

HEARTBEAT_S = ENV.ARENA_HEARTBEAT_S
STALE_AFTER_S = ENV.ARENA_STALE_AFTER_S
RECOVER_EVERY_S = ENV.ARENA_RECOVER_EVERY_S
# A planner is code that workers import: beside the built-in ones these alone.
PLANNERS = tuple(ENV.ARENA_PLANNERS)
LLM_QUEUE_S = ENV.ARENA_LLM_QUEUE_S
LLM_TIMEOUT_S = ENV.ARENA_LLM_TIMEOUT_S
LLM_ANSWER_MB = 8
LLM_PROXY = ENV.ARENA_LLM_PROXY
KEY_VARIABLES = ENV.ARENA_KEY_VARIABLES

VOTE_WAIT_S = 5
VOTES_PER_S = ENV.ARENA_VOTES_PER_S

# --- What it says about itself -----------------------------------------------------------------

LOG_LEVEL = ENV.ARENA_LOG_LEVEL.upper()
LOG_FORM = ENV.ARENA_LOG_FORM
METRICS_TOKEN = ENV.ARENA_METRICS_TOKEN
LOGGING = {
    "version": 1,
    "disable_existing_loggers": False,
    "formatters": {
        "line": {"format": "{asctime} {levelname:7} {name}: {message}", "style": "{"},
        "json": {
            "()": "pythonjsonlogger.json.JsonFormatter",
            "fmt": "{asctime}{levelname}{name}{message}{process}{threadName}",
            "style": "{",
            "rename_fields": {"asctime": "at", "levelname": "level", "threadName": "thread"},
        },
    },
    "filters": {"no_keys": {"()": "arena.config.logs.HideKeys"}},
    "handlers": {
        "console": {
            "class": "logging.StreamHandler",
            "formatter": LOG_FORM,
            "filters": ["no_keys"],
        }
    },
    "root": {"handlers": ["console"], "level": LOG_LEVEL},
    "loggers": {
        "django.request": {"level": "ERROR"},
        "django.server": {"handlers": ["console"], "propagate": False},
        **{name: {"level": "WARNING"} for name in ("axes", "fontTools", "httpx2", "matplotlib")},
        # Threads of the web worker take turns at a queue on purpose: an entry is no news.
        "waitress.queue": {"level": "ERROR"},
    },
}
