"""The WSGI application that gunicorn serves."""

import os

from django.core.wsgi import get_wsgi_application
from django.db.backends.signals import connection_created

os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")
application = get_wsgi_application()

from arena.config.middleware import limit_connection  # noqa: E402 -- needs the settings

connection_created.connect(limit_connection)
