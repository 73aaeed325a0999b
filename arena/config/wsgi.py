"""The WSGI application that gunicorn serves."""

import os

from django.core.wsgi import get_wsgi_application

os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")
application = get_wsgi_application()

from arena.config.middleware import limit_connections  # noqa: E402 -- needs the settings

limit_connections()
