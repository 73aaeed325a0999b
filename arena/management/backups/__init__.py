"""One file with everything that an installation knows: rows, pictures and the key of sessions.

The rows are written as values, not as a dump of one database, so that a backup of SQLite can be
restored on PostgreSQL and the other way round. A backup is restored by the release that made it
(the same migrations), and by no other.
"""
