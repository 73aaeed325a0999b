"""All settings, read from the environment; docs/deploying.md lists the variables.

The defaults let a newcomer run at once: SQLite and files under var/ and media/.
"""

import hashlib
import os
import re
import secrets
import tempfile
from datetime import timedelta
from pathlib import Path
from typing import Any

from csp.constants import NONE, SELF

from arena.config import env, private
from arena.exports.files import write_once

BASE_DIR = Path(__file__).resolve().parents[2]
VAR_DIR = env.folder("ARENA_VAR_DIR", default=BASE_DIR / "var")
private.make_folder(VAR_DIR)
private.mend_folder(VAR_DIR, around=BASE_DIR)

# --- Who may reach it --------------------------------------------------------------------------

DEBUG = env.boolean("ARENA_DEBUG", default=False)
ALLOWED_HOSTS = env.names("ARENA_HOSTS", default=("localhost", "127.0.0.1", "[::1]"))
CSRF_TRUSTED_ORIGINS = env.origins("ARENA_ORIGINS")
HTTPS = env.boolean("ARENA_HTTPS", default=False)


def _secret_key() -> str:
    """From the environment, else a key that is made once and kept in var/."""
    kept = VAR_DIR / "secret_key"
    given = env.read("ARENA_SECRET_KEY", "", str, "any long random text")
    if given:
        return given
    private.mend_file(kept)
    if not kept.exists():
        # The server and its workers start at once: the first key made is the key of all.
        write_once(kept, secrets.token_urlsafe(50).encode())
    return kept.read_text()


SECRET_KEY = _secret_key()
SESSION_COOKIE_SECURE = CSRF_COOKIE_SECURE = HTTPS
SECURE_SSL_REDIRECT = HTTPS
SECURE_REDIRECT_EXEMPT = [r"^(healthz|readyz|metrics)$"]  # asked from inside, without the proxy
SECURE_HSTS_SECONDS = 31_536_000 if HTTPS else 0
SECURE_PROXY_SSL_HEADER = ("HTTP_X_FORWARDED_PROTO", "https") if HTTPS else None
PROXIES = env.integer("ARENA_PROXIES", default=0, low=0, high=9)
SESSION_COOKIE_AGE = 30 * 24 * 3600
X_FRAME_OPTIONS = "DENY"
SECURE_REFERRER_POLICY = "same-origin"
CONTENT_SECURITY_POLICY = {
    "DIRECTIVES": {
        "default-src": [NONE],
        "script-src": [SELF],
        "style-src": [SELF],
        "img-src": [SELF, "blob:"],
        "font-src": [SELF],
        "connect-src": [SELF],
        "form-action": [SELF],
        "base-uri": [NONE],
        "frame-ancestors": [NONE],
    }
}

# Wrong passwords lock an account for the address that sent them, not for the whole world: nobody
# can lock out somebody else. Far more of them, whatever the accounts, lock the address.
# Kept in the database, so it holds for every web server.
AXES_HANDLER = "arena.config.login.LoginLimit"
ADDRESS_FAILURE_LIMIT = env.integer(
    "ARENA_LOGIN_FAILURES_ADDRESS", default=50, low=1, high=100_000
)
AXES_LOCKOUT_PARAMETERS = [["username", "ip_address"]]
AXES_FAILURE_LIMIT = env.integer("ARENA_LOGIN_FAILURES", default=5, low=1, high=100)
AXES_COOLOFF_TIME = timedelta(
    minutes=env.integer("ARENA_LOGIN_LOCK_MIN", default=15, low=1, high=1440)
)
AXES_RESET_COOL_OFF_ON_FAILURE_DURING_LOCKOUT = False
AXES_RESET_ON_SUCCESS = True
AXES_DISABLE_ACCESS_LOG = True
AXES_VERBOSE = False
AXES_CLIENT_IP_CALLABLE = "arena.config.login.client_address"
AXES_LOCKOUT_CALLABLE = "arena.config.faults.answer_locked"

# --- What it is made of ------------------------------------------------------------------------

INSTALLED_APPS = [
    "arena.config.admin_site.SiteConfig",
    "django.contrib.auth",
    "django.contrib.contenttypes",
    "django.contrib.sessions",
    "django.contrib.messages",
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
    "django.contrib.auth.middleware.LoginRequiredMiddleware",
    "django.contrib.messages.middleware.MessageMiddleware",
    "django.middleware.clickjacking.XFrameOptionsMiddleware",
    "axes.middleware.AxesMiddleware",
    "arena.config.middleware.BusyMiddleware",
]
ROOT_URLCONF = "arena.config.urls"
WSGI_APPLICATION = "arena.config.wsgi.application"
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
FORMAT_MODULE_PATH = ["arena.config.formats"]
USE_I18N = True
USE_TZ = True
TIME_ZONE = "UTC"
DEFAULT_AUTO_FIELD = "django.db.models.BigAutoField"

REST_FRAMEWORK = {
    "DEFAULT_AUTHENTICATION_CLASSES": [
        "arena.api.access.BearerToken",
        "rest_framework.authentication.SessionAuthentication",
    ],
    "DEFAULT_PERMISSION_CLASSES": ["rest_framework.permissions.IsAuthenticated"],
    "DEFAULT_RENDERER_CLASSES": ["rest_framework.renderers.JSONRenderer"],
    "DEFAULT_PARSER_CLASSES": ["rest_framework.parsers.JSONParser"],
    "DEFAULT_SCHEMA_CLASS": "arena.api.views.ArenaSchema",
}
SPECTACULAR_SETTINGS = {
    "TITLE": "Scenario Arena",
    "VERSION": "1",
    "OAS_VERSION": "3.1.1",
    "SCHEMA_PATH_PREFIX": "/api/v1/",
    "SERVE_INCLUDE_SCHEMA": False,
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
    found = env.database("DATABASE_URL", default=VAR_DIR / "arena.sqlite3")
    if found["ENGINE"] == "django.db.backends.sqlite3":
        found["OPTIONS"] = {
            "timeout": 20,
            "transaction_mode": "IMMEDIATE",
            # Else INSERT OR REPLACE would pass by the triggers that refuse to delete.
            "init_command": "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; "
            "PRAGMA recursive_triggers=ON;",
        }
        # Tests run on a file as well: threads that vote at once need what a memory database lacks.
        found["TEST"] = {"NAME": str(VAR_DIR / "test.sqlite3")}
        env.sqlite_file("DATABASE_URL", Path(str(found["NAME"])))
    else:
        found["CONN_HEALTH_CHECKS"] = True
    # Opening a connection for every request would cost as much as a vote, on SQLite as well.
    found["CONN_MAX_AGE"] = 600
    return found


DATABASES = {"default": _database()}
MEDIA_ROOT = env.folder("ARENA_MEDIA_DIR", default=BASE_DIR / "media")
private.mend_folder(MEDIA_ROOT, around=BASE_DIR)
STATIC_ROOT = VAR_DIR / "static"
STATIC_URL = "static/"
STATICFILES_DIRS = [BASE_DIR / "static"]
STORAGES: dict[str, dict[str, Any]] = {
    "default": env.media("ARENA_MEDIA_URL"),
    "staticfiles": {"BACKEND": "arena.config.storage.ModuleStorage"},
}
WHITENOISE_KEEP_ONLY_HASHED_FILES = True

# Files by which somebody sends something; larger ones are let pass by unread.
UPLOAD_MB = env.integer("ARENA_UPLOAD_MB", default=200, low=1, high=4096)
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
REDIS_URL = env.redis("REDIS_URL", default=f"redis+socket://{PRIVATE_REDIS_SOCKET}")
REDIS_IS_PRIVATE = REDIS_URL.startswith("redis+socket:") and "REDIS_URL" not in os.environ
CELERY_BROKER_URL = REDIS_URL
CELERY_TASK_IGNORE_RESULT = True
CELERY_TASK_ACKS_LATE = True
CELERY_TASK_REJECT_ON_WORKER_LOST = True
CELERY_WORKER_PREFETCH_MULTIPLIER = 1
CELERY_BROKER_CONNECTION_RETRY_ON_STARTUP = True
CELERY_TASK_ALWAYS_EAGER = False
# Asking models is waiting, drawing and driving is computing: each can have workers of its own.
CELERY_TASK_DEFAULT_QUEUE = "models"
# The last is what messages of earlier releases may still wait in.
CELERY_TASK_QUEUES: dict[str, dict[str, str]] = {"models": {}, "drawing": {}, "celery": {}}
CELERY_TASK_ROUTES = {
    "augment.draw": {"queue": "drawing"},
    "arena.draw_checks": {"queue": "drawing"},
}
CELERY_BROKER_TRANSPORT_OPTIONS = {"visibility_timeout": 3600, "socket_connect_timeout": 5}
CELERY_TIMEZONE = "UTC"

HEARTBEAT_S = env.integer("ARENA_HEARTBEAT_S", default=5, low=1, high=60)
STALE_AFTER_S = env.integer("ARENA_STALE_AFTER_S", default=20, low=2, high=3600)
# Else every row would be taken away from the worker that is busy with it.
env.at_least_twice("ARENA_STALE_AFTER_S", STALE_AFTER_S, "ARENA_HEARTBEAT_S", HEARTBEAT_S)
RECOVER_EVERY_S = env.integer("ARENA_RECOVER_EVERY_S", default=30, low=1, high=3600)
# A planner is code that workers import: beside the built-in ones these alone.
PLANNERS = env.dotted_paths("ARENA_PLANNERS")

LLM_QUEUE_S = env.integer("ARENA_LLM_QUEUE_S", default=1800, low=1, high=86400)
LLM_TIMEOUT_S = env.integer("ARENA_LLM_TIMEOUT_S", default=120, low=1, high=3600)
LLM_ANSWER_MB = env.integer("ARENA_LLM_ANSWER_MB", default=8, low=1, high=256)
LLM_PROXY = env.proxy("ARENA_LLM_PROXY")
KEY_VARIABLES = env.key_variables("ARENA_KEY_VARIABLES")

# --- Voting ------------------------------------------------------------------------------------

VOTE_WAIT_S = env.integer("ARENA_VOTE_WAIT_S", default=5, low=1, high=60)
VOTES_PER_S = env.integer("ARENA_VOTES_PER_S", default=4, low=1, high=1000)

# --- What it says about itself -----------------------------------------------------------------

LOG_LEVEL = env.choice(
    "ARENA_LOG_LEVEL", default="info", allowed=("debug", "info", "warning", "error")
).upper()
LOG_FORM = env.choice("ARENA_LOG_FORM", default="line", allowed=("line", "json"))
METRICS_TOKEN = env.read("ARENA_METRICS_TOKEN", "", str, "any long random text")
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
        "axes": {"level": "WARNING"},
        "fontTools": {"level": "WARNING"},
        "matplotlib": {"level": "WARNING"},
        "httpx2": {"level": "WARNING"},
        # Threads of the web worker take turns at a queue on purpose: an entry is no news.
        "waitress.queue": {"level": "ERROR"},
    },
}
