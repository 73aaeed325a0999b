"""Django's admin shows nothing of arena: people, studies and votes have pages of their own.

Those know what an open study may tell, and that accounts keep names which plans hold.
"""

from django.contrib import admin
from django.contrib.auth.models import Group, User

admin.site.unregister((User, Group))
